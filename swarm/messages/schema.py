"""The JSON Schemas of the wire: one for each message, requests and answers included, and an index of the topics."""

import json
from inspect import cleandoc
from typing import Any, Final

import msgspec

from swarm.messages import REPLIES, TOPICS
from swarm.messages.fields import VERSION, Message
from swarm.messages.topic import Sequence, Topic

DIALECT: Final = "https://json-schema.org/draft/2020-12/schema"


def kinds() -> dict[str, type[Message]]:
    """Return every message that crosses the wire by name: those of the topics first, then the answers."""
    return {kind.__name__: kind for kind in (*(topic.message for topic in TOPICS), *REPLIES.values())}


def types() -> dict[str, dict[str, Any]]:
    """Return the schema of every type of the wire by name: of messages, their parts and what is attached to them."""
    _, shapes = msgspec.json.schema_components([*kinds().values(), Sequence])
    return dedent_descriptions(shapes)


def dedent_descriptions(shapes: dict[str, dict[str, Any]]) -> dict[str, dict[str, Any]]:
    """Return schemas whose descriptions, which are docstrings, are without the indentation of the code."""
    return {
        name: shape | {"description": cleandoc(shape["description"])} if "description" in shape else shape
        for name, shape in shapes.items()
    }


def schema_of(kind: type[Message]) -> str:
    """Return the JSON Schema of a message, with the schemas of all its parts in ``$defs``."""
    schema = {"$schema": DIALECT, "title": f"swarm/v{VERSION} {kind.__name__}"} | msgspec.json.schema(kind)
    return _text(schema | {"$defs": dedent_descriptions(schema["$defs"])})


def build_index() -> str:
    """Return the table of topics: for each key its message, its answer and its rates, and the file of each schema."""
    return _text({"title": f"swarm/v{VERSION}", "topics": {topic.key: _row(topic) for topic in TOPICS}})


def _row(topic: Topic[Any]) -> dict[str, Any]:
    row: dict[str, Any] = {"message": {"$ref": f"{topic.message.__name__}.json"}, "encoding": topic.encoding}
    if topic.key in REPLIES:
        row["answer"] = {"$ref": f"{REPLIES[topic.key].__name__}.json"}
    return row | {
        "rate": topic.rate, "timeout": topic.timeout, "reliable": topic.reliable, "limit": topic.limit,
    }  # fmt: skip


def _text(schema: dict[str, Any]) -> str:
    return json.dumps(schema, indent=1).replace("\\\\Z", "$") + "\n"  # JSON Schema writes the end of a text as $
