"""Writes the parts of the documentation that are made from the code: ``python -m docs.generate``.

In a page, a generated part is between ``<!-- generated: NAME -->`` and ``<!-- end -->``; NAME is a key of ``PARTS``.
``FILES`` are files that are generated as a whole: pictures, the JSON Schema and the test vectors. With ``--check``
nothing is written; exit status 1 means that a page or file is out of date.
"""

import argparse
import ast
import re
import sys
from collections.abc import Callable
from dataclasses import fields as dataclass_fields
from functools import partial
from pathlib import Path
from typing import Final

from docs import (
    believed,
    concepts,
    contract,
    fields,
    figure5,
    glossary,
    handover,
    how_far,
    layers,
    speeds,
    tick,
    vectors,
)
from docs.markdown import rows, said
from swarm.launch.drill import judge
from swarm.launch.drill import table as drill_table
from swarm.launch.supervise import table as processes
from swarm.messages import schema
from swarm.secure import access
from swarm.storm.laws.judge import LAWS
from swarm.storm.plans.profiles import PROFILES

ROOT: Final = Path(__file__).parents[1]
PAGES: Final = (
    "architecture.md", "box.md", "deploy.md", "drill.md", "fuzzy.md", "scenarios.md", "security.md", "storm.md",
    "traffic-contract.md", "wire.md",
)  # fmt: skip
MARKED: Final = re.compile(r"(<!-- generated: (\S+) -->\n).*?(<!-- end -->)", re.DOTALL)


# --- security.md ---


def rights() -> str:
    """Return the table of what each role may do."""
    body = []
    for role, one in access.RIGHTS.items():
        told = (one.sends, one.answers, one.hears, one.asks)
        keys = ["everything" if part is None else _keys(part) for part in told]
        body.append((role, *keys, "" if one.present_as is None else f"`alive/{one.present_as}/...`"))
    return rows(("role", "sends", "answers", "hears", "asks", "is present as"), *body)


def _keys(topics: access.Topics) -> str:
    return ", ".join(f"`{topic.key}`" for topic in topics)


# --- architecture.md ---


def process_table() -> str:
    """Return the table of the kinds of process that a launcher starts."""
    roles = [role for role in vars(processes).values() if isinstance(role, processes.Role)]
    body = [
        (
            role.name,
            f"`{role.run.partition(':')[0]}`",
            *(end.value for end in role if isinstance(end, processes.EarlyEnd)),
        )
        for role in roles
    ]
    head = ("process", "what runs", "when it ends well", "when it fails", "when it is killed", "too often")
    order = f"The launcher ends them in this order: {', '.join(role.name for role in processes.STOP_ORDER)}."
    again = f"It restarts a process at most {processes.RESTARTS} times within {processes.WITHIN:g} s."
    return f"{rows(head, *body)}\n\n{order} {again}"


def rooms() -> str:
    """Return the table of packages: what each is, and which others it imports."""
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
    """Return the other rooms and single files of the project that a room's files import."""
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


# --- drill.md ---


def faults() -> str:
    """Return the table of faults."""
    body = [
        (
            f"`{row.name}`",
            row.fault,
            ", ".join(row.paces),
            ", ".join(f"`{law.__name__.replace('_', ' ')}`" for law in row.laws),
        )
        for row in drill_table.TABLE
    ]
    return rows(("row", "what is injected", "pace", "must hold too"), *body)


def drill_laws() -> str:
    """Return the table of the drill's laws."""
    return rows(
        ("law", "checks"),
        *((f"`{law.__name__.replace('_', ' ')}`", said(law).removeprefix("Check ")) for law in judge.LAWS),
    )


# --- storm.md ---


def laws() -> str:
    """Return the table of laws."""
    return rows(("law", "checks"), *((name, said(law).removeprefix("Check ")) for name, law in LAWS.items()))


def profiles() -> str:
    """Return the table of profiles: how each differs from the calm one."""
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
    "topics": fields.topics,
    "fields": fields.messages,
    "scenario": fields.scenario,
    "box-frames": fields.frames,
    "box-paths": fields.paths,
    "processes": process_table,
    "drill": faults,
    "drill-laws": drill_laws,
    "glossary": glossary.table,
    "rooms": rooms,
    "tick": tick.table,
    "rights": rights,
    "traffic-rules": contract.rules,
    "traffic-calls": contract.transitions,
    "traffic-constants": contract.constants,
    "laws": laws,
    "profiles": profiles,
    "speeds": speeds.numbers,
    "how-far": how_far.table,
}
# files that are generated as a whole, relative to docs/
FILES: Final[dict[str, Callable[[], str]]] = {
    "mission.svg": figure5.svg,
    "speeds.svg": speeds.svg,
    "pictures/rooms.svg": layers.svg,
    "pictures/handover.svg": handover.svg,
    "pictures/believed.svg": believed.svg,
    "../schemas/wire.json": schema.build_index,
    **{f"../schemas/{name}.json": partial(schema.schema_of, kind) for name, kind in schema.kinds().items()},
    **vectors.FILES,
    **concepts.PICTURES,
}


def renewed(text: str) -> str:
    """Return a page with its generated parts renewed."""
    return MARKED.sub(lambda match: f"{match[1]}\n{PARTS[match[2]]()}\n\n{match[3]}", text)


def made(name: str, before: str) -> str:
    """Return the correct text of a page or a picture; ``before`` is its present text."""
    return FILES[name]() if name in FILES else renewed(before)


def main() -> int:
    """Write or check all pages and pictures."""
    parser = argparse.ArgumentParser(description="Make the generated parts of the documentation.")
    parser.add_argument("--check", action="store_true", help="write nothing; exit status 1 if something is out of date")
    check, stale = parser.parse_args().check, 0
    for name in (*PAGES, *FILES):
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
