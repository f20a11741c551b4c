"""What a robot costs as the fleet grows: ``python -m benchmarks.scale [--TABLE ...] [--only ROW] [--seconds S]``.

Each row is printed as soon as it is measured, with the load of the machine. Without a table's option all are made:

* ``--one-process``: each fleet in one process; ``--python`` takes the package of another environment.
* ``--lockstep``: each fleet over processes, as fast as it can. The benchmark listens to the fleet's clock and reads the
  CPU time of all processes at two ticks, so the start is not counted. A row shows CPU time per robot and tick (robots,
  world, router and launcher together), before the work on it began and now, and who uses it; simulated over wall time,
  a robot's own memory, and the time from the command to the first tick.
* ``--realtime``: each fleet in real time, at its rate: the share of commands that came after their tick, and how long
  a tick takes, from its place in the timetable until all commands are there, against its period.
* ``--wire``: messages and bandwidth of a fleet of any size, computed from measured messages.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import Final, NamedTuple

import psutil

from benchmarks.measure import DATA, load, machine, printed
from benchmarks.scaling import realtime, wire
from benchmarks.scaling.alone import in_one_process
from benchmarks.scaling.fleets import PATIENCE, NotMeasured, fleet, lockstep, robot_tick
from benchmarks.scaling.rows import DENSITIES, RATE, ROWS, Row
from swarm.errors import SwarmError

LATE: Final = 0.01  # share of late commands, at most
SLOWEST: Final = 1.5  # times real time: a fleet that is slower is ended, and its row says so


FAULTS: Final = (NotMeasured, SwarmError, psutil.Error, subprocess.SubprocessError, OSError, ValueError, LookupError)


def in_real_time(row: Row, seconds: float, python: str) -> realtime.Punctual:
    """Run a fleet in real time, at its rate, for ``seconds`` or as many ticks as p99.9 needs."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "report.json"
        where = realtime.at_rate(row.where, row.robots, row.rate, Path(folder))
        limit = max(seconds, realtime.TICKS / row.rate)
        with fleet(row._replace(where=where), limit, "realtime", "--report", str(file), python=python) as (launcher, _):
            longest = PATIENCE + SLOWEST * limit
            try:
                launcher.wait(longest)
            except psutil.TimeoutExpired:
                raise NotMeasured(
                    f"it did not keep its rate: {limit:g} s were not over after {longest:.0f} s"
                ) from None
        return realtime.punctual(json.loads(file.read_text(encoding="utf-8")))


def bar(value: float | None) -> str:
    """Return the text of a bar; empty where there is none."""
    return "" if value is None else f"{value:g}"


def over_processes(row: Row, seconds: float, python: str, size: int) -> tuple[str, ...]:
    """Return a row's line of the table of real processes, with ``size`` robots in each."""
    ran = lockstep(row, seconds, python, size)
    cost = robot_tick(row, ran)
    whole = sum(cost.values())
    pace = (ran.last.tick - ran.first.tick) / RATE / (ran.last.wall - ran.first.wall)
    return (
        bar(row.today), f"{whole * 1e3:.2f}", bar(row.cost),
        *(f"{cost[kind] / whole:.0%}" for kind in wire.KINDS),
        f"{pace:.2f}", bar(row.pace),
        f"{ran.memory:.1f}", bar(row.memory),
        f"{ran.start:.1f}", bar(row.start), load(),
    )  # fmt: skip


def alone(row: Row, seconds: float, python: str) -> tuple[str, ...]:
    """Return a row's line of the table of one process."""
    told = in_one_process(row.where, row.robots, seconds, python)
    return (
        f"{told['robot_tick'] * 1e6:.0f}",
        f"{1 / told['robot_tick'] / RATE:.0f}", bar(row.robot_seconds),
        f"{1 / told['robot_tick'] / RATE / row.robots:.2f}",
        f"{told['length']:.0f}", bar(row.length),
        f"{told['pack'] * 1e6:.0f}", f"{told['unpack'] * 1e6:.0f}", load(),
    )  # fmt: skip


