"""What a robot costs over real processes as the fleet grows: ``python -m benchmarks.scale [--only ROW] [--seconds S]``.

The first table runs each fleet in one process; ``--python .venv-compiled/bin/python`` takes the compiled package. The
second runs it over processes, in lockstep as fast as it can: the benchmark listens to the fleet's clock and reads the
CPU time of all processes at two ticks, so the start is not counted. A row shows CPU time per robot and tick (robots,
world, router and launcher together), simulated over wall time, a robot's own memory, and the time from the command to
the first tick. With ``--realtime`` the fleets run in real time instead; the table shows the share of commands that came
after their tick.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from time import monotonic
from typing import Final, NamedTuple

import psutil

from benchmarks.measure import DATA, machine, table
from swarm.bus import Arrival, Bus, Endpoint
from swarm.errors import ConfigError
from swarm.messages import CLOCK, Clock, Phase

FLEET: Final = "scale"
RATE: Final = 20  # Hz of all rows
WARMED: Final = 40  # ticks after which the measurement begins: all kernels have run
PATIENCE: Final = 120.0  # s for a fleet to start


class Row(NamedTuple):
    """A fleet, and its bars."""

    name: str
    robots: int
    where: tuple[str, ...]  # arguments of ``swarm run``
    cost: float  # ms of CPU per robot-tick
    pace: float | None  # times real time
    length: int  # mean bytes of a broadcast
    memory: float  # MB, own memory of a robot
    start: float  # s, from the command to the first tick


def _map(name: str) -> tuple[str, ...]:
    return str(DATA / f"{name}.map"), "--scen", str(DATA / f"{name}-random-1.scen")


WAREHOUSE: Final = "warehouse-10-20-10-2-1"
# fmt: off
ROWS: Final = (
    Row("paper",           8,   ("paper",),                0.60, 15.0, 250, 15.0, 2.0),
    Row("random-32-32-20", 16,  _map("random-32-32-20"),   0.65, 8.0,  400, 15.0, 2.5),
    Row("random-32-32-20", 32,  _map("random-32-32-20"),   0.80, 3.0,  900, 17.0, 3.0),
    Row("warehouse",       64,  _map(WAREHOUSE),           0.70, None, 320, 20.0, 5.0),
    Row("warehouse",       128, _map(WAREHOUSE),           0.80, None, 450, 20.0, 8.0),
)
# fmt: on


ROBOT_SECONDS: Final = 300  # a second, in one process
LATE: Final = 0.01  # share of late commands, at most


class Sample(NamedTuple):
    """A fleet's use of the machine at one tick."""

    tick: int
    wall: float  # s
    cpu: float  # s, of all its processes
    memory: list[float]  # MB, own memory of each process of robots


@contextmanager
def fleet(row: Row, limit: float, pace: str, *more: str) -> Iterator[tuple[psutil.Process, Endpoint]]:
    """Run a row's fleet inside the block."""
    endpoint = Endpoint("127.0.0.1", 0).claim()
    command = [
        sys.executable, "-m", "swarm.cli", "run", *row.where, "--robots", str(row.robots), "--seed", "7",
        "--pace", pace, "--dashboard", "off", "--limit", f"{limit:g}",
        "--port", str(endpoint.port), "--fleet", FLEET, *more,
    ]  # fmt: skip
    process = psutil.Popen(command, stdout=subprocess.DEVNULL)
    try:
        yield process, endpoint
    finally:
        if process.is_running():
            process.terminate()
        process.wait()


def connected(endpoint: Endpoint) -> Bus:
    """Return a bus of the fleet, as soon as its router answers."""
    deadline = monotonic() + PATIENCE
    while True:
        try:
            return Bus(endpoint, FLEET, print).__enter__()
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


def sample(tick: int, launcher: psutil.Process, processes: int) -> Sample:
    """Read the CPU time and the memory of all processes of a fleet."""
    members = [launcher, *launcher.children(recursive=True)]
    deep = sorted((one for one in members[1:] if one.ppid() != launcher.pid), key=lambda one: one.pid)[-processes:]
    cpu = sum(sum(one.cpu_times()[:2]) for one in members)
    return Sample(tick, monotonic(), cpu, [one.memory_full_info().uss / 1e6 for one in deep])


class Ran(NamedTuple):
    """A fleet in lockstep: the samples between which the measured time passed, and how long it took to start [s]."""

    start: float
    first: Sample
    last: Sample


