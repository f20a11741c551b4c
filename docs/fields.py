"""Makes the tables of fields from the types of scenario files and of the wire."""

import inspect
import re
from enum import StrEnum
from typing import Any, Final

import msgspec

from dashboard.box.browser_request import OF_A_ROBOT, REQUESTS
from dashboard.box.frames import Overview, Why
from dashboard.box.questions import MomentAnswer, Question
from dashboard.fold.overlays import Joint, Learned
from docs.markdown import rows
from swarm import messages as wire
from swarm.messages import REPLIES, TOPICS, enums
from swarm.messages.schema import dedent_descriptions, types
from swarm.settings import LocalisationSettings, Section, Settings

MEMBER: Final = re.compile(r'^    \w+ = "(\w+)"  # (.*)$')


def topics() -> str:
    """Return the table of topics."""
    body = [
        (
            f"`{topic.key}`",
            _link(topic.message.__name__),
            f"{topic.rate:g} Hz" if topic.rate else "on change" if topic.key not in REPLIES else "on request",
            f"{topic.timeout:g} s" if topic.timeout else "never",
            "waits" if topic.reliable else "drops",
            f"{topic.limit // 1024} KiB",
            _link(REPLIES[topic.key].__name__) if topic.key in REPLIES else "",
        )
        for topic in TOPICS
    ]
    head = ("key below `swarm/v1/<fleet>/`", "message", "rate", "stale after", "without room", "limit", "answer")
    return rows(head, *body)


def messages() -> str:
    """Return the sections on all types of the wire, traffic included, field by field."""
    shapes = _wire_shapes()
    meanings = _meanings()
    parts = []
    for name, shape in shapes.items():
        text = shape.get("description", "").replace("``", "`")
        if name in meanings:
            table = rows(("value", "meaning"), *((f"`{value}`", meaning) for value, meaning in meanings[name]))
        else:
            table = rows(HEAD, *_body(shape))
            text += " An array, in this order." if shape["type"] == "array" else ""
        parts.append(f"### {name}\n\n{text}\n\n{table}")
    return "\n\n".join(parts)


def scenario() -> str:
    """Return the sections on a scenario file, field by field."""
    shapes = dedent_descriptions(msgspec.json.schema_components([Settings])[1])
    order = ["Settings", *(name for name in shapes if name != "Settings")]
    places = {name: place for place, name in _places()}
    parts = []
    for name in order:
        title = f"### `{places[name]}`" if places.get(name) else "### The top level"
        text = shapes[name].get("description", "").replace("``", "`")
        parts.append(f"{title}\n\n{text}\n\n{rows(HEAD, *_body(shapes[name]))}")
    return "\n\n".join(parts)


def frames() -> str:
    """Return the sections on the box's own frames, field by field."""
    _, shapes = msgspec.json.schema_components([Overview, Why, Joint, Learned, Question, MomentAnswer])
    own = {name: shape for name, shape in shapes.items() if "properties" in shape and not hasattr(wire, name)}
    text = "\n\n".join(
        f"### {name}\n\n{shape['description']}\n\n{rows(HEAD, *_body(shape))}" for name, shape in own.items()
    )
    here = {name.lower() for name in own}
    return re.sub(r"\]\(#(\w+)\)", lambda link: link[0] if link[1] in here else f"](wire.md#{link[1]})", text)


def paths() -> str:
    """Return the table of the box's requests."""
    body = [
        (
            f"`POST /{name}{'?robot=NAME' if topic.key in OF_A_ROBOT else ''}`",
            f"`{topic.key}`",
            f"[{topic.message.__name__}](wire.md#{topic.message.__name__.lower()})",
        )
        for name, topic in REQUESTS.items()
    ]
    return rows(("path", "asks on", "with"), *body)


HEAD: Final = ("field", "type", "range", "default", "unit and meaning")


def _wire_shapes() -> dict[str, dict[str, Any]]:
    """Return the schemas of the wire's types; those of a scenario file have a page of their own."""
    kinds: list[type[Any]] = [Settings, *Section.__subclasses__()]
    own = {kind.__name__ for kind in kinds}
    return {name: shape for name, shape in types().items() if name not in own}


