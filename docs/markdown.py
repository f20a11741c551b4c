"""Markdown for the generated parts of pages."""

import inspect


def rows(head: tuple[str, ...], *body: tuple[str, ...]) -> str:
    """Return a Markdown table."""
    lines = [head, tuple("---" for _ in head), *body]
    return "\n".join(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in line)} |" for line in lines)


def said(thing: object) -> str:
    """Return the first line of a docstring, with single backquotes."""
    return (inspect.getdoc(thing) or "").split("\n")[0].replace("``", "`")
