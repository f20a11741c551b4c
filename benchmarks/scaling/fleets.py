"""A fleet over real processes: it is started, its clock is heard, and the use of the machine is read at two ticks."""

import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache, partial
from tempfile import TemporaryDirectory
from time import monotonic
from typing import Final, NamedTuple

import psutil

from benchmarks.scaling.rows import RATE, Row
from swarm.bus import Arrival, Bus, Endpoint
from swarm.errors import ConfigError
from swarm.messages import CLOCK, Clock, Phase

FLEET: Final = "scale"
WARMED: Final = 40  # ticks after which the measurement begins: all kernels have run
PATIENCE: Final = 120.0  # s for a fleet to start
LONGEST: Final = 600.0  # s of the wall clock for a fleet in lockstep; a row of fewer ticks is taken then
LEAVING: Final = 60.0  # s for a fleet to end that was told to; 256 processes take about ten


class NotMeasured(Exception):  # noqa: N818, no error of the project
    """A fleet did not run as long as was to be measured."""


class Sample(NamedTuple):
    """A fleet's use of the machine at one tick."""

    tick: int
    wall: float  # s
    cpu: dict[str, float]  # s, of the processes of each kind


@contextmanager
def fleet(
    row: Row, limit: float, pace: str, *more: str, python: str = sys.executable
) -> Iterator[tuple[psutil.Process, Endpoint]]:
    """Run a row's fleet, with the package that is installed beside an interpreter, inside the block."""
    endpoint = Endpoint("127.0.0.1", 0).claim()
    command = [
        python, "-m", "swarm.cli", "run", *row.where, "--robots", str(row.robots), "--seed", "7",
        "--pace", pace, "--dashboard", "off", "--limit", f"{limit:g}",
        "--port", str(endpoint.port), "--fleet", FLEET, *more,
    ]  # fmt: skip
    before = signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(128 + number))  # by default it leaves a fleet
    try:
        with TemporaryDirectory() as empty:  # in a checkout, Python would import the code there
            process = psutil.Popen(command, cwd=empty, stdout=subprocess.DEVNULL)
            try:
                yield process, endpoint
            finally:
                end(process)
    finally:
        signal.signal(signal.SIGTERM, before)


def end(launcher: psutil.Process) -> None:
    """End a fleet and wait for its end; kill what is left of one that does not end."""
    members = launcher.children(recursive=True) if launcher.is_running() else []
    if launcher.is_running():
        launcher.terminate()
    try:
        launcher.wait(LEAVING)
    except psutil.TimeoutExpired:
        for one in (launcher, *members):
            with suppress(psutil.NoSuchProcess):
                one.kill()
        launcher.wait()


def connected(endpoint: Endpoint) -> Bus:
    """Return a bus of the fleet, as soon as its router answers."""
    deadline = monotonic() + PATIENCE
    while True:
        try:
            return Bus(endpoint, FLEET, partial(print, file=sys.stderr)).__enter__()
        except ConfigError:
            if monotonic() > deadline:
                raise


def clocks(bus: Bus) -> Iterator[Clock]:
    """Yield the fleet's clock from the first tick to the end of the run."""
    bus.listen(CLOCK)
    while (arrived := bus.receive(PATIENCE)) is not None:
        if not isinstance(arrived, Arrival):
            continue  # under full load the router may drop this session for a moment
        if arrived.message.phase is Phase.OVER:
            return
        if arrived.message.phase is Phase.RUNNING:
            yield arrived.message


def forked(launcher: psutil.Process) -> list[psutil.Process]:
    """Return the processes of a fleet in the order of their start: the router, the world, then the robots."""
    members = launcher.children(recursive=True)
    return sorted((one for one in members if one.ppid() != launcher.pid), key=lambda one: one.pid)


def sample(tick: int, launcher: psutil.Process) -> Sample:
    """Read the CPU time of all processes of a fleet."""
    router, world, *robots = forked(launcher)
    cpu = {one: sum(one.cpu_times()[:2]) for one in (launcher, *launcher.children(recursive=True))}
    by_kind = {"router": cpu.pop(router), "world": cpu.pop(world), "robots": sum(cpu.pop(one) for one in robots)}
    return Sample(tick, monotonic(), by_kind | {"launcher": sum(cpu.values())})


def largest(launcher: psutil.Process) -> float:
    """Return the own memory of the largest robot process [MB]; reading it takes a while."""
    return max(one.memory_full_info().uss / 1e6 for one in forked(launcher)[2:])


class Ran(NamedTuple):
    """A fleet in lockstep: the samples between which the measured time passed."""

    start: float  # s, from the command to the first tick
    first: Sample
    last: Sample
    memory: float  # MB, own memory of the largest robot process, at both samples


@cache  # several tables show it
def lockstep(row: Row, seconds: float, python: str, size: int = 1) -> Ran:
    """Run a fleet in lockstep, ``size`` robots a process, until about ``seconds`` simulated seconds are measured."""
    began, start, memory = monotonic(), None, 0.0
    with fleet(row, 10_000.0, "max", "--robots-per-process", str(size), python=python) as (launcher, endpoint):
        bus = connected(endpoint)
        try:
            samples: list[Sample] = []
            for clock in clocks(bus):
                start = start or monotonic() - began
                if clock.tick >= WARMED and len(clock.present) < row.robots:
                    raise NotMeasured(f"at tick {clock.tick} only {len(clock.present)} robots were there")
                if not samples and clock.tick >= WARMED:
                    memory = largest(launcher)
                    samples.append(sample(clock.tick, launcher))
                elif samples and (clock.tick - samples[0].tick >= seconds * RATE or monotonic() - began > LONGEST):
                    samples.append(sample(clock.tick, launcher))
                    memory = max(memory, largest(launcher))
                    break
                elif monotonic() - began > LONGEST:
                    raise NotMeasured(f"after {LONGEST:g} s it was at tick {clock.tick}, before the measurement begins")
        finally:
            bus.__exit__(None, None, None)
    if start is None or len(samples) < 2:
        raise NotMeasured(f"it ran for less than {WARMED + seconds * RATE:g} ticks")
    return Ran(start, samples[0], samples[-1], memory)


def robot_tick(row: Row, ran: Ran) -> dict[str, float]:
    """Return the CPU time of a robot-tick [s], by kind of process."""
    robot_ticks = (ran.last.tick - ran.first.tick) * row.robots
    return {kind: (ran.last.cpu[kind] - before) / robot_ticks for kind, before in ran.first.cpu.items()}
