"""Draws the rooms for architecture.md: each stands above all that it imports, by the imports of its files."""

import ast
from collections.abc import Mapping
from html import escape
from pathlib import Path
from typing import Final

from docs.drawing import framed

ROOT: Final = Path(__file__).parents[1]
WIDE, HIGH, BETWEEN, EDGE = 132, 46, 44, 12  # px; a box, the gap between two rows, the margin
LETTER: Final = 5.6  # px, the width of a letter of the small print

Graph = Mapping[str, frozenset[str]]  # room -> the rooms that it imports


def graph() -> Graph:
    """Return the rooms, each with all rooms that its files import, those of its sub-rooms too."""
    folders = [ROOT / "world", ROOT / "dashboard", *(init.parent for init in (ROOT / "swarm").glob("*/__init__.py"))]
    names = {folder.relative_to(ROOT).as_posix(): folder for folder in sorted(folders)}
    return {name: frozenset(_imported(folder) & (names.keys() - {name})) for name, folder in names.items()}


def _imported(folder: Path) -> set[str]:
    found = set()
    for file in folder.rglob("*.py"):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.module:
                parts = node.module.split(".")
                found.add("/".join(parts[:2]) if parts[0] == "swarm" else parts[0])
    return found


def levels(rooms: Graph) -> list[list[str]]:
    """Return the rooms in rows, the lowest first: a room is one row above the highest that it imports."""
    rows: list[list[str]] = []
    left = dict(rooms)
    while left:
        row = sorted(name for name, below in left.items() if not below & left.keys())
        assert row, f"a circle among {sorted(left)}"
        rows.append(row)
        left = {name: below for name, below in left.items() if name not in row}
    return rows


def reduced(rooms: Graph) -> dict[str, list[str]]:
    """Return for each room those of its imports that no other import of it leads to."""

    def beyond(name: str) -> frozenset[str]:
        return rooms[name].union(*map(beyond, rooms[name]))

    return {name: sorted(below - frozenset[str]().union(*map(beyond, below))) for name, below in rooms.items()}


def svg() -> str:
    """Return the picture."""
    rooms = graph()
    rows, drawn = levels(rooms), reduced(rooms)
    wide = {name: max(WIDE, 16 + LETTER * len(_within(name))) for name in rooms}
    width = max(sum(wide[name] + EDGE for name in row) for row in rows) + EDGE
    at: dict[str, tuple[float, float]] = {}  # px, the middle of the top of each box
    for number, row in enumerate(rows):
        y = EDGE + (len(rows) - 1 - number) * (HIGH + BETWEEN)
        mean = {name: sum(at[below][0] for below in drawn[name]) / max(1, len(drawn[name])) for name in row}
        row.sort(key=lambda name: (mean[name], name))
        spare = (width - sum(wide[name] for name in row)) / (len(row) + 1)
        x = spare
        for name in row:
            at[name] = (x + wide[name] / 2, y)
            x += wide[name] + spare
    arrows = [_arrow(at[name], at[below]) for name in rooms for below in drawn[name]]
    boxes = [_box(name, at[name], wide[name]) for name in rooms]
    height = len(rows) * (HIGH + BETWEEN) - BETWEEN + 2 * EDGE
    lines = (
        "Each room stands above all that it imports; small print: the rooms inside.",
        "No arrow for what another arrow leads to. Single files of swarm/ are left out.",
    )
    return framed("The rooms and what they import", width, height, [*arrows, *boxes], lines)


def _within(name: str) -> str:
    return " · ".join(sorted(init.parent.name for init in (ROOT / name).glob("*/__init__.py")))


def _arrow(upper: tuple[float, float], lower: tuple[float, float]) -> str:
    (x, top), (to, y) = upper, lower
    start, bend = top + HIGH, BETWEEN
    way = f"M{x:.0f},{start:.0f} C{x:.0f},{start + bend:.0f} {to:.0f},{y - bend:.0f} {to:.0f},{y - 1:.0f}"
    return f'<path class="ink" d="{way}" marker-end="url(#tip)"/>'


def _box(name: str, at: tuple[float, float], wide: float) -> str:
    (x, y), within = at, _within(name)
    middle = y + HIGH / 2 + (4 if not within else -4)
    small = (
        f'<text x="{x:.0f}" y="{y + HIGH - 10:.0f}" style="font-size:10px">{escape(within)}</text>' if within else ""
    )
    return (
        f'<rect class="ground ink" x="{x - wide / 2:.0f}" y="{y:.0f}" width="{wide:.0f}" height="{HIGH}" rx="4"/>'
        f'<text class="bold" x="{x:.0f}" y="{middle:.0f}">{escape(name)}</text>{small * bool(within)}'
    )
