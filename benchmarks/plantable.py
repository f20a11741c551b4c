"""All small faults that can be planted in a file: see ``benchmarks.mutation``.

A comparison is reversed. ``and``/``or``, ``+``/``-``, ``*``/``/`` and ``min``/``max`` are swapped. A minus or a ``not``
is left out. A number changes, a condition is never true, a returned truth is negated, a call for its effect is left
out. A constant of a module or a class becomes 100 times larger: a factor of two would be another tuning, not a fault.
``<=`` for ``<`` is not planted: with real numbers it hardly ever makes a difference. Nor is the -1 of ``reshape``
changed: numpy takes any negative length as the unknown one.
"""

import ast
from collections.abc import Iterator
from typing import Final, NamedTuple

from benchmarks.harmless import HARMLESS

FLIPPED: Final = {
    ast.Lt: ">=", ast.LtE: ">", ast.Gt: "<=", ast.GtE: "<", ast.Eq: "!=", ast.NotEq: "==",
    ast.In: "not in", ast.NotIn: "in", ast.Is: "is not", ast.IsNot: "is",
}  # fmt: skip
SWAPPED: Final = {
    ast.Add: ("-", ast.Sub()), ast.Sub: ("+", ast.Add()), ast.Mult: ("/", ast.Div()), ast.Div: ("*", ast.Mult()),
}  # fmt: skip
SKIPPED: Final = (ast.Raise, ast.Assert, ast.JoinedStr, ast.Import, ast.ImportFrom)  # error texts, imports
LEFT_OUT: Final = {"strict", "frozen", "slots", "kw_only", "cache", "omit_defaults", "maxsize"}  # keywords


class Mutation(NamedTuple):
    """A part of a file, in bytes, and its replacement."""

    file: str
    line: int
    start: int
    end: int
    new: str
    what: str
    code: str  # the line, stripped

    def __str__(self) -> str:
        return f"{self.file}:{self.line}: {self.what}"

    @property
    def harmless(self) -> bool:
        """True if it is known that no test can find it."""
        return any((self.file, self.code) == key[:2] and self.what.startswith(key[2]) for key in HARMLESS)


def mutations(file: str, text: str) -> Iterator[Mutation]:
    """Yield all faults that can be planted in a file."""
    lines = text.encode().splitlines(keepends=True)
    starts = [0]
    for line in lines:
        starts.append(starts[-1] + len(line))

    def put(node: ast.AST, new: str, what: str, end: ast.AST | None = None) -> Mutation:
        """Return the replacement of the text from the start of ``node`` to its end, or to the start of ``end``."""
        first = starts[node.lineno - 1] + node.col_offset  # type: ignore[attr-defined]
        place = (node.end_lineno, node.end_col_offset) if end is None else (end.lineno, end.col_offset)  # type: ignore[attr-defined]
        last = starts[place[0] - 1] + place[1]
        row: int = node.lineno  # type: ignore[attr-defined]
        return Mutation(file, row, first, last, new, what, lines[row - 1].decode().strip())

    src, tree = ast.unparse, ast.parse(text)
    bodies = [tree.body, *(node.body for node in ast.walk(tree) if isinstance(node, ast.ClassDef))]
    declared = [line for body in bodies for line in body if isinstance(line, ast.Assign | ast.AnnAssign)]
    tuned = {node for line in declared for node in ast.walk(line)}
    within = {part: node for node in ast.walk(tree) for part in ast.iter_child_nodes(node)}
    for node in _code(tree):
        if isinstance(node, ast.Compare) and len(node.ops) == 1:
            op = FLIPPED[type(node.ops[0])]
            yield put(node, f"({src(node.left)} {op} {src(node.comparators[0])})", f"`{src(node)}` with {op}")
        elif isinstance(node, ast.Constant) and isinstance(node.value, bool | int | float):
            for new in _other(node.value, declared=node in tuned):
                part = f" in `{src(within[node])}`" if isinstance(within[node], ast.BinOp | ast.Compare) else ""
                yield put(node, new, f"{node.value!r} becomes {new}{part}")
        elif isinstance(node, ast.BoolOp):
            other = ast.Or() if isinstance(node.op, ast.And) else ast.And()
            yield put(node, f"({src(ast.BoolOp(other, node.values))})", f"and/or swapped in `{src(node)}`")
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
            yield put(node, f"({src(node.operand)})", f"`{src(node)}` without not")
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
            yield put(node, f"({src(node.operand)})", f"`{src(node)}` without -")
        elif isinstance(node, ast.BinOp) and type(node.op) in SWAPPED:
            sign, other_op = SWAPPED[type(node.op)]
            yield put(node, f"({src(ast.BinOp(node.left, other_op, node.right))})", f"`{src(node)}` with {sign}")
        elif isinstance(node, ast.AugAssign) and isinstance(node.op, ast.Add | ast.Sub):
            op = "-=" if isinstance(node.op, ast.Add) else "+="
            yield put(node, f"{src(node.target)} {op} {src(node.value)}", f"`{src(node)}` with {op}")
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in {"min", "max"}:
            other_name = "max" if node.func.id == "min" else "min"
            yield put(node.func, other_name, f"{other_name} for {node.func.id} in `{src(node)}`")
        elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
            yield put(node, "None", f"`{src(node)}` left out")
        elif isinstance(node, ast.If):
            yield put(node.test, "(False)", f"`if {src(node.test)}` never")
        elif isinstance(node, ast.FunctionDef) and isinstance(node.returns, ast.Name) and node.returns.id == "bool":
            for given in (n for n in ast.walk(node) if isinstance(n, ast.Return) and n.value is not None):
                yield put(given.value, f"(not ({src(given.value)}))", f"`{src(given)}` negated")  # type: ignore[arg-type]


def _other(value: float, *, declared: bool) -> list[str]:
    if isinstance(value, bool):
        return [str(not value)]
    if not value:
        return [repr(value + 1)]
    return [repr(value * 100)] if declared else list(dict.fromkeys(map(repr, (value * 2, value * 100, value + 1))))


def _code(node: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes that are code: no annotations, decorators, error texts or keywords that configure a class."""
    if isinstance(node, SKIPPED):
        return
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "reshape":
        yield from _code(node.func)
        return
    if isinstance(node, ast.Subscript) and isinstance(node.value, ast.Name) and node.value.id == "Annotated":
        return
    yield node
    for field, value in ast.iter_fields(node):
        if field in {"annotation", "returns", "decorator_list", "keywords"} and not isinstance(node, ast.Call):
            continue
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST) and not (isinstance(child, ast.keyword) and child.arg in LEFT_OUT):
                yield from _code(child)
