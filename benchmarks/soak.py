"""Does a fleet stay as it is for an hour: ``python -m benchmarks.soak [--seconds 3600] [--robots 16] [--pace max]``.

Robots patrol the depot. Every minute of simulated time the own memory of each process is read: what it shares with no
other. The first ten minutes are left out: caches fill until then. The growth after that is the slope of a line through
all readings, since single readings jump by what garbage there is at the moment.
"""

import argparse
import json
import sys
from pathlib import Path
from statistics import linear_regression
from tempfile import TemporaryDirectory
from typing import Any, Final, NamedTuple

import msgspec
import psutil

from benchmarks.measure import load, machine, table
from benchmarks.scaling.fleets import clocks, connected, fleet, forked
from benchmarks.scaling.rows import Row
from swarm.scenario.shipped_scenarios import find_scenario

START: Final = [0.8, 0.8, 19.0, 12.0]  # m, nearly the whole floor: it takes many robots
EVERY: Final = 60.0  # s, simulated
WARM: Final = 600.0  # s, simulated
BAR: Final = 1.0  # MB an hour


class Soaked(NamedTuple):
    """The own memory [MB] of each process over simulated time [s], and the report of the run."""

    times: list[float]
    memory: dict[str, list[float]]
    report: dict[str, Any]


def own(process: psutil.Process) -> float:
    """Return the memory [MB] that a process shares with no other."""
    return float(process.memory_full_info().uss / 1e6)


def soaked(robots: int, seconds: float, pace: str, folder: Path) -> Soaked:
    """Run a fleet on patrol for some simulated seconds."""
    depot = find_scenario(Path("depot"))
    scenario = folder / "depot.yaml"
    raw = msgspec.yaml.decode(depot.read_bytes()) | {"patrol": True, "limit": seconds, "robots": robots}
    raw["start"]["area"] = START
    raw["map"]["file"] = "depot.map"
    (folder / "depot.map").write_bytes((depot.parent / "maps" / "depot.map").read_bytes())
    scenario.write_bytes(msgspec.yaml.encode(raw))
    report = folder / "report.json"
    row = Row("depot", robots, (str(scenario),))
    times: list[float] = []
    memory: dict[str, list[float]] = {}
    with fleet(row, seconds, pace, "--report", str(report), python=sys.executable) as (launcher, endpoint):
        bus = connected(endpoint)
        try:
            for clock in clocks(bus):
                if clock.time >= EVERY * (len(times) + 1):
                    times.append(clock.time)
                    router, world, *members = forked(launcher)
                    named = {"launcher": launcher, "router": router, "world": world}
                    named |= {f"robot {number}": member for number, member in enumerate(members, start=1)}
                    for name, process in named.items():
                        memory.setdefault(name, []).append(own(process))
        finally:
            bus.__exit__(None, None, None)
        launcher.wait()
    return Soaked(times, memory, json.loads(report.read_text(encoding="utf-8")))


def grown(times: list[float], sizes: list[float]) -> float:
    """Return the growth [MB an hour] after the first ten minutes."""
    late = [(time, size) for time, size in zip(times, sizes, strict=True) if time >= WARM]
    return linear_regression(*zip(*late, strict=True)).slope * 3600


def show(ran: Soaked) -> None:
    """Print the memory of each process, of the robots only the one that grew most, and what the run was like."""
    growth = {name: grown(ran.times, sizes) for name, sizes in ran.memory.items()}
    robots = [name for name in growth if name.startswith("robot")]
    worst = max(robots, key=growth.__getitem__)
    warm = next(number for number, time in enumerate(ran.times) if time >= WARM)
    head = ("own memory", "after 1 minute [MB]", "after 10 minutes", "at the end", "growth [MB an hour]", "bar")
    rows = [
        (title, f"{sizes[0]:.1f}", f"{sizes[warm]:.1f}", f"{sizes[-1]:.1f}", f"{growth[name]:+.2f}", f"{BAR:g}")
        for title, name in (("launcher", "launcher"), ("router", "router"), ("world", "world"),
                            (f"the robot of {len(robots)} that grew most", worst))
        for sizes in (ran.memory[name],)
    ]  # fmt: skip
    print(table([head, *rows]), "\n")
    report = ran.report
    traffic, laps = report["traffic"], [row["laps"] for row in report["per_robot"].values()]
    contacts = ", ".join(f"{count} {kind}" for kind, count in report["contacts"].items())
    print(
        f"{report['robots']} robots, {report['sim_time']:.0f} s simulated in {report['wall_time']:.0f} s, "
        f"{min(laps)} to {max(laps)} laps each; contacts: {contacts}; overlaps {traffic['overlaps']}, "
        f"bodies outside their cells {traffic['outside']}, stalled {traffic['stalled']}, "
        f"joint plans {traffic['joint_plans']}; load {load()}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description="A fleet on patrol for an hour.")
    parser.add_argument("--seconds", type=float, default=3600.0, help="simulated; more than 660")
    parser.add_argument("--robots", type=int, default=16)
    parser.add_argument("--pace", default="max", help="max: in lockstep; 1: in real time")
    options = parser.parse_args()
    if options.seconds <= WARM + EVERY:
        parser.error(f"--seconds: expected more than {WARM + EVERY:g}, got {options.seconds:g}")
    print(machine(), "\n")
    with TemporaryDirectory() as folder:
        show(soaked(options.robots, options.seconds, options.pace, Path(folder)))


if __name__ == "__main__":
    main()
