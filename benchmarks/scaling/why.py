"""Why a robot's step costs more in a process of its own: steps of the paper's eight robots, timed in both.

In one process the steps follow each other, or something is done before each: memory is touched, so that the caches no
longer hold what a step reads, or the thread sleeps, so that the processor does something else or nothing meanwhile.
"""

import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import partial
from pathlib import Path
from statistics import mean, median
from tempfile import TemporaryDirectory
from time import sleep, thread_time
from typing import Final

import numpy as np

from benchmarks.measure import load
from swarm.bus import Endpoint
from swarm.robot.brain import Inputs, Outputs, Robot
from swarm.scenario.load import load as load_scenario
from swarm.scenario.shipped import found
from world.simulate import Simulation

ROBOTS: Final = 8
SEED: Final = 7
WARMED: Final = 40  # ticks
TICKS: Final = 400
PATIENCE: Final = 300.0  # s
HEAD: Final = (
    "a step of one of 8 robots",
    "CPU time of its thread, mean [us]",
    "times the first row",
    "median",
    "times",
    "load",
)


def touching(megabytes: int) -> Callable[[], object]:
    """Return what reads and writes so much memory."""
    memory = np.zeros(megabytes * 1_000_000, np.uint8)
    return lambda: np.add(memory, 1, out=memory)


# fmt: off
BEFORE: Final[dict[str, Callable[[], Callable[[], object]]]] = {  # each step: makes what is done then
    "one process, one step after the other": lambda: lambda: None,
    "one process, 1 MB touched before it":   lambda: touching(1),
    "one process, 4 MB touched before it":   lambda: touching(4),
    "one process, 16 MB touched before it":  lambda: touching(16),
    "one process, 64 MB touched before it":  lambda: touching(64),
    "one process, 1 ms asleep before it":    lambda: lambda: sleep(0.001),
    "one process, 5 ms asleep before it":    lambda: lambda: sleep(0.005),
}
# fmt: on


@contextmanager
def timed(before: Callable[[], object]) -> Iterator[list[float]]:
    """Do something before each step of a robot, and list how long its thread computes in the step [s]."""
    seconds: list[float] = []
    step = Robot.step

    def steps(robot: Robot, inputs: Inputs) -> Outputs:
        before()
        began = thread_time()
        outputs = step(robot, inputs)
        seconds.append(thread_time() - began)
        return outputs

    Robot.step = steps  # type: ignore[method-assign, assignment]
    try:
        yield seconds
    finally:
        Robot.step = step  # type: ignore[method-assign]


def in_one_process(before: Callable[[], object], ticks: int = TICKS) -> list[float]:
    """Return the CPU times of the steps [s] with ``before`` done before each."""
    simulation = Simulation.of(load_scenario(found(Path("paper"))), ROBOTS, SEED)
    with timed(before) as seconds:
        for _ in range(ticks):
            simulation.step()
    return seconds[WARMED * ROBOTS :]


@contextmanager
def started(*arguments: str) -> Iterator[subprocess.Popen[bytes]]:
    """Run a Python module inside the block, and end it."""
    process = subprocess.Popen([sys.executable, "-m", *arguments], stdout=subprocess.DEVNULL)
    try:
        yield process
    finally:
        process.terminate()
        process.wait()


def in_processes() -> list[float]:
    """Return the CPU times of the steps [s] of robots that are processes, in lockstep."""
    endpoint = Endpoint("127.0.0.1", 0).claim()
    fleet = ("--connect", str(endpoint), "--fleet", "why")
    run = ("paper", "--robots", str(ROBOTS), "--seed", str(SEED), "--pace", "max", "--limit", f"{TICKS / 20:g}")
    with TemporaryDirectory() as folder, started("swarm.cli", "router", "--listen", str(endpoint)):
        files = [Path(folder) / f"{number}.json" for number in range(ROBOTS)]
        with ExitStack() as robots:
            for file in files:
                robots.enter_context(started("benchmarks.scaling.why_robot", str(endpoint), "why", str(file)))
            with started("swarm.cli", "world", *run, *fleet) as world:
                world.wait(PATIENCE)
        return [time for file in files for time in json.loads(file.read_text(encoding="utf-8"))[WARMED:]]


def lines() -> Iterator[tuple[str, Callable[[], tuple[str, ...]]]]:
    """Yield the rows of the table."""
    first: list[tuple[float, float]] = []

    def line(measure: Callable[[], list[float]]) -> tuple[str, ...]:
        seconds = measure()
        found = mean(seconds), median(seconds)
        first.append(found)
        both = zip(found, first[0], strict=True)
        ratios = [text for one, of in both for text in (f"{one * 1e6:.0f}", f"{one / of:.2f}")]
        return *ratios, load()

    for name, make in BEFORE.items():
        yield name, partial(line, partial(in_one_process, make()))
    yield "processes, one robot each", partial(line, in_processes)
