"""Which planted faults do the tests catch? ``python -m benchmarks.mutation [--room ROOM] [--count N] [--seed N]``.

The program draws places in the code of a room, plants one small fault (``benchmarks.plantable``) at a time in a copy of
the tree, and runs the quick tests of that code. A fault is caught if a test fails, if the code does not import or
crashes, or if the tests take far too long; each line says which. If pytest itself fails, the program ends: such a run
says nothing about the fault. A fault that survives needs a test, or it is harmless: then ``benchmarks.harmless`` lists
it with the reason. This measures no speed and does not run with the benchmarks.

    python -m benchmarks.mutation --room swarm/traffic --count 40 --seed 1 [--jobs 2] [--only reservations.py]
"""

import argparse
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
from collections import Counter, defaultdict
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from queue import SimpleQueue
from random import Random
from time import perf_counter
from typing import Final, NamedTuple

from benchmarks.harmless import HARMLESS
from benchmarks.measure import table
from benchmarks.plantable import Mutation, mutations

ROOT: Final = Path(__file__).parents[1]
QUICK: Final = "not processes and not slow"

# fmt: off
# code that runs as a process is tested with real processes: a separate room, since these tests take long
PROCESSES: Final = (
    "world/process.py", "world/lobby.py", "world/controls.py", "world/answers.py",
    "swarm/robot/process.py",
)
ROOMS: Final[dict[str, tuple[str, ...]]] = {  # room: folders and files from which faults are drawn
    "swarm/fuzzy":   ("swarm/fuzzy",),
    "swarm/motion":  ("swarm/motion",),
    "swarm/robot":   ("swarm/robot",),
    "swarm/traffic": ("swarm/traffic",),
    "world":         ("world",),
    "world/storm":   ("world/storm",),
    "processes":     PROCESSES,
}
DRIVER: Final = (
    "tests/traffic/test_look.py", "tests/traffic/test_traffic.py::test_robots_that_answer_late_complete",
)
TESTS: Final[dict[str, tuple[str, ...]]] = {  # start of a file's path: its tests; the longest match counts
    "swarm/fuzzy":            ("tests/fuzzy", "tests/cli"),
    "swarm/motion":           ("tests/motion", "tests/robot"),
    "swarm/robot":            ("tests/robot", "tests/ground", *DRIVER),
    "swarm/robot/process.py": ("tests/launch", "tests/robot/test_inbox.py"),
    "swarm/traffic":          ("tests/traffic", "tests/scenario"),
    "world":                  ("tests/world", "tests/ground/test_movers.py", "tests/ground/test_edits.py"),
    "world/storm":            ("tests/storm",),
    **dict.fromkeys(PROCESSES[:4], ("tests/launch",)),
}
# fmt: on


def room_of(file: str) -> str:
    """Return the room of a file: the one with the longest matching path."""
    bases = {base: room for room, bases in ROOMS.items() for base in bases}
    return bases[max((base for base in bases if file.startswith(base)), key=len)]


def drawn(room: str, number: int, seed: int, only: str = "") -> list[Mutation]:
    """Draw mutations of a room: each place is equally likely and is drawn at most once."""
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


class Usual(NamedTuple):
    """The result of a room's tests without a fault."""

    seconds: float
    longest: float  # s, of a single test
    tests: tuple[str, ...]  # files, the quickest first
    leaving_out: tuple[str, ...]  # options that deselect tests that fail without a fault

    def tests_for(self, file: str) -> tuple[str, ...]:
        """Return the tests in order; those named after the module come first, since they are likely to fail first."""
        return tuple(sorted(self.tests, key=lambda test: Path(file).stem not in Path(test.split("::")[0]).stem))


def verdict(code: int | None, said: str) -> str | None:
    """Return what caught a planted fault, from pytest's exit code and output; None if the fault survived.

    Raises:
        RuntimeError: pytest itself failed, so nothing is known about the fault.
    """
    if code is None:
        return "no end"
    if code == 0:
        return None
    if code < 0:
        return f"signal {-code}"
    named = re.search(r"^(?:FAILED|ERROR) (\S+)", said, re.MULTILINE)
    if named is None or code not in {1, 2}:
        raise RuntimeError(f"pytest ended with {code}, and neither a test nor an import failed:\n{said}")
    return named[1] if "::" in named[1] else f"import of {named[1]}"


