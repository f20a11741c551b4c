"""Which planted faults do the tests catch? ``python -m benchmarks.mutation [--room ROOM] [--count N] [--seed N]``.

Draws places in the code of a room, plants one small fault at a time in a copy of the tree, and runs the quick tests
that matter for it. A fault that fails a test, or that makes the tests take far too long, is caught. One that survives
asks for a test, or does no harm: then it is listed in ``HARMLESS`` with the reason. A constant that a module or a class
declares is made 100 times larger and nothing less: twice is another tuning, and no fault. This measures no speed, and
is not run with the benchmarks.

    python -m benchmarks.mutation --room swarm/traffic --count 40 --seed 1 [--jobs 2] [--only holds.py]
"""

import argparse
import ast
import os
import shutil
import signal
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import count
from pathlib import Path
from queue import SimpleQueue
from random import Random
from time import perf_counter
from typing import Final, NamedTuple

from benchmarks.measure import table

ROOT: Final = Path(__file__).parents[1]
QUICK: Final = "not processes and not slow"

# fmt: off
# what runs as a process of its own is tested with real ones: a room apart, which takes long
PROCESSES: Final = ("world/process.py", "world/__main__.py", "swarm/robot/process.py", "swarm/robot/radio.py")
ROOMS: Final[dict[str, tuple[str, ...]]] = {  # what is drawn from
    "swarm/robot":   ("swarm/robot",),
    "swarm/traffic": ("swarm/traffic",),
    "world":         ("world",),
    "world/storm":   ("world/storm",),
    "processes":     PROCESSES,
}
FLEET: Final = "tests/traffic/test_traffic.py::test_robots_that_answer_late_complete"
TESTS: Final[dict[str, tuple[str, ...]]] = {  # the longest that a file's path begins with counts; the quickest first
    "swarm/robot/fuzzy":      ("tests/fuzzy", "tests/cli"),
    "swarm/robot":            ("tests/robot", "tests/ground", "tests/traffic/test_driver.py", FLEET),
    "swarm/robot/process.py": ("tests/launch",),
    "swarm/robot/radio.py":   ("tests/launch", "tests/bus"),
    "swarm/traffic":          ("tests/traffic", "tests/scenario"),
    "world":                  ("tests/world", "tests/ground/test_movers.py", "tests/ground/test_edits.py"),
    "world/process.py":       ("tests/launch",),
    "world/__main__.py":      ("tests/launch",),
}
_FAR: Final = "any number that no way is as long as will do"
_MOVER: Final = "a scenario gives every mover a radius or a size"
HARMLESS: Final[dict[tuple[str, str, str], str]] = {  # file, line of code, how the change begins: why
    ("world/physics.py", "shape = pymunk.Circle(body, radius) if radius is not None else "
     "pymunk.Poly.create_box(body, size or (1.0, 1.0))", "1.0 becomes"): _MOVER,
    ("swarm/traffic/cells.py", "FAR: Final = 1 << 30  # steps; no way leads there", "1 becomes"): _FAR,
    ("swarm/traffic/cells.py", "FAR: Final = 1 << 30  # steps; no way leads there", "30 becomes"): _FAR,
    ("world/physics.py", "length, width = size or (1.0, 1.0)", "1.0 becomes"): _MOVER,
}
# fmt: on

FLIPPED: Final = {
    ast.Lt: ">=", ast.LtE: ">", ast.Gt: "<=", ast.GtE: "<", ast.Eq: "!=", ast.NotEq: "==",
    ast.In: "not in", ast.NotIn: "in", ast.Is: "is not", ast.IsNot: "is",
}  # fmt: skip
SKIPPED: Final = (ast.Raise, ast.Assert, ast.JoinedStr, ast.Import, ast.ImportFrom)  # error texts, what types want
LEFT_OUT: Final = {"strict", "frozen", "slots", "kw_only", "cache", "omit_defaults", "maxsize"}  # keywords


class Mutation(NamedTuple):
    """A stretch of a file, in bytes, and what to put there."""

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
        """Whether it is known that no test can see it."""
        return any((self.file, self.code) == key[:2] and self.what.startswith(key[2]) for key in HARMLESS)