def on_time(row: Row, seconds: float, python: str) -> tuple[str, ...]:
    """Return a row's line of the table of real time."""
    told = in_real_time(row, seconds, python)
    times = (told.p50, told.p99, told.p99_9, told.longest)
    return (
        f"{row.rate:g}", f"{told.late:.4f}", bar(LATE),
        *(f"{time * 1e3:.1f}" for time in times), f"{1e3 / row.rate:g}", load(),
    )  # fmt: skip


def carried(row: Row, seconds: float, python: str) -> tuple[wire.Measured, dict[str, float], float]:
    """Measure what the robots of a fleet send, the CPU time of a robot-tick [s] by kind, and a robot's memory [MB]."""
    told = in_one_process(row.where, row.robots, seconds, python)
    ran = lockstep(row, seconds, python)
    return wire.Measured(*(told[field] for field in wire.Measured._fields)), robot_tick(row, ran), ran.memory


HEAD: Final = (
    "fleet in lockstep", "CPU per robot-tick before [ms]", "now", "bar", "robots", "world", "router",
    "x real time", "bar", "own memory [MB], largest", "bar", "first tick after [s]", "bar", "load",
)  # fmt: skip
ALONE: Final = (
    "fleet in one process", "CPU per robot-tick [us]", "robot-seconds a second of CPU", "bar", "x real time",
    "bytes of a broadcast", "bar", "packed in [us]", "unpacked in [us]", "load",
)  # fmt: skip
ON_TIME: Final = (
    "fleet in real time", "rate [Hz]", "share of late commands", "bar",
    "a tick: p50 [ms]", "p99", "p99.9", "longest", "bar of p99.9: period", "load",
)  # fmt: skip


class Asked(NamedTuple):
    """What to measure."""

    rows: list[Row]
    seconds: float
    python: str
    size: int  # robots per process

    @property
    def fleets(self) -> list[Row]:
        """The rows that also run over processes."""
        return [row for row in self.rows if row.cost is not None]


def show(head: tuple[str, ...], rows: Iterable[tuple[str, Callable[[], tuple[str, ...]]]]) -> None:
    """Print a table; a row that cannot be measured shows why."""
    printed(head, rows, *FAULTS)


def _one_process(asked: Asked) -> None:
    few = {row: min(asked.seconds, max(3.0, 3000 / row.robots)) for row in asked.rows}  # s; of 1,000 robots 3
    show(ALONE, [(row.title, partial(alone, row, few[row], asked.python)) for row in asked.rows])


def _lockstep(asked: Asked) -> None:
    show(
        HEAD,
        [(row.title, partial(over_processes, row, asked.seconds, asked.python, asked.size)) for row in asked.fleets],
    )


def _realtime(asked: Asked) -> None:
    show(ON_TIME, [(row.title, partial(on_time, row, asked.seconds, asked.python)) for row in asked.fleets])


def _wire(asked: Asked) -> None:
    lines = []
    for row in asked.fleets:
        if row.title in DENSITIES:
            measure = partial(carried, row, asked.seconds, asked.python)
            lines += [(f"{row.title}: {n:,}", partial(wire.line, n, measure)) for n in wire.FLEETS]
    show(wire.HEAD, lines)


TABLES: Final = {
    "one-process": _one_process,
    "lockstep": _lockstep,
    "realtime": _realtime,
    "wire": _wire,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in TABLES:
        parser.add_argument(f"--{name}", dest="tables", action="append_const", const=name, help="make this table")
    parser.add_argument("--only", default="", help="rows whose name begins so, for instance 'paper' or 'warehouse 64'")
    parser.add_argument("--seconds", type=float, default=30.0, help="simulated time that is measured")
    parser.add_argument("--python", type=os.path.abspath, default=sys.executable, help="interpreter of the package")
    parser.add_argument("--robots-per-process", type=int, default=1, metavar="K", help="of the table in lockstep")
    options = parser.parse_args()
    rows = [row for row in ROWS if row.title.startswith(options.only)]
    if not DATA.is_dir():
        rows = [row for row in rows if len(row.where) == 1]
        print(f"The rows on MAPF maps are left out: {DATA} is not there.\n")
    print(machine(), "\n", flush=True)
    for name in options.tables or TABLES:
        TABLES[name](Asked(rows, options.seconds, options.python, options.robots_per_process))


if __name__ == "__main__":
    main()
