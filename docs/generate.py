"""Writes the parts of the documentation that are made from the code: ``python -m docs.generate``.

A page says where with ``<!-- generated: NAME -->`` and ``<!-- end -->``; NAME is a key of ``PARTS``. With ``--check``
nothing is written, and exit status 1 says that a page is out of date. Pictures that are drawn from the code are
written and checked with the pages: ``PICTURES``.
"""

import argparse
import ast
import inspect
import re
import sys
from collections.abc import Callable
from dataclasses import fields as dataclass_fields
from enum import StrEnum
from pathlib import Path
from typing import Any, Final

import msgspec

from docs import figure5, speeds
from swarm import messages
from swarm.launch import table as processes
from swarm.messages import REPLIES, TOPICS, Message
from swarm.scenario.schema import Section, Settings
from world.storm.laws import LAWS
from world.storm.profiles import PROFILES

ROOT: Final = Path(__file__).parents[1]
PAGES: Final = ("architecture.md", "fuzzy.md", "scenarios.md", "storm.md", "wire.md")
MARKED: Final = re.compile(r"(<!-- generated: (\S+) -->\n).*?(<!-- end -->)", re.DOTALL)
FIELD: Final = re.compile(r"^    (\w+): (.+?)(?: = (.+?))?(?:  # (.*))?$")
MEMBER: Final = re.compile(r'^    \w+ = "(\w+)"(?:  # (.*))?$')
ALIAS: Final = re.compile(r"^(\w+) = (Annotated\[(\w+), Meta\((.*)\)\]|tuple\[.*\])(?:  # (.*))?$")
UNITS: Final = {"Metres": "m", "Length": "m", "Angle": "rad", "Seconds": "s", "Point": "m", "Speed": "m/s or rad/s"}


def rows(head: tuple[str, ...], *body: tuple[str, ...]) -> str:
    """Lay a Markdown table out."""
    lines = [head, tuple("---" for _ in head), *body]
    return "\n".join(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in line)} |" for line in lines)


def said(thing: object) -> str:
    """Take a docstring's first sentence line, with one kind of quotes."""
    return (inspect.getdoc(thing) or "").split("\n")[0].replace("``", "`")


# --- wire.md ---


def topics() -> str:
    """List every topic."""
    body = [
        (
            f"`{topic.key}`",
            f"[{topic.message.__name__}](#{topic.message.__name__.lower()})",
            f"{topic.rate:g} Hz" if topic.rate else "on change" if topic.key not in REPLIES else "on request",
            f"{topic.timeout:g} s" if topic.timeout else "never",
            "waits" if topic.reliable else "drops",
            f"{topic.limit // 1024} KiB",
            f"[{REPLIES[topic.key].__name__}](#{REPLIES[topic.key].__name__.lower()})" if topic.key in REPLIES else "",
        )
        for topic in TOPICS
    ]
    head = ("key below `swarm/v1/<fleet>/`", "message", "rate", "stale after", "without room", "limit", "answer")
    return rows(head, *body)


def types() -> str:
    """List the names that fields have for their types."""
    found = [match for line in inspect.getsource(messages).splitlines() if (match := ALIAS.match(line))]
    body = []
    for name, whole, plain, bounds, comment in (match.groups() for match in found):
        unit = comment or UNITS.get(name, "")
        range_ = (bounds or "").replace('r"', "").replace('"', "")
        body.append((f"`{name}`", f"`{plain or whole}`", f"`{range_}`" if range_ else "", unit))
    return rows(("name", "type", "bounds", "unit"), *body)