def mutations(file: str, text: str) -> Iterator[Mutation]:
    """List every fault that could be planted in a file."""
    lines = text.encode().splitlines(keepends=True)
    starts = [0]
    for line in lines:
        starts.append(starts[-1] + len(line))

    def put(node: ast.AST, new: str, what: str, end: ast.AST | None = None) -> Mutation:
        """Put new text from where ``node`` begins to where it ends, or to where ``end`` begins."""
        first = starts[node.lineno - 1] + node.col_offset  # type: ignore[attr-defined]
        place = (node.end_lineno, node.end_col_offset) if end is None else (end.lineno, end.col_offset)  # type: ignore[attr-defined]
        last = starts[place[0] - 1] + place[1]
        row: int = node.lineno  # type: ignore[attr-defined]
        return Mutation(file, row, first, last, new, what, lines[row - 1].decode().strip())

    src, tree = ast.unparse, ast.parse(text)
    bodies = [tree.body, *(node.body for node in ast.walk(tree) if isinstance(node, ast.ClassDef))]
    declared = [line for body in bodies for line in body if isinstance(line, ast.Assign | ast.AnnAssign)]
    tuned = {node for line in declared for node in ast.walk(line)}
    for node in _code(tree):
        if isinstance(node, ast.Compare) and len(node.ops) == 1:
            op = FLIPPED[type(node.ops[0])]
            yield put(node, f"({src(node.left)} {op} {src(node.comparators[0])})", f"`{src(node)}` with {op}")
        elif isinstance(node, ast.Constant) and isinstance(node.value, bool | int | float):
            for new in _other(node.value, declared=node in tuned):
                yield put(node, new, f"{node.value!r} becomes {new}")
        elif isinstance(node, ast.BoolOp):
            other = ast.Or() if isinstance(node.op, ast.And) else ast.And()
            yield put(node, f"({src(ast.BoolOp(other, node.values))})", f"and/or swapped in `{src(node)}`")
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
            yield put(node, f"({src(node.operand)})", f"`{src(node)}` without not")
        elif isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add | ast.Sub):
            plus = isinstance(node.op, ast.Sub)
            other_sum = ast.BinOp(node.left, ast.Add() if plus else ast.Sub(), node.right)
            yield put(node, f"({src(other_sum)})", f"`{src(node)}` with {'+' if plus else '-'}")
        elif isinstance(node, ast.AugAssign) and isinstance(node.op, ast.Add | ast.Sub):
            op = "-=" if isinstance(node.op, ast.Add) else "+="
            yield put(node, f"{src(node.target)} {op} {src(node.value)}", f"`{src(node)}` with {op}")
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in {"min", "max"}:
            other_name = "max" if node.func.id == "min" else "min"
            yield put(node.func, other_name, f"{other_name} for {node.func.id} in `{src(node)}`")
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
    return [repr(value * 100)] if declared else [repr(value * 2), repr(value * 100), repr(value + 1)]


def _code(node: ast.AST) -> Iterator[ast.AST]:
    """Walk what is code: no annotations, decorators, error texts or keywords that say how a class is made."""
    if isinstance(node, SKIPPED):
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


def room_of(file: str) -> str:
    """Find the room that a file belongs to: the one with the longest path to it."""
    bases = {base: room for room, bases in ROOMS.items() for base in bases}
    return bases[max((base for base in bases if file.startswith(base)), key=len)]


def drawn(room: str, number: int, seed: int, only: str = "") -> list[Mutation]:
    """Draw mutations of a room: each place is as likely as any other, and drawn once."""
    places = [ROOT / base for base in ROOMS[room]]
    files = {file for place in places for file in ([place] if place.is_file() else place.rglob("*.py"))}
    names = sorted(file.relative_to(ROOT).as_posix() for file in files)
    names = [name for name in names if only in name and room_of(name) == room]
    found = [one for name in names for one in mutations(name, (ROOT / name).read_text(encoding="utf-8"))]
    found = [one for one in found if not one.harmless]
    chance = Random(f"{room} {seed}")
    chance.shuffle(found)
    by_place = {(one.file, one.start, one.end): one for one in found}
    return chance.sample(list(by_place.values()), min(number, len(by_place)))


