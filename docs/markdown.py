"""Markdown that the generated parts of pages are made of."""

import inspect


def rows(head: tuple[str, ...], *body: tuple[str, ...]) -> str:
    """Lay a Markdown table out."""
    lines = [head, tuple("---" for _ in head), *body]
    return "\n".join(f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in line)} |" for line in lines)


def said(thing: object) -> str:
    """Take a docstring's first sentence line, with one kind of quotes."""
    return (inspect.getdoc(thing) or "").split("\n")[0].replace("``", "`")
