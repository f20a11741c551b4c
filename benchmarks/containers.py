"""Images and containers: sizes, and the time until each does its work: ``python -m benchmarks.containers``.

The images are built and run as `tests/deploy/test_containers.py` does it. Times run from the start of a container: the
engine makes it, Python starts, kernels are loaded, the process joins. A robot's runs to its first command, in a fleet
that waits for it; a world's until the fleet knows that it is there; a dashboard's until its page answers. Beside them,
the same as processes of this machine.
"""

import argparse
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory, gettempdir
from time import perf_counter
from typing import Final, NamedTuple
from uuid import uuid4

from benchmarks.measure import load, machine, printed
from benchmarks.namespaces import end
from dashboard.mode import answers
from swarm.bus import Arrival, Bus, Endpoint, Presence
from swarm.messages import COMMAND
from tests.deploy.engine import CONFINED, Engine, lacking

ROUNDS: Final = 5
SIZES: Final = {"robot": 450, "world": 600, "dashboard": None}  # MB at most
LATEST: Final = {"robot": 3.0, "world": None, "dashboard": None}  # s, from the start of a container to its work
FLEET: Final = "containers"
PATIENCE: Final = 60.0  # s

Start = Callable[[Sequence[str]], Callable[[], object]]  # of a process with these options; it returns how to end it


class Role(NamedTuple):
    """A process of a fleet: its command on this machine, and how long it takes to do its work."""

    command: tuple[str, ...]  # after python -m; a container has its own
    measured: Callable[[Start], float]


@contextmanager
def running(*words: str) -> Iterator[None]:
    """Run a command of `swarm` as long as the block lasts."""
    process = subprocess.Popen([sys.executable, "-m", "swarm.cli", *words], stdout=subprocess.DEVNULL, text=True)
    try:
        yield
    finally:
        end(process)


@contextmanager
def fleet() -> Iterator[tuple[Bus, tuple[str, ...]]]:
    """Run a router as long as the block lasts; yield a bus that hears of worlds, and the options to join by."""
    endpoint = Endpoint("127.0.0.1", 0).claim()
    with running("router", "--listen", str(endpoint)), Bus(endpoint, FLEET) as bus:
        bus.watch_presence("world")
        yield bus, ("--connect", str(endpoint), "--fleet", FLEET)


def until_a_command(start: Start) -> float:
    """Return how long a robot takes [s] to its first command, in a world that waits for it."""
    with TemporaryDirectory() as folder, fleet() as (bus, joins), waiting_world(Path(folder), joins):
        bus.receive(PATIENCE)
        bus.listen(COMMAND)
        return timed(lambda: start(joins), lambda: isinstance(bus.receive(PATIENCE), Arrival))


def waiting_world(folder: Path, joins: Sequence[str]) -> AbstractContextManager[None]:
    """Run a world that waits for its robot."""
    return running("world", "paper", "--robots", "1", "--serve", "--record", str(folder / "run.swarm"), *joins)


def until_present(start: Start) -> float:
    """Return how long a world takes [s] until the fleet knows that it is there."""
    tape = Path(gettempdir(), f"{uuid4().hex}.swarm")  # a container has this folder, too, for itself
    try:
        with fleet() as (bus, joins):
            words = ("paper", "--robots", "1", "--record", str(tape), *joins)
            return timed(lambda: start(words), lambda: isinstance(bus.receive(PATIENCE), Presence))
    finally:
        tape.unlink(missing_ok=True)


def until_a_page(start: Start) -> float:
    """Return how long a dashboard takes [s] until its page answers, which shows a world that is there."""
    page, data = (Endpoint("127.0.0.1", 0).claim().port for _ in range(2))
    with TemporaryDirectory() as folder, fleet() as (bus, joins), waiting_world(Path(folder), joins):
        bus.receive(PATIENCE)
        words = ("--web", "--web-port", str(page), "--port", str(data), *joins)
        return timed(lambda: start(words), lambda: answers(page))


def timed(start: Callable[[], Callable[[], object]], there: Callable[[], bool]) -> float:
    """Return how long it takes [s] from a start until something is there; then end what was started."""
    began = perf_counter()
    stop = start()
    try:
        while not there():
            assert perf_counter() - began < PATIENCE, "it has not come"
        return perf_counter() - began
    finally:
        stop()


ROLES: Final = {
    "robot": Role(("swarm.cli", "robot"), until_a_command),
    "world": Role(("swarm.cli", "world"), until_present),
    "dashboard": Role(("dashboard",), until_a_page),
}


def contained(engine: Engine, role: str, words: Sequence[str]) -> Callable[[], object]:
    """Start a container of a role on this machine's network."""
    engine.podman("run", "--detach", "--rm", "--name", role, "--network", "host", *CONFINED, f"zenoh-swarm-{role}",
                  *words)  # fmt: skip
    return lambda: engine.podman("stop", role)


def process(role: str, words: Sequence[str]) -> Callable[[], object]:
    """Start a role as a process of this machine."""
    started = [sys.executable, "-m", *ROLES[role].command, *words]
    child = subprocess.Popen(started, stdout=subprocess.DEVNULL, text=True)
    return lambda: end(child)


def main() -> int:
    """Print the tables; return 1 if an image is too large or a robot starts too late."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    if (why := lacking()) is not None:
        print(why, file=sys.stderr)
        return 1
    print(f"{machine()}\n")
    wrong: list[str] = []

    def judged(name: str, found: float, bar: float | None) -> str:
        wrong.extend([name] * (bar is not None and found > bar))
        return "" if bar is None else f"{bar:g}"

    with TemporaryDirectory(dir="/var/tmp") as folder, Engine(Path(folder)) as engine:
        engine.build(*ROLES)

        def size(role: str) -> Sequence[str]:
            mega = [engine.image(image)["Size"] / 1e6 for image in (f"zenoh-swarm-{role}", "swarm-base")]
            return *(f"{one:.0f}" for one in mega), judged(role, mega[0], SIZES[role])

        printed(("image", "MB", "its base", "bar"), [(role, lambda role=role: size(role)) for role in ROLES])  # type: ignore[misc]

        def starts(role: str) -> Sequence[str]:
            measured = ROLES[role].measured
            inside = sorted(measured(lambda words: contained(engine, role, words)) for _ in range(ROUNDS))
            outside = sorted(measured(lambda words: process(role, words)) for _ in range(ROUNDS))
            middle = inside[ROUNDS // 2]
            bar = judged(f"start of a {role}", middle, LATEST[role])
            return f"{middle:.1f}", f"{inside[-1]:.1f}", bar, f"{outside[ROUNDS // 2]:.1f}", load()

        printed(("start to work, median [s]", "in a container", "longest", "bar", "as a process", "load"),
                [(role, lambda role=role: starts(role)) for role in ROLES])  # type: ignore[misc]  # fmt: skip
    if wrong:
        print(f"beyond a bar: {', '.join(wrong)}")
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
