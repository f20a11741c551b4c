"""Writes a test vector: JSON that a person can read, with numbers that every machine agrees on."""

import json
from collections.abc import Callable
from typing import Any, Final

WIDTH: Final = 118  # characters of a line

Json = Any


def text(make: Callable[[], Json]) -> str:
    """Return a vector as JSON that a person can read: what fits in a line is in one; short items share lines."""
    return _text(make(), 0) + "\n"


def _text(value: Json, indent: int) -> str:
    line = json.dumps(value)
    if len(line) + indent <= WIDTH or not isinstance(value, dict | list):
        return line
    inner, last = "\n" + " " * (indent + 1), "\n" + " " * indent
    if isinstance(value, dict):
        fields = [f"{json.dumps(name)}: {_text(one, indent + 1)}" for name, one in value.items()]
        return "{" + inner + f",{inner}".join(fields) + last + "}"
    items = [_text(one, indent + 1) for one in value]
    if max(map(len, items)) > WIDTH // 3:
        return "[" + inner + f",{inner}".join(items) + last + "]"
    lines = [items[0]]
    for item in items[1:]:
        if len(lines[-1]) + len(item) + indent + 3 <= WIDTH:
            lines[-1] += f", {item}"
        else:
            lines.append(item)
    return "[" + inner + f",{inner}".join(lines) + last + "]"


def metres(*values: float) -> list[float]:
    """Return numbers rounded to what every machine agrees on."""
    return [round(value, 9) + 0.0 for value in values]