def fields() -> str:
    """Describe every message and every enumeration, field by field."""
    parts = []
    kinds = [kind for kind in vars(messages).values() if inspect.isclass(kind) and kind.__module__ == messages.__name__]
    for kind in kinds:
        if issubclass(kind, StrEnum):
            found = [match for line in inspect.getsource(kind).splitlines() if (match := MEMBER.match(line))]
            body = [(f"`{value}`", comment or "") for value, comment in (match.groups() for match in found)]
            parts.append(f"### {kind.__name__}\n\n{said(kind)}\n\n{rows(('value', 'meaning'), *body)}")
        elif issubclass(kind, Message) and kind is not Message:
            found = [match for line in inspect.getsource(kind).splitlines() if (match := FIELD.match(line))]
            described = [
                (f"`{name}`", f"`{type_}`", f"`{default}`" if default else "", (comment or "").replace("``", "`"))
                for name, type_, default, comment in (match.groups() for match in found)
            ]
            head = ("field", "type", "default", "meaning")
            parts.append(f"### {kind.__name__}\n\n{said(kind)}\n\n{rows(head, *described)}")
    return "\n\n".join(parts)


# --- scenarios.md ---


def scenario() -> str:
    """Describe every field of a scenario file, section by section."""
    _, schemas = msgspec.json.schema_components([Settings])
    order = ["Settings", *(name for name in schemas if name != "Settings")]
    places = {name: place for place, name in _places()}
    parts = []
    for name in order:
        properties: dict[str, Any] = schemas[name]["properties"]
        required = schemas[name].get("required", [])
        body = [
            (f"`{field}`", _type(shape), _bounds(shape), _default(shape, field in required), _meaning(shape))
            for field, shape in properties.items()
        ]
        title = f"### `{places[name]}`" if places.get(name) else "### The top level"
        head = ("field", "type", "range", "default", "unit and meaning")
        text = schemas[name].get("description", "").replace("``", "`")
        parts.append(f"{title}\n\n{text}\n\n{rows(head, *body)}")
    return "\n\n".join(parts)


def _places() -> list[tuple[str, str]]:
    """Find under which field each section stands."""
    kinds = [kind.__name__ for kind in Section.__subclasses__()]
    found = [("", "Settings")]
    for field in msgspec.structs.fields(Settings):
        named = re.findall(r"\w+", str(field.type))
        found += [(field.name, name) for name in kinds if name in named]
    return found


def _variants(shape: dict[str, Any]) -> list[dict[str, Any]]:
    return [part for part in shape.get("anyOf", [shape]) if part.get("type") != "null"]


def _type(shape: dict[str, Any]) -> str:
    names = []
    for part in _variants(shape):
        reference = part.get("$ref") or next((item["$ref"] for item in part.get("allOf", [])), None)
        if reference is not None:
            names.append("section")
        elif part.get("type") == "array" and "prefixItems" in part:
            names.append(f"{len(part['prefixItems'])} numbers")
        elif part.get("type") == "array":
            inner = part.get("items", {})
            names.append(f"list of {_type(inner)}".replace("section", "sections"))
        elif "enum" in part:
            names.append(" or ".join(f"`{value}`" for value in part["enum"]))
        else:
            names.append({"string": "text", "boolean": "yes or no"}.get(part.get("type", ""), part.get("type", "")))
    return " or ".join(dict.fromkeys(names))


def _bounds(shape: dict[str, Any]) -> str:
    for part in _variants(shape):
        low, above = part.get("minimum"), part.get("exclusiveMinimum")
        high, below = part.get("maximum"), part.get("exclusiveMaximum")
        said_ = [f"≥ {low:g}"] if low is not None else [f"> {above:g}"] if above is not None else []
        said_ += [f"≤ {high:g}"] if high is not None else [f"< {below:g}"] if below is not None else []
        if said_:
            return ", ".join(said_)
    return ""


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


# --- architecture.md ---


def process_table() -> str:
    """List the kinds of process a launcher starts."""
    roles = [role for role in vars(processes).values() if isinstance(role, processes.Role)]
    body = [(role.name, f"`{role.target}`", role.on_success.value, role.on_failure.value) for role in roles]
    head = ("process", "what runs", "when it ends well", "when it fails")
    order = f"They are ended in this order: {', '.join(role.name for role in processes.STOP_ORDER)}."
    again = f"One process is started again at most {processes.RESTARTS} times."
    return f"{rows(head, *body)}\n\n{order} {again}"


