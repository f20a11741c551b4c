"""Names that people read: a request's random id of 32 hex digits is cut to its first 8."""

import re
from collections.abc import Iterable
from typing import Final

SHORT: Final = 8  # digits; two of 64 remembered requests share them once in two million runs
LONG_ID: Final = re.compile(
    rf"\b([0-9a-f]{{{SHORT}}})(?:[0-9a-f]{{24}}|-[0-9a-f]{{4}}-[0-9a-f]{{4}}-[0-9a-f]{{4}}-[0-9a-f]{{12}})\b"
)
SHORT_ID: Final = re.compile(rf"[0-9a-f]{{{SHORT}}}\Z")


def shorten_ids(text: str) -> str:
    """Return a text with 8 digits of each id of 32 hex digits, with or without hyphens.

    >>> shorten_ids("order 4151c0bbfe5c4e2b8c3e4a2d9b0f1a77 is number 1")
    'order 4151c0bb is number 1'
    """
    return LONG_ID.sub(r"\1", text)


def long_id(text: str) -> str | None:
    """Return the first long id in a text, None if there is none.

    >>> long_id("takes pool target 4151c0bbfe5c4e2b8c3e4a2d9b0f1a77/1"), long_id("order morning")
    ('4151c0bbfe5c4e2b8c3e4a2d9b0f1a77', None)
    """
    found = LONG_ID.search(text)
    return found[0] if found else None


def find_long_id(name: str, known: Iterable[str]) -> str:
    """Return the long id of which ``name`` has the first 8 digits, if just one is known; else the name itself.

    >>> find_long_id("4151c0bb", ["4151c0bbfe5c4e2b8c3e4a2d9b0f1a77", "morning"]), find_long_id("morning", [])
    ('4151c0bbfe5c4e2b8c3e4a2d9b0f1a77', 'morning')
    """
    if not SHORT_ID.match(name) or name in (known := list(known)):
        return name
    found = [one for one in known if shorten_ids(one) == name != one]
    return found[0] if len(found) == 1 else name
