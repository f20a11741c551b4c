"""What an error of the pose costs: ``python -m benchmarks.localisation [--seeds N] [--start A] [--only TEXT]``.

Each row is a scenario with an error of the pose, over seeds that nobody has looked at: how many runs are complete, what
was touched, cells with two owners, bodies outside their cells, the time against the same seeds with exact poses, and
the share of the turned angle that the fuzzy tables chose.
"""

import argparse
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path
from statistics import mean
from time import process_time
from typing import Any, Final, NamedTuple

import msgspec

from benchmarks.measure import load as load_of_machine
from swarm.scenario.load import load
from swarm.settings import JumpSettings, LocalisationSettings
from world.simulate import Simulation

ROOT: Final = Path(__file__).parents[1]
LIMIT: Final = 900.0  # s, simulated
FLEETS: Final = (
    ("paper", 4), ("paper", 8), ("office", 4), ("crossing", 8), ("doorway", 6), ("unknown", 4), ("movers", 4),
)  # fmt: skip
ERRORS: Final = ((0.02, 1.0, 1.08), (0.03, 1.5, 1.12), (0.05, 2.0, 1.25))  # m, degrees, times the exact time at most
JUMPS: Final = JumpSettings(every=30.0, distance=0.3, robots=["r1"])


class Case(NamedTuple):
    """One row."""

    name: str
    robots: int
    localisation: LocalisationSettings
    bar: float | None = None  # times the time with exact poses


def cases() -> list[Case]:
    """Return all rows."""
    rows = [
        Case(name, robots, LocalisationSettings(error=error, yaw_error_deg=yaw), bar)
        for name, robots in FLEETS
        for error, yaw, bar in ERRORS
    ]
    rows += [Case("paper", robots, LocalisationSettings(error=0.1, yaw_error_deg=3.0)) for robots in (4, 8)]
    jumping = LocalisationSettings(error=0.02, yaw_error_deg=1.0, jumps=JUMPS)
    lying = LocalisationSettings(error=0.06, yaw_error_deg=1.0, told=0.02)
    return [*rows, Case("paper", 4, jumping, 1.5), Case("paper", 4, lying)]


def run(case: Case, seed: int) -> dict[str, Any]:
    """Return what a run came to."""
    scenario = load(ROOT / "scenarios" / f"{case.name}.yaml")
    settings = msgspec.structs.replace(scenario.settings, localisation=case.localisation)
    simulation = Simulation.of(replace(scenario, settings=settings), case.robots, seed)
    kinds: Counter[str] = Counter()
    began = process_time()
    while not simulation.world.is_finished and simulation.world.time < LIMIT:
        kinds.update(event.kind for event in simulation.step().events)
    report = simulation.report(process_time() - began, LIMIT)
    return report | {"jumped": kinds["pose_jumped"], "worse": kinds["pose_worse"], "lost": kinds["pose_lost"]}


def row_of(case: Case, exact: list[dict[str, Any]], found: list[dict[str, Any]]) -> str:
    """Return a row of the table."""
    pairs = [(one["sim_time"], other["sim_time"]) for one, other in zip(found, exact, strict=True) if one["complete"]]
    ratio = mean(one for one, _ in pairs) / mean(other for _, other in pairs) if pairs else float("nan")
    touched = {kind: sum(one["contacts"][kind] for one in found) for kind in ("robot", "wall", "obstacle")}
    traffic = {key: sum(one["traffic"][key] for one in found) for key in ("overlaps", "outside")}
    tables = mean(one["steering"]["angle"]["tables"] for one in found)
    where = case.localisation
    worse, jumped, lost = (sum(one[key] for one in found) for key in ("worse", "jumped", "lost"))
    said = f"worse than told: {worse}; jumped: {jumped}; stands: {lost}" if worse or jumped or lost else "-"
    jumps = ", r1 jumps 0.3 m" if where.jumps is not None else ""
    told = f", told {100 * where.told:g} cm" if where.told is not None else ""
    return (
        f"| {case.name} {case.robots} | {100 * where.error:g} cm, {where.yaw_error_deg:g} degrees{jumps}{told} "
        f"| {len(pairs)} of {len(found)} | {touched['robot']}, {touched['wall']}, {touched['obstacle']} "
        f"| {traffic['overlaps']}; {traffic['outside']} "
        f"| {ratio:.2f}{f' ({case.bar:g})' if case.bar else ''} | {tables:.2f} | {said} |"
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--start", type=int, default=2001, help="first seed")
    parser.add_argument("--only", default="", help="part of the rows' names, such as `office`")
    options = parser.parse_args()
    seeds = range(options.start, options.start + options.seeds)
    print(f"load {load_of_machine()}, seeds {seeds[0]} to {seeds[-1]}")
    head = (
        "fleet",
        "error",
        "complete",
        "touched: robots, walls, obstacles",
        "two owners; outside",
        "time / exact (bar)",
    )
    print(f"| {' | '.join((*head, 'tables', 'said'))} |")
    print("|" + "---|" * (len(head) + 2))
    with ProcessPoolExecutor() as pool:
        exact: dict[tuple[str, int], list[dict[str, Any]]] = {}
        for case in cases():
            if options.only not in f"{case.name} {case.robots}":
                continue
            fleet = case.name, case.robots
            if fleet not in exact:
                plain = Case(*fleet, LocalisationSettings())
                exact[fleet] = list(pool.map(run, [plain] * len(seeds), seeds))
            found = list(pool.map(run, [case] * len(seeds), seeds))
            print(row_of(case, exact[fleet], found), flush=True)


if __name__ == "__main__":
    main()