def rooms() -> str:
    """List the packages, what each is, and which others it imports."""
    body = []
    for room in _rooms():
        text = ast.get_docstring(ast.parse((room / "__init__.py").read_text(encoding="utf-8"))) or ""
        body.append((f"`{room.relative_to(ROOT)}`", text.split("\n")[0].replace("``", "`"), ", ".join(imports(room))))
    return rows(("room", "what it is", "imports"), *body)


def _rooms() -> list[Path]:
    found = []
    for top in ("swarm", "world", "dashboard"):
        found.append(ROOT / top)
        found += sorted(path.parent for path in (ROOT / top).glob("*/__init__.py"))
    return found


def imports(room: Path) -> list[str]:
    """Find the other rooms and single files of the project that a room's files import."""
    found: set[str] = set()
    top = {"swarm", "world", "dashboard"}
    own = ".".join(room.relative_to(ROOT).parts)
    known = {".".join(path.relative_to(ROOT).parts) for path in _rooms()}
    for file in room.glob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            names = [node.module] if isinstance(node, ast.ImportFrom) and node.module else []
            names += [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            for name in names:
                parts = name.split(".")
                if parts[0] not in top:
                    continue
                two = ".".join(parts[:2])
                found.add(two if two in known or parts[0] == "swarm" else parts[0])
    return sorted(f"`{name}`" for name in found if name not in {own, "swarm"})


# --- storm.md ---


def laws() -> str:
    """List every law."""
    return rows(("law", "checks"), *((name, said(law).removeprefix("Check ")) for name, law in LAWS.items()))


def profiles() -> str:
    """List every profile by what it draws otherwise than the calm one."""
    body = []
    for name, profile in PROFILES.items():
        differs = [
            f"`{field.name}` {_span(getattr(profile, field.name))}"
            for field in dataclass_fields(profile)
            if getattr(profile, field.name) != field.default
        ]
        body.append((f"`{name}`", ", ".join(differs) or "as it is"))
    return rows(("profile", "draws otherwise"), *body)


def _span(value: object) -> str:
    return " ".join(f"{one:g}" for one in value) if isinstance(value, tuple) else str(value).lower()


PARTS: Final[dict[str, Callable[[], str]]] = {
    "topics": topics,
    "types": types,
    "fields": fields,
    "scenario": scenario,
    "processes": process_table,
    "rooms": rooms,
    "laws": laws,
    "profiles": profiles,
    "speeds": speeds.numbers,
}
PICTURES: Final[dict[str, Callable[[], str]]] = {"mission.svg": figure5.svg, "speeds.svg": speeds.svg}


def renewed(text: str) -> str:
    """Return a page with its generated parts made again."""
    return MARKED.sub(lambda match: f"{match[1]}\n{PARTS[match[2]]()}\n\n{match[3]}", text)


def made(name: str, before: str) -> str:
    """Return a page or a picture as it should be; ``before`` is its text as it is."""
    return PICTURES[name]() if name in PICTURES else renewed(before)


def main() -> int:
    """Write, or check, every page and picture."""
    parser = argparse.ArgumentParser(description="Make the generated parts of the documentation.")
    parser.add_argument("--check", action="store_true", help="write nothing; 1 when something is out of date")
    check, stale = parser.parse_args().check, 0
    for name in (*PAGES, *PICTURES):
        path = ROOT / "docs" / name
        before = path.read_text(encoding="utf-8") if path.exists() else ""
        after = made(name, before)
        if before != after:
            stale = 1
            print(f"{name} {'is out of date: python -m docs.generate' if check else 'written'}")
            if not check:
                path.write_text(after, encoding="utf-8")
    return stale if check else 0


if __name__ == "__main__":
    sys.exit(main())
