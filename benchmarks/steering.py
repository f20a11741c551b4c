"""Steering: how much the fuzzy tables steer, and what wrong tables still reach.

The first table is the paper's mission, also with the profile `careful`; the second is other floors. The columns are:
complete runs; mean time; contacts; overlapping reservations; the share of the turned angle that the tables steered; the
same with ``tightened`` turns added (same yaw rate, less forward speed); the share of the robots' time in which the
tables got scaled distances; and the mean scale then. The world computes all of it (``world/measure/steering.py``).

The third table is the control: useless tables, in three times the paper's mean time. If such a run reaches a stop,
something other than the tables has steered.

The cases on MAPF maps need the benchmark data beside the project; without it they are left out, and the page states it.
``--few`` is a short run. Several runs go in parallel, one per core.
"""

import argparse
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from functools import partial
from statistics import mean
from typing import Any, Final, NamedTuple

from benchmarks.measure import DATA, machine, table
from benchmarks.traffic import HARD, rows_for, scenario_of
from swarm.fuzzy import Profile, load_profile
from swarm.scenario.load import Scenario
from tests.shared import constant_rules, with_consequents
from world.simulate import Simulation

LIMIT: Final = 900.0  # s, simulated
PATIENCE: Final = 3.0  # limit for wrong tables, in multiples of the paper's mean time
FLOORS: Final = (
    ("doorway", 8), ("circle 8", 8), ("circle 16", 16), ("crossing", 8), ("office", 4), ("depot", 4), ("corridor", 2),
    ("l_corner", 2),
)  # fmt: skip
MAPF: Final = "random-32-32-20"


class Amount(NamedTuple):
    """How many robots and seeds to run."""

    robots: tuple[int, ...]  # in the paper's mission
    seeds: int  # of each
    floor_seeds: int
    wrong_robots: tuple[int, ...]


FULL: Final = Amount((1, 2, 4, 8, 12), 10, 3, (1, 2, 4, 8))
FEW: Final = Amount((1, 2, 4), 3, 1, (1, 2))


def always(left: str, right: str) -> Callable[[Profile], Profile]:
    """Return a change of a profile after which every rule has the same consequents."""
    return partial(constant_rules, left=left, right=right)


def swapped(profile: Profile) -> Profile:
    """Return the profile with the outputs of the two wheels exchanged."""
    return with_consequents(profile, lambda behaviour, terms: (*terms[:-2], terms[-1], terms[-2]))


def aimless(profile: Profile) -> Profile:
    """Return the profile with the consequents medium/medium in all goal seeking rules."""

    def choose(behaviour: str, terms: tuple[str, ...]) -> tuple[str, ...]:
        return (*terms[:-2], "medium", "medium") if behaviour == "goal_seeking" else terms

    return with_consequents(profile, choose)


CONSTANT: Final = (("medium", "medium"), ("slow", "slow"), ("fast", "fast"), ("slow", "fast"), ("fast", "slow"))
WRONG: Final[dict[str, Callable[[Profile], Profile]]] = {
    **{f"always {left}/{right}": always(left, right) for left, right in CONSTANT},
    "wheels swapped": swapped,
    "goal seeking always medium/medium": aimless,
}


def run(floor: str, robots: int, seed: int, limit: float = LIMIT, rules: str = "") -> dict[str, Any]:
    """Run a floor, optionally with wrong tables or a built-in profile, and return its report."""
    scenario = rows_for(scenario_of(floor), seed)
    profile = WRONG[rules](scenario.profile) if rules in WRONG else load_profile(rules) if rules else scenario.profile
    return Simulation.of(Scenario(scenario.settings, scenario.map, profile), robots, seed).run(limit)


def floors() -> Iterator[tuple[str, int]]:
    """Yield the other floors, and the number of robots on each."""
    yield from FLOORS
    if DATA.is_dir():
        yield MAPF, 16
        yield from ((name, len(scenario_of(name).settings.own_targets)) for name in HARD)


Reports = Sequence[dict[str, Any]]
HEAD: Final = (
    "complete", "time [s]", "contacts", "overlaps", "angle by the tables", "+ tightened", "scaled", "mean scale",
)  # fmt: skip
WRONG_HEAD: Final = ("within [s]", "stops reached", "contacts", "overlaps", "angle by the tables")


