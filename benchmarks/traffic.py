"""Fleets under the rule of holds, in physics: ``python -m benchmarks.traffic [--seeds N] [--large]``.

Each row is a case over some seeds, in one process, with the paper's controller: how many completed, contacts,
overlapping holds and bodies outside them, time over the longest robot's shortest way at cruising speed, driven over
shortest length, share of fuzzy steering. The cases on MAPF maps need the benchmark data beside the project; without it
they are left out, and the table says so. ``--large`` adds those with 32 and 50 robots.
"""

import argparse
from collections.abc import Callable, Iterator
from pathlib import Path
from statistics import median
from typing import Any, Final

import msgspec

from benchmarks.measure import machine, table
from swarm.scenario.benchmark import from_benchmark
from swarm.scenario.load import Scenario, load
from swarm.traffic.cells_of import with_lattice
from world.simulate import Simulation

ROOT: Final = Path(__file__).parents[1]
DATA: Final = ROOT.parent / "shared" / "data" / "mapf"
CIRCLES: Final = {8: 14.0, 16: 19.0, 32: 29.0}  # robots: diameter [m]
MAPS: Final = ("random-32-32-20", "room-32-32-4", "maze-32-32-4", "empty-16-16")
LIMIT: Final = 900.0  # s, simulated

Case = tuple[str, Callable[[], Scenario], int]


def changed(scenario: Scenario, **sections: dict[str, Any]) -> Scenario:
    """Change fields of a scenario's sections."""
    settings = scenario.settings
    for name, fields in sections.items():
        settings = msgspec.structs.replace(
            settings, **{name: msgspec.structs.replace(getattr(settings, name), **fields)}
        )
    return Scenario(with_lattice(settings, scenario.map), scenario.map, scenario.profile)


def paper() -> Scenario:
    """The paper's mission under holds; the start area has a cell for each of 12 robots."""
    scenario = load(ROOT / "scenarios" / "paper.yaml")
    return changed(scenario, traffic={"rule": "holds"}, start={"area": (0.8, 0.8, 6.2, 6.2)})


def cases(large: bool) -> Iterator[Case]:
    """List what is run: a name, how the scenario is made, how many robots."""
    for robots in (1, 2, 4, 8, 12):
        yield f"paper {robots}", paper, robots
    for robots, diameter in CIRCLES.items():
        yield f"circle {robots}", lambda d=diameter: circle(d), robots
    files = (("corridor", 2), ("l_corner", 2), ("doorway", 8), ("doorway", 16), ("crossing", 8), ("crossing", 16))
    for name, robots in files:
        yield f"{name} {robots}", lambda n=name: load(ROOT / "scenarios" / f"{n}.yaml"), robots
    yield "doorway 8, 5 m, 30 % loss", lambda: lossy(load(ROOT / "scenarios" / "doorway.yaml")), 8
    yield "corridor 2, 5 m, 30 % loss", lambda: lossy(load(ROOT / "scenarios" / "corridor.yaml")), 2
    if not DATA.is_dir():
        return
    for name in ("tree", "corners", "tunnel", "string"):
        hard = DATA / "hard" / name
        rows = from_benchmark(hard.with_suffix(".map"), hard.with_suffix(".scen"), None).settings.robots
        yield name, lambda h=hard: from_benchmark(h.with_suffix(".map"), h.with_suffix(".scen"), None), rows
    for name in MAPS:
        for robots in (16, 32, 50) if large else (16,):
            yield f"{name} {robots}", lambda n=name, r=robots: mapf(n, r), robots
    yield "random-32-32-20 16, 5 m, 30 % loss", lambda: lossy(mapf("random-32-32-20", 16)), 16


def circle(diameter: float) -> Scenario:
    """Everybody swaps with the one opposite."""
    return changed(load(ROOT / "scenarios" / "circle.yaml"), start={"circle": (18.0, 18.0, diameter)})


def lossy(scenario: Scenario) -> Scenario:
    """Hear no farther than 5 m, and of that two thirds."""
    return changed(scenario, radio={"range": 5.0, "loss": 0.3})


def mapf(name: str, robots: int) -> Scenario:
    """A map of the MAPF benchmarks."""
    return from_benchmark(DATA / f"{name}.map", DATA / f"{name}-random-1.scen", robots)


def row(name: str, make: Callable[[], Scenario], robots: int, seeds: int) -> tuple[str, ...]:
    """Run a case over its seeds and sum it up."""
    scenario = make()
    cruise = 1.5 * scenario.settings.robot.speed_scale
    reports = [Simulation.of(scenario, robots, seed).run(limit=LIMIT) for seed in range(1, seeds + 1)]
    done = sum(report["complete"] for report in reports)
    contacts = sum(sum(report["contacts"].values()) for report in reports)
    faults = sum(report["traffic"]["overlaps"] + report["traffic"]["outside"] for report in reports)
    ratios, lengths = [], []
    for report in reports:
        robots_of = report["per_robot"].values()
        ratios.append(report["sim_time"] * cruise / max(one["shortest_length"] for one in robots_of))
        lengths.append(sum(o["path_length"] for o in robots_of) / sum(o["shortest_length"] for o in robots_of))
    return (
        name,
        f"{done} of {seeds}",
        str(contacts),
        str(faults),
        f"{median(report['sim_time'] for report in reports):.0f}",
        f"{median(ratios):.2f}",
        f"{median(lengths):.2f}",
        f"{median(report['fuzzy_share'] for report in reports):.2f}",
        f"{median(report['traffic']['joint_plans'] for report in reports):.0f}",
        f"{max(report['traffic']['longest_wait'] for report in reports):.0f}",
        f"{median(report['wall_time'] for report in reports):.0f}",
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--only", default="", help="cases whose name begins so")
    parser.add_argument("--large", action="store_true", help="the MAPF maps with 32 and 50 robots too")
    given = parser.parse_args()
    head = "case|complete|contacts|overlaps + outside|time [s]|/ shortest at cruise|driven / shortest|fuzzy share"
    head += "|joint plans|longest wait [s]|wall [s]"
    rows: list[tuple[str, ...]] = [tuple(head.split("|"))]
    for name, make, robots in cases(given.large):
        if name.startswith(given.only):
            rows.append(row(name, make, robots, given.seeds))
    print(f"{machine()}\n\n{table(rows)}")
    if not DATA.is_dir():
        print("\nThe MAPF maps are not beside the project: their cases are left out.")


if __name__ == "__main__":
    main()