class Copy:
    """A copy of the tree in which one fault at a time is planted and tested."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        leave = shutil.ignore_patterns("__pycache__", ".*", "*.egg-info", "pictures")
        shutil.copytree(ROOT, folder, ignore=leave)
        # Python and numba both take a file for unchanged by its time of change: each write gets one of its own
        self._times = count(1_000_000_000, 10)
        self._usual: dict[tuple[str, ...], tuple[float, tuple[str, ...]]] = {}  # s, and options that leave tests out

    def survives(self, mutation: Mutation) -> bool:
        """Return True if the tests pass although a fault is planted. A timeout counts as caught."""
        tests = TESTS[max((path for path in TESTS if mutation.file.startswith(path)), key=len)]
        if tests not in self._usual:
            _, said, seconds = self._test(tests, 3600.0, "-rf")
            failing = [line.split()[1] for line in said.splitlines() if line.startswith("FAILED")]
            for test in failing:
                print(f"left out, for it fails as it is: {test}", flush=True)
            self._usual[tests] = seconds, tuple(f"--deselect={test}" for test in failing)
        seconds, leaving_out = self._usual[tests]
        before = (ROOT / mutation.file).read_bytes()
        self._write(mutation.file, before[: mutation.start] + mutation.new.encode() + before[mutation.end :])
        passed, _, _ = self._test(tests, 60.0 + 4 * seconds, "-x", *leaving_out)
        self._write(mutation.file, before)
        return passed

    def _write(self, file: str, content: bytes) -> None:
        path = self.folder / file
        path.write_bytes(content)
        stamp = next(self._times)
        os.utime(path, (stamp, stamp))
        if b"njit" in content:  # compiled into others of its folder too; no kernel calls one of another folder
            for cached in (*path.parent.glob("__pycache__/*.nbi"), *path.parent.glob("__pycache__/*.nbc")):
                cached.unlink()

    def _test(self, tests: tuple[str, ...], limit: float, *options: str) -> tuple[bool, str, float]:
        """Run tests; say whether they passed, what was printed, and the seconds it took."""
        marks = "not slow" if "tests/launch" in tests else QUICK
        command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-m", marks, *options, *tests]
        start = perf_counter()
        process = subprocess.Popen(
            command, cwd=self.folder, env=os.environ | {"PYTHONPATH": str(self.folder)}, start_new_session=True,
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
        )  # fmt: skip
        try:
            said, _ = process.communicate(timeout=limit)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.communicate()
            return False, "", limit
        return process.returncode == 0, said, perf_counter() - start


def main() -> int:
    """Plant faults, a line each, and say how many survived in each room."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0] if __doc__ else None)
    parser.add_argument(
        "--room", action="append", choices=ROOMS, help="again for several; by default all but processes"
    )
    parser.add_argument("--count", type=int, default=40, help="mutations a room")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1, help="copies of the tree tested side by side")
    parser.add_argument("--only", default="", metavar="TEXT", help="only in files whose path has this in it")
    options = parser.parse_args()
    rooms = options.room or ["swarm/robot", "swarm/traffic", "world"]
    planted, survived = Counter[str](), Counter[str]()
    with tempfile.TemporaryDirectory(prefix="mutation-") as folder, ThreadPoolExecutor(options.jobs) as pool:
        copies: SimpleQueue[Copy] = SimpleQueue()
        for number in range(options.jobs):
            copies.put(Copy(Path(folder) / str(number)))

        def plant(mutation: Mutation) -> bool:
            copy = copies.get()
            try:
                return copy.survives(mutation)
            finally:
                copies.put(copy)

        for room in rooms:
            chosen = drawn(room, options.count, options.seed, options.only)
            for mutation, survives in zip(chosen, pool.map(plant, chosen), strict=True):
                planted[room] += 1
                survived[room] += survives
                print(f"{'SURVIVED' if survives else 'caught  '} {mutation}", flush=True)
    rows = [
        (room, str(planted[room]), str(survived[room]), f"{survived[room] / max(1, planted[room]):.0%}")
        for room in rooms
    ]
    print(f"\nseed {options.seed}; {len(HARMLESS)} are known to do no harm and are not drawn\n")
    print(table([("room", "planted", "survived", "share"), *rows]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
