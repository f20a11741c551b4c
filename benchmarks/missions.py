"""The paper's mission without any bus: ``python -m benchmarks.missions``.

World and robots run in one process; every line is one run of ``scenarios/paper.yaml``.
"""

from pathlib import Path
from statistics import mean
from typing import Any, Final

from benchmarks.measure import machine, table
from swarm.scenario.load import Scenario, load
from swarm.settings import PAPER_TOP_SPEED
from world.simulate import Simulation

SCENARIO: Final = Path(__file__).parents[1] / "scenarios" / "paper.yaml"
CRUISE: Final = 1.5  # m/s, speed of the paper's tables straight ahead with nothing near, before speed_scale
ALONE, FOUR, EIGHT, TWELVE = range(1, 21), range(1, 11), range(1, 11), range(1, 6)  # seeds


def run(scenario: Scenario, robots: int, seed: int) -> dict[str, Any]:
    """Run one mission to its end and return its report."""
    return Simulation.of(scenario, robots, seed).run()


def ideal(scenario: Scenario, report: dict[str, Any]) -> float:
    """Return the time [s] that the slowest robot needs for its shortest way at cruising speed."""
    speed = min(CRUISE, PAPER_TOP_SPEED) * scenario.settings.robot.speed_scale
    return float(max(row["shortest_length"] for row in report["per_robot"].values()) / speed)


def handovers(report: dict[str, Any]) -> list[float]:
    """Return for each target the mean time [s] from one robot's arrival to the next one's; no number for one robot."""
    reached = zip(*(row["reached"] for row in report["per_robot"].values()), strict=True)
    times = [sorted(time for time in row if time is not None) for row in list(reached)[:-1]]  # the last one is home
    return [(row[-1] - row[0]) / (len(row) - 1) for row in times if len(row) > 1]


def line(scenario: Scenario, report: dict[str, Any]) -> tuple[str, ...]:
    """Return one run as a row of the table."""
    gap, contacts = report["clearance_min"], report["contacts"]
    return (
        str(report["seed"]),
        "yes" if report["complete"] else report["reason"],
        " + ".join(str(contacts[kind]) for kind in ("robot", "wall", "obstacle")),
        f"{gap:.3f}",
        f"{report['sim_time']:.0f}",
        f"{report['sim_time'] / ideal(scenario, report):.2f}",
        f"{report['traffic']['longest_wait']:.0f}",
        str(report["traffic"]["deadlocks"]),
        f"{report['steering']['angle']['tables']:.2f}",
        str(report["traffic"]["joint_plans"]),
        ", ".join(f"{gap:.1f}" for gap in handovers(report)),
    )


HEAD: Final = (
    "seed", "complete", "contacts: robot + wall + obstacle", "smallest gap [m]", "time [s]",
    "x shortest at cruise", "longest wait [s]", "deadlocks", "angle by the tables",
    "joint plans", "s between arrivals at target 1, 2, 3",
)  # fmt: skip


def summary(scenario: Scenario, reports: list[dict[str, Any]]) -> str:
    """Return a sentence with the worst values of many runs."""
    contacts = sum(sum(report["contacts"].values()) for report in reports)
    return (
        f"{sum(report['complete'] for report in reports)} of {len(reports)} complete, {contacts} contacts, "
        f"smallest gap {min(report['clearance_min'] for report in reports):.3f} m, "
        f"at most {max(report['sim_time'] / ideal(scenario, report) for report in reports):.2f} x the shortest way "
        f"at cruising speed, longest wait {max(report['traffic']['longest_wait'] for report in reports):.0f} s, "
        f"angle by the tables at least {min(report['steering']['angle']['tables'] for report in reports):.2f}, "
        f"mean time {mean(report['sim_time'] for report in reports):.1f} s, "
        f"{mean(report['traffic']['joint_plans'] for report in reports):.1f} joint plans"
    )


def main() -> None:
    scenario = load(SCENARIO)
    print(machine())
    for robots, seeds in ((1, ALONE), (4, FOUR), (8, EIGHT), (12, TWELVE)):
        reports = [run(scenario, robots, seed) for seed in seeds]
        print(f"\n{robots} robot{'s' * (robots > 1)}: {summary(scenario, reports)}\n")
        print(table([HEAD, *(line(scenario, report) for report in reports)]))


if __name__ == "__main__":
    main()