class Copy:
    """A copy of the tree in which one fault at a time is planted and tested."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        # the copy keeps the files' times, by which numba knows that its cache is valid
        shutil.copytree(ROOT, folder, ignore=shutil.ignore_patterns("*.pyc", ".*", "*.egg-info", "pictures"))
        self._times = count(1_000_000_000, 10)  # s; Python treats a file with an equal time as unchanged
        self._usual: dict[tuple[str, ...], Usual] = {}

    def caught_by(self, mutation: Mutation) -> str | None:
        """Return what catches a fault: a test, or the way in which the tests ended; None if all tests pass."""
        tests = TESTS[max((path for path in TESTS if mutation.file.startswith(path)), key=len)]
        if tests not in self._usual:
            self._usual[tests] = self._as_it_is(tests)
        usual = self._usual[tests]
        with self._planted(mutation):
            tests = usual.tests_for(mutation.file)
            each = f"--timeout={60.0 + 4 * usual.longest:.0f}"  # s; a test without end is over sooner than all tests
            code, said, _ = self._test(tests, 60.0 + 4 * usual.seconds, "-x", each, *usual.leaving_out)
        return verdict(code, said)

    def _as_it_is(self, tests: tuple[str, ...]) -> Usual:
        """Test the code without a fault; measure the time of each test file, and find tests that fail already."""
        code, said, seconds = self._test(tests, 3600.0, "--durations=0", "--durations-min=0.01")
        if code not in {0, 1}:
            raise SystemExit(f"the tests cannot be run: pytest ended with {code}\n{said}")
        failing = re.findall(r"^FAILED (\S+)", said, re.MULTILINE)
        for test in failing:
            print(f"left out, since it fails without a fault: {test}", flush=True)
        took, longest = defaultdict[str, float](float), 0.0
        for spent, file in re.findall(r"^([\d.]+)s \w+ +([^:\s]+)::", said, re.MULTILINE):
            took[file] += float(spent)
            longest = max(longest, float(spent))
        apart = [test for test in tests if "::" in test]
        folders = [self.folder / test for test in tests if test not in apart]
        files = {file for folder in folders for file in ([folder] if folder.is_file() else folder.rglob("test_*.py"))}
        names = sorted(
            (file.relative_to(self.folder).as_posix() for file in files), key=lambda name: (took[name], name)
        )
        return Usual(seconds, longest, (*names, *apart), tuple(f"--deselect={test}" for test in failing))

    @contextmanager
    def _planted(self, mutation: Mutation) -> Iterator[None]:
        """Plant a fault inside the block. numba's cache is put aside: kernels of a folder contain each other's code."""
        path = self.folder / mutation.file
        before, stat = path.read_bytes(), path.stat()
        compiled = path.parent / "__pycache__"
        aside = compiled.with_name("__pycache__aside")
        kernels = b"njit" in before
        if kernels:
            compiled.mkdir(exist_ok=True)
            compiled.rename(aside)
        path.write_bytes(before[: mutation.start] + mutation.new.encode() + before[mutation.end :])
        stamp = next(self._times)
        os.utime(path, (stamp, stamp))
        try:
            yield
        finally:
            path.write_bytes(before)
            os.utime(path, ns=(stat.st_atime_ns, stat.st_mtime_ns))
            if kernels:
                shutil.rmtree(compiled, ignore_errors=True)
                aside.rename(compiled)

    def _test(self, tests: tuple[str, ...], limit: float, *options: str) -> tuple[int | None, str, float]:
        """Run tests; return pytest's exit code (None: it took too long), its output, and its time [s]."""
        marks = "not slow" if any(test.startswith("tests/launch") for test in tests) else QUICK
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
            return None, "", limit
        return process.returncode, said, perf_counter() - start


def main() -> int:
    """Plant faults, print a line for each, and print how many survived in each room."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0] if __doc__ else None)
    parser.add_argument(
        "--room", action="append", choices=ROOMS, help="repeat it for several rooms; default: all but processes"
    )
    parser.add_argument("--count", type=int, default=40, help="mutations per room")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1, help="copies of the tree tested side by side")
    parser.add_argument("--only", default="", metavar="TEXT", help="only files whose path contains this")
    options = parser.parse_args()
    rooms = options.room or ["swarm/robot", "swarm/traffic", "world"]
    planted, survived = Counter[str](), Counter[str]()
    with tempfile.TemporaryDirectory(prefix="mutation-") as folder, ThreadPoolExecutor(options.jobs) as pool:
        copies: SimpleQueue[Copy] = SimpleQueue()
        for number in range(options.jobs):
            copies.put(Copy(Path(folder) / str(number)))

        def plant(mutation: Mutation) -> str | None:
            copy = copies.get()
            try:
                return copy.caught_by(mutation)
            finally:
                copies.put(copy)

        for room in rooms:
            chosen = drawn(room, options.count, options.seed, options.only)
            for mutation, caught_by in zip(chosen, pool.map(plant, chosen), strict=True):
                planted[room] += 1
                survived[room] += caught_by is None
                print(f"caught   {mutation}   [{caught_by}]" if caught_by else f"SURVIVED {mutation}", flush=True)
    rows = [
        (room, str(planted[room]), str(survived[room]), f"{survived[room] / max(1, planted[room]):.0%}")
        for room in rooms
    ]
    print(f"\nseed {options.seed}; {len(HARMLESS)} mutations are known to be harmless and are not drawn\n")
    print(table([("room", "planted", "survived", "share"), *rows]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
