"""Survival: what the world's snapshots cost, as a share of the ticks between two: ``python -m benchmarks.survival``.

A snapshot is due every simulated second and at each stop reached. Its time is that of collecting, packing and writing
it in a process that also steps the robots. It is compared with the wall time of the same number of ticks of a fleet of
processes in lockstep, which is faster than real time or as fast as it gets.
"""

import argparse
import json
import subprocess
import sys
from collections import deque
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Final

from benchmarks.measure import machine, printed
from swarm.messages import Event, Liveness, Phase, Plan, Seen
from swarm.scenario.load import load
from world.fleet.publisher import EVENTS_KEPT
from world.host.pace import Times
from world.saving.snapshot_file import HostState, Saver
from world.simulate import Simulation
from world.views.progress import progress

SIDE: Final = 44  # m, of the hall
ROBOTS: Final = (8, 64)
HEAD: Final = ("robots", "snapshot [ms]", "bytes", "20 ticks of a fleet [ms]", "share", "needed")
BAR: Final = 0.03
TICKS: Final = 20  # between two snapshots


def hall() -> str:
    """Return an open hall with robots on a circle, each of which drives to the opposite point."""
    wall, row = "#" * SIDE, f"#{'.' * (SIDE - 2)}#"
    text = "".join(f"    {line}\n" for line in (wall, *[row] * (SIDE - 2), wall))
    middle = SIDE / 2
    circle = f"start:\n  circle: [{middle}, {middle}, {SIDE - 6}]\n"
    return f"name: hall\nmap:\n  cell: 1.0\n  text: |\n{text}{circle}limit: 600\n"


def plans(simulation: Simulation) -> dict[str, Plan]:
    """Return what each robot has told of its path."""
    run, tick, told = simulation.world.run, simulation.world.tick, {}
    for robot in simulation.robots:
        if (path := robot._navigator.path) is not None:
            told[robot.name] = Plan(robot=robot.name, run=run, tick=tick, points=list(path.points))
    return told


def snapshots(scenario: Path, robots: int, seconds: int) -> tuple[float, int]:
    """Return the time [s] of a snapshot, the median of a run of ``seconds`` simulated seconds, and its bytes."""
    simulation = Simulation.of(load(scenario), robots, 1)
    world = simulation.world
    empty = Times()

    def host() -> HostState:
        states = {name: progress(name, world) for name in world.robots}
        return HostState(
            phase=Phase.RUNNING, held=False, reason="", lost=[], wall_time=0.0, present=list(world.robots),
            most_in_one=1, late=0, states=states, plans=plans(simulation), events=list(events),
            seen=dict.fromkeys(world.robots, Seen(Liveness.ALIVE, 0.0)), left=set(), tick_bins=empty.bins,
            tick_longest=empty.longest, not_reproducible=[], pressed={}, tape=0,
        )  # fmt: skip

    file = scenario.with_suffix(".snapshot")
    saver = Saver(file, simulation.scenario, 1, print)
    times, events = [], deque[Event](maxlen=EVENTS_KEPT)
    for _ in range(seconds):
        for _ in range(TICKS):
            events.extend(simulation.step().events)
        began = perf_counter()
        saver.save(world, host)
        times.append(perf_counter() - began)
    return median(times), file.stat().st_size


def tick_of_a_fleet(scenario: Path, robots: int, seconds: int) -> float:
    """Return the mean wall time [s] of a tick of a fleet of processes in lockstep."""
    report = scenario.with_name(f"{robots}.json")
    command = ("run", str(scenario), "--robots", str(robots), "--pace", "max", "--dashboard", "off")
    arguments = (*command, "--limit", str(seconds), "--report", str(report))
    done = subprocess.run([sys.executable, "-m", "swarm.cli", *arguments], stdout=subprocess.DEVNULL, check=False)
    if done.returncode not in {0, 1}:  # 1: the limit came before the last stop
        raise SystemExit(f"swarm run with {robots} robots: expected status 0 or 1, got {done.returncode}")
    summary = json.loads(report.read_text(encoding="utf-8"))
    return float(summary["wall_time"] / summary["ticks"])


def measure(scenario: Path, robots: int, seconds: int, shares: dict[int, float]) -> list[str]:
    """Return the cells of a row, and note the share for this many robots."""
    save, size = snapshots(scenario, robots, seconds)
    between = TICKS * tick_of_a_fleet(scenario, robots, seconds)
    shares[robots] = save / between
    return [f"{1000 * save:.2f}", f"{size}", f"{1000 * between:.0f}", f"{shares[robots]:.1%}", f"< {BAR:.0%}"]


def main() -> int:
    """Print the table; return 1 if a share is above what is needed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=int, default=20, help="simulated seconds of each run")
    given = parser.parse_args()
    shares: dict[int, float] = {}
    print(machine())
    with TemporaryDirectory() as folder:
        scenario = Path(folder) / "hall.yaml"
        scenario.write_text(hall(), encoding="utf-8")
        rows = [
            (str(robots), lambda robots=robots: measure(scenario, robots, given.seconds, shares)) for robots in ROBOTS
        ]
        printed(HEAD, rows)
    return 1 if any(share >= BAR for share in shares.values()) else 0


if __name__ == "__main__":
    sys.exit(main())