def contacts(reports: Reports) -> str:
    """Return the number of contacts of all kinds."""
    return str(sum(sum(one["contacts"].values()) for one in reports))


def overlaps(reports: Reports) -> str:
    """Return the number of overlapping reservations."""
    return str(sum(one["traffic"]["overlaps"] for one in reports))


def angle(reports: Reports, *labels: str) -> str:
    """Return the mean share of the turned angle with these steering labels."""
    return f"{mean(sum(one['steering']['angle'][label] for label in labels) for one in reports):.2f}"


def row(reports: Reports) -> tuple[str, ...]:
    """Return the row of a case."""
    scaled = [one["steering"]["scaled"] for one in reports]
    time = sum(part["time"] for part in scaled)
    robot_time = sum(one["sim_time"] * one["robots"] for one in reports)
    return (
        f"{sum(one['complete'] for one in reports)} of {len(reports)}",
        f"{mean(one['sim_time'] for one in reports):.0f}",
        contacts(reports),
        overlaps(reports),
        angle(reports, "tables"),
        angle(reports, "tables", "tightened"),
        f"{time / robot_time:.2f}",
        f"{sum(part['time'] * part['mean'] for part in scaled) / time:.2f}" if time else "",
    )


def wrong_row(limit: float, reports: Reports) -> tuple[str, ...]:
    """Return the row of a case with wrong tables within ``limit`` [s]."""
    times = [time for one in reports for robot in one["per_robot"].values() for time in robot["reached"]]
    reached = f"{len(times) - times.count(None)} of {len(times)}"
    return f"{limit:.0f}", reached, contacts(reports), overlaps(reports), angle(reports, "tables")


Runs = dict[str, list[Future[dict[str, Any]]]]


def done(runs: Runs) -> dict[str, Reports]:
    """Wait for the runs of all cases; return their reports."""
    found: dict[str, Reports] = {}
    for name, futures in runs.items():
        found[name] = [future.result() for future in futures]
        print(name, *row(found[name]), sep=" | ", file=sys.stderr, flush=True)  # progress, not on the page
    return found


def show(title: str, head: tuple[str, ...], rows: dict[str, tuple[str, ...]]) -> None:
    """Print a table."""
    print(f"\n{title}\n\n{table([('case', *head), *((name, *cells) for name, cells in rows.items())])}", flush=True)


def measure(pool: ProcessPoolExecutor, amount: Amount) -> None:
    """Run everything and print the three tables."""
    seeds, floor_seeds = range(1, 1 + amount.seeds), range(1, 1 + amount.floor_seeds)
    first = {f"paper {n}": [pool.submit(run, "paper", n, seed) for seed in seeds] for n in amount.robots}
    first["paper 4, careful"] = [pool.submit(run, "paper", 4, seed, LIMIT, "careful") for seed in seeds]
    paper = done(first)
    show(f"The paper's mission, seeds 1 to {amount.seeds}:", HEAD, {name: row(one) for name, one in paper.items()})
    other = done({f"{floor.split()[0]} {n}": [pool.submit(run, floor, n, seed) for seed in floor_seeds]
                  for floor, n in floors()})  # fmt: skip
    show(f"Other floors, seeds 1 to {amount.floor_seeds}:", HEAD, {name: row(one) for name, one in other.items()})
    cases = {f"{rules}, {n}": (rules, n, PATIENCE * mean(one["sim_time"] for one in paper[f"paper {n}"]))
             for rules in WRONG for n in amount.wrong_robots}  # fmt: skip
    wrong = done({name: [pool.submit(run, "paper", n, 1, limit, rules)] for name, (rules, n, limit) in cases.items()})
    rows = {name: wrong_row(cases[name][2], one) for name, one in wrong.items()}
    show("The paper's mission with wrong tables, seed 1:", WRONG_HEAD, rows)


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--few", action="store_true", help="few robots and seeds")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    given = parser.parse_args()
    print(machine())
    with ProcessPoolExecutor(given.jobs) as pool:
        measure(pool, FEW if given.few else FULL)
    if not DATA.is_dir():
        print("\nThe MAPF maps are not beside the project: their cases are left out.")


if __name__ == "__main__":
    main()