def lockstep(row: Row, seconds: float, size: int) -> Ran:
    """Run a fleet in lockstep, ``size`` robots a process, until about ``seconds`` simulated seconds are measured."""
    began, start = monotonic(), None
    with fleet(row, 10_000.0, "max", "--robots-per-process", str(size)) as (launcher, endpoint):
        bus = connected(endpoint)
        try:
            samples: list[Sample] = []
            for clock in clocks(bus):
                start = start or monotonic() - began
                if clock.tick >= WARMED:
                    samples.append(sample(clock.tick, launcher, -(-row.robots // size)))
                if samples and samples[-1].tick - samples[0].tick >= seconds * RATE:
                    break
        finally:
            bus.__exit__(None, None, None)
    if start is None or not samples:
        raise SystemExit(f"{row.name} {row.robots}: the fleet did not run for {WARMED} ticks")
    return Ran(start, samples[0], samples[-1])


def late_share(row: Row, seconds: float) -> float:
    """Run a fleet in real time; return the share of commands that came after their tick."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "report.json"
        with fleet(row, seconds, "realtime", "--report", str(file)) as (launcher, _):
            launcher.wait()
        report = json.loads(file.read_text(encoding="utf-8"))
    return float(report["late_commands"] / (report["sim_time"] * RATE * row.robots))


def in_one_process(row: Row, seconds: float, python: str) -> dict[str, float]:
    """Run a row's fleet in one process with the package beside an interpreter; return what the peer measured."""
    peer = Path(__file__).with_name("scale_peer.py")
    command = [python, str(peer), f"{seconds:g}", str(row.robots), *(part for part in row.where if part != "--scen")]
    with tempfile.TemporaryDirectory() as empty:  # in a checkout, Python would import the code there
        answer = subprocess.run(command, cwd=empty, stdout=subprocess.PIPE, text=True, check=True)
    told: dict[str, float] = json.loads(answer.stdout)
    return told


def over_processes(row: Row, seconds: float, size: int) -> tuple[str, ...]:
    """Return a row's line of the table of real processes."""
    start, first, last = lockstep(row, seconds, size)
    ticks = last.tick - first.tick
    cost = (last.cpu - first.cpu) / ticks / row.robots * 1e3
    pace = ticks / RATE / (last.wall - first.wall)
    return (
        f"{row.name} {row.robots}",
        f"{cost:.2f}", f"{row.cost:.2f}",
        f"{pace:.1f}", "" if row.pace is None else f"{row.pace:g}",
        f"{max(last.memory):.1f}", f"{row.memory:g}",
        f"{start:.1f}", f"{row.start:g}",
        f"{os.getloadavg()[0]:.1f}",
    )  # fmt: skip


def alone(row: Row, seconds: float, python: str) -> tuple[str, ...]:
    """Return a row's line of the table of one process."""
    told = in_one_process(row, seconds, python)
    return (
        f"{row.name} {row.robots}",
        f"{told['robot_tick'] * 1e6:.0f}",
        f"{1 / told['robot_tick'] / RATE:.0f}", f"{ROBOT_SECONDS:g}",
        f"{told['length']:.0f}", f"{row.length}",
        f"{told['pack'] * 1e6:.0f}", f"{told['unpack'] * 1e6:.0f}",
    )  # fmt: skip


HEAD: Final = (
    "fleet in lockstep", "CPU per robot-tick [ms]", "bar", "x real time", "bar",
    "own memory [MB], largest", "bar", "first tick after [s]", "bar", "load",
)  # fmt: skip
ALONE: Final = (
    "fleet in one process", "CPU per robot-tick [us]", "robot-seconds a second of CPU", "bar",
    "bytes of a broadcast", "bar", "packed in [us]", "unpacked in [us]",
)  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", help="rows whose name begins so, for instance 'paper' or 'warehouse 64'")
    parser.add_argument("--seconds", type=float, default=30.0, help="simulated time that is measured")
    parser.add_argument("--robots-per-process", type=int, default=1, metavar="K", help="for the lockstep table")
    parser.add_argument("--realtime", action="store_true", help="run in real time and count late commands")
    parser.add_argument("--one-process", action="store_true", help="only the table of one process")
    parser.add_argument("--python", type=os.path.abspath, default=sys.executable, help="interpreter of the package")
    options = parser.parse_args()
    rows = [row for row in ROWS if f"{row.name} {row.robots}".startswith(options.only)]
    if not DATA.is_dir():
        rows = [row for row in rows if len(row.where) == 1]
        print(f"The rows on MAPF maps are left out: {DATA} is not there.\n")
    print(machine(), "\n")
    if options.realtime:
        body = [
            (
                f"{row.name} {row.robots}",
                f"{late_share(row, options.seconds):.4f}",
                f"{LATE:g}",
                f"{os.getloadavg()[0]:.1f}",
            )
            for row in rows
        ]
        print(table([("fleet in real time, 20 Hz", "share of late commands", "bar", "load"), *body]))
    else:
        print(table([ALONE, *(alone(row, options.seconds, options.python) for row in rows)]), "\n", flush=True)
        if not options.one_process:
            print(table([HEAD, *(over_processes(row, options.seconds, options.robots_per_process) for row in rows)]))


if __name__ == "__main__":
    main()
