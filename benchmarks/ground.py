"""Ground that changes, ground unknown: ``python -m benchmarks.ground``.

World and robots run in one process; every number is of whole missions of the named scenarios.
"""

from pathlib import Path
from time import perf_counter
from typing import Any, Final

from benchmarks.measure import machine, table
from swarm.maps.occupancy import Point
from swarm.messages import Edit, Kind
from swarm.scenario.load import Scenario, load
from tests.ground.floors import overhear
from tests.shared import with_settings
from world.simulate import Simulation
from world.world import World

SCENARIOS: Final = Path(__file__).parents[1] / "scenarios"
MOVERS, LEARN, SHARE, ROUGH = range(1, 21), range(1, 11), range(1, 6), range(1, 4)  # seeds
WALL: Final = ((6.5, 9.0), (7.0, 10.5)), ((15.0, 5.0), (16.0, 6.0))  # m, two rectangles on the robots' ways
PUT: Final = 100  # tick


def runs(scenario: Scenario, robots: int, seeds: range) -> tuple[list[dict[str, Any]], float]:
    """Run whole missions; return their reports and the mean wall time of one [s]."""
    began = perf_counter()
    reports = [Simulation.of(scenario, robots, seed).run() for seed in seeds]
    return reports, (perf_counter() - began) / len(reports)


def total(reports: list[dict[str, Any]], field: str) -> float:
    """Return the sum of a field over all robots of all runs."""
    return float(sum(row[field] for report in reports for row in report["per_robot"].values()))


def contacts(reports: list[dict[str, Any]], kind: str) -> int:
    """Return the number of contacts of a kind."""
    return sum(report["contacts"][kind] for report in reports)


def complete(reports: list[dict[str, Any]]) -> str:
    """Return how many runs were complete, as text."""
    return f"{sum(report['complete'] for report in reports)} of {len(reports)}"


def edits() -> str:
    """Put two walls on the paper's ways at a tick; return the table of new plans and contacts."""
    rows = [("robots", "complete", "plans of that tick", "most ticks to a new plan", "wall + obstacle contacts")]
    paper = load(SCENARIOS / "paper.yaml")
    for robots, seeds in ((1, SHARE), (4, ROUGH)):
        reports, waits = [], []
        for seed in seeds:
            simulation = Simulation.of(paper, robots, seed)
            listeners = overhear(simulation)
            reports.append(simulation.run(watch=put))
            waits += [listener.first_plan_from(PUT)[0] - PUT for listener in listeners]
        touched = contacts(reports, "wall") + contacts(reports, "obstacle")
        rows.append((str(robots), complete(reports), str(len(waits)), str(max(waits)), str(touched)))
    return table(rows)


def put(world: World) -> None:
    """Put the walls onto the map at tick ``PUT``."""
    if world.tick == PUT:
        for low, high in WALL:
            world.edit(wall(low, high))


def wall(low: Point, high: Point) -> Edit:
    return Edit(kind=Kind.WALL, low=low, high=high)


def movers() -> str:
    """Let moving obstacles that never stop cross the robots' ways; return the table."""
    rows = [("robots", "complete", "contacts with movers", "of those, robot moving", "wall contacts", "mean time [s]")]
    scenario = load(SCENARIOS / "movers.yaml")
    for robots in (1, 4):
        reports, _ = runs(scenario, robots, MOVERS)
        moving = total(reports, "contacts") - total(reports, "struck")
        time = sum(report["sim_time"] for report in reports) / len(reports)
        met = contacts(reports, "obstacle")
        rows.append(
            (str(robots), complete(reports), str(met), f"{moving:.0f}", str(contacts(reports, "wall")), f"{time:.0f}")
        )
    return table(rows)


def unknown() -> str:
    """Run robots without a map: alone, sharing or not, with noise and radio loss; return the table."""
    rows = [
        ("unknown floor", "runs complete", "wall + obstacle contacts", "smallest gap [m]", "driven in all [m]",
         "mean time [s]", "wall time of a run [s]")
    ]  # fmt: skip
    scenario = load(SCENARIOS / "unknown.yaml")
    rough: dict[str, dict[str, Any]] = {"sensors": {"noise": 0.02}, "radio": {"loss": 0.3}}
    cases = {
        "1 robot": (scenario, 1, LEARN),
        "4 robots, shared by radio": (scenario, 4, SHARE),
        "4 robots, each for itself": (with_settings(scenario, map={"shared": False}), 4, SHARE),
        "1 robot, noise 0.02 m": (with_settings(scenario, sensors={"noise": 0.02}), 1, SHARE),
        "4 robots, noise 0.02 m, radio loss 30 %": (with_settings(scenario, **rough), 4, ROUGH),
    }
    for name, (case, robots, seeds) in cases.items():
        reports, wall_time = runs(case, robots, seeds)
        rows.append((
            name,
            complete(reports),
            str(contacts(reports, "wall") + contacts(reports, "obstacle")),
            f"{min(report['clearance_min'] for report in reports):.3f}",
            f"{total(reports, 'path_length'):.0f}",
            f"{sum(report['sim_time'] for report in reports) / len(reports):.0f}",
            f"{wall_time:.1f}",
        ))  # fmt: skip
    return table(rows)


def main() -> None:
    """Print all tables."""
    print(f"{machine()}.")
    print(f"\nTwo walls put on the paper's ways at tick {PUT}:\n")
    print(edits(), flush=True)
    print("\nscenarios/movers.yaml:\n")
    print(movers(), flush=True)
    print("\nscenarios/unknown.yaml:\n")
    print(unknown(), flush=True)


if __name__ == "__main__":
    main()