def _meanings() -> dict[str, list[tuple[str, str]]]:
    """Return for each enumeration its values and the comments beside them."""
    found = {}
    for name, kind in vars(enums).items():
        if inspect.isclass(kind) and issubclass(kind, StrEnum) and kind is not StrEnum:
            lines = inspect.getsource(kind).splitlines()
            found[name] = [(match[1], match[2]) for line in lines if (match := MEMBER.match(line))]
    return found


def _body(shape: dict[str, Any]) -> list[tuple[str, ...]]:
    """Return the rows on the fields of one type; the page says once that each payload has a ``v``."""
    if shape["type"] == "array":
        items: list[dict[str, Any]] = shape["prefixItems"]
        return [
            (str(place), _type(item), _bounds(item), "required", _meaning(item)) for place, item in enumerate(items)
        ]
    required = shape.get("required", [])
    return [
        (f"`{field}`", _type(item), _bounds(item), _default(item, field in required), _meaning(item))
        for field, item in shape["properties"].items()
        if field != "v"
    ]


def _link(name: str) -> str:
    return f"[{name}](#{name.lower()})"


def _places() -> list[tuple[str, str]]:
    """Return for each section the field that contains it."""
    kinds = [kind.__name__ for kind in Section.__subclasses__()]
    found = [("", "Settings")]
    for outer, section in (("", Settings), ("localisation.", LocalisationSettings)):
        for field in msgspec.structs.fields(section):
            named = re.findall(r"\w+", str(field.type))
            found += [(outer + field.name, name) for name in kinds if name in named]
    return found


def _variants(shape: dict[str, Any]) -> list[dict[str, Any]]:
    return [part for part in shape.get("anyOf", [shape]) if part.get("type") != "null"]


def _type(shape: dict[str, Any]) -> str:
    names = [_one_type(part) for part in _variants(shape)]
    if any(part.get("type") == "null" for part in shape.get("anyOf", [])) and "default" not in shape:
        names.append("null")
    return " or ".join(dict.fromkeys(names))


def _one_type(part: dict[str, Any]) -> str:
    reference = part.get("$ref") or next((item["$ref"] for item in part.get("allOf", [])), None)
    if reference is not None:
        name = reference.rsplit("/", 1)[1]
        if name == "Settings":
            return "[settings](scenarios.md)"
        return "section" if name.endswith("Settings") else _link(name)
    if "enum" in part:
        return " or ".join(f"`{value}`" for value in part["enum"])
    kind: str = part.get("type", "")
    if "contentEncoding" in part:
        return "bytes"
    if kind == "array" and "prefixItems" in part:
        inner = [_type(item) for item in part["prefixItems"]]
        return f"{len(inner)} numbers" if set(inner) == {"number"} else f"({', '.join(inner)})"
    if kind == "array":
        inner_type = _type(part.get("items", {}))
        return f"list of {'sections' if inner_type == 'section' else inner_type}"
    if kind == "object":
        inner_type = _type(part["additionalProperties"]) if "additionalProperties" in part else ""
        return f"map of name to {inner_type}" if inner_type else "map"
    return {"string": "text", "boolean": "yes or no"}.get(kind, kind)


def _bounds(shape: dict[str, Any]) -> str:
    for part in _variants(shape):
        low, above = part.get("minimum"), part.get("exclusiveMinimum")
        high, below = part.get("maximum"), part.get("exclusiveMaximum")
        found = [f"≥ {low:g}"] if low is not None else [f"> {above:g}"] if above is not None else []
        found += [f"≤ {_large(high)}"] if high is not None else [f"< {below:g}"] if below is not None else []
        if found:
            return ", ".join(found)
    return ""


def _large(bound: float) -> str:
    powers = {2**53: "2⁵³", 2**40: "2⁴⁰", 2**32: "2³²"}
    return powers.get(int(bound), f"{bound:g}")


def _default(shape: dict[str, Any], required: bool) -> str:
    if required:
        return "required"
    value = shape.get("default")
    if value is None:
        return ""
    if isinstance(value, dict):
        return "see below"
    return f"`{'yes' if value is True else 'no' if value is False else msgspec.json.encode(value).decode()}`"


def _meaning(shape: dict[str, Any]) -> str:
    return next((part["description"] for part in (shape, *_variants(shape)) if "description" in part), "").replace(
        "``", "`"
    )
