"""Joint plans on public maps: ``python -m benchmarks.traffic_planner [SEEDS]``.

For each map and number of robots, the table has the time [ms] to the first plan and to the best of several starts, and
how far both are from the lower bounds (each robot's own shortest way). A checker that shares no code with the planner
checks every plan. ``steps`` is the makespan. ``order`` is the time of the last arrival, in steps, turns included, if
each robot moves as soon as the order of entries allows it.
"""

import sys
from pathlib import Path
from random import Random
from statistics import median
from time import perf_counter
from typing import NamedTuple

from benchmarks.measure import DATA, machine, table
from swarm.maps.movingai import load_movingai, load_scen
from swarm.traffic.lattice.cell_map import CellMap
from swarm.traffic.mapf.check import list_plan_faults
from swarm.traffic.mapf.planner import Budget, JointSearch, SearchOutcome
from swarm.traffic.mapf.schedule import makespan_and_flowtime
from swarm.traffic.settings import TrafficConstants

SETTINGS = TrafficConstants()
HARD = ("tree", "corners", "tunnel", "string")
LARGE = ("random-32-32-20", "room-32-32-4", "maze-32-32-4", "empty-16-16", "warehouse-10-20-10-2-1")
ROBOTS = (16, 32, 50, 100)
SIDE = 1.2  # m


class Figures(NamedTuple):
    """The figures of one search."""

    milliseconds: float
    soc: float  # sum of costs over its lower bound
    moves: float  # moves over their lower bound
    steps: float  # makespan over its lower bound
    order: float  # steps
    looks: int  # control steps that the search took


def load(map_path: Path, scen_path: Path, robots: int | None) -> tuple[CellMap, tuple[int, ...], tuple[int, ...]]:
    """Return the cells, starts and goals of an instance; one cell of the map is one cell of traffic."""
    occupancy = load_movingai(map_path, SIDE)
    rows = load_scen(scen_path, occupancy)[:robots]
    cells = CellMap(occupancy, side=SIDE, radius=0.23)
    starts = tuple(row.start[0] * cells.columns + row.start[1] for row in rows)
    goals = tuple(row.goal[0] * cells.columns + row.goal[1] for row in rows)
    if robots is not None and len(rows) != robots:
        raise SystemExit(f"{scen_path}: expected at least {robots} rows, got {len(rows)}")
    return cells, starts, goals


def measure(cells: CellMap, starts: tuple[int, ...], goals: tuple[int, ...], budget: Budget, seed: int) -> Figures:
    """Search once, check the plan, and return the figures."""
    tables = [cells.distances(goal) for goal in goals]
    bounds = [table[start] for table, start in zip(tables, starts, strict=True)]
    began = perf_counter()
    search = JointSearch(cells.neighbours, tables, starts, goals, budget=budget, random=Random(seed))
    result, looks = None, 0
    while result is None:
        result = search.advance(max(1, SETTINGS.robot_openings // len(starts)))
        looks += 1
    milliseconds = 1e3 * (perf_counter() - began)
    if result.outcome is not SearchOutcome.SOLVED or result.order is None:
        raise SystemExit(f"not solved: {result.outcome}")
    joined = {cell: cells.neighbours[cell] for cell in range(len(cells)) if cells.stands[cell]}
    wrong = list_plan_faults(result.steps, starts=starts, goals=goals, joined=joined)
    if wrong:
        raise SystemExit("\n".join(wrong))
    costs = []
    for robot, goal in enumerate(goals):
        cost = len(result.steps) - 1
        while cost > 0 and result.steps[cost - 1][robot] == goal:
            cost -= 1
        costs.append(cost)
    moves = sum(len(way) - 1 for way in result.order.ways)
    return Figures(
        milliseconds,
        sum(costs) / sum(bounds),
        moves / sum(bounds),
        (len(result.steps) - 1) / max(bounds),
        makespan_and_flowtime(result.steps)[0],
        looks,
    )


def row(name: str, robots: int | None, seeds: int) -> list[str]:
    """Return one line of the table: medians over the seeds, and the worst time."""
    folder = DATA / "hard" if name in HARD else DATA
    scen = folder / (f"{name}.scen" if name in HARD else f"{name}-random-1.scen")
    cells, starts, goals = load(folder / f"{name}.map", scen, robots)
    began = perf_counter()
    for goal in goals:
        cells.distances(goal)
    tables = 1e3 * (perf_counter() - began)
    with_restarts = Budget(starts=SETTINGS.starts, enough=SETTINGS.enough // len(starts))
    first = [measure(cells, starts, goals, Budget(starts=1), seed) for seed in range(seeds)]
    kept = [measure(cells, starts, goals, with_restarts, seed) for seed in range(seeds)]
    texts = [f"{name}, {len(starts)}", f"{tables:.0f}"]
    for figures in (first, kept):
        times = [figure.milliseconds for figure in figures]
        texts.append(f"{median(times):.0f} / {max(times):.0f}")
        texts += [f"{median(figure[k] for figure in figures):.2f}" for k in (1, 2, 3)]
        texts.append(f"{median(figure.order for figure in figures):.0f}")
    return [*texts, f"{median(figure.looks for figure in kept):.0f}"]


def main() -> None:
    """Print the table."""
    if not DATA.exists():
        raise SystemExit(f"{DATA}: the public benchmark maps are not there")
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    head = ["map, robots", "BFS ms", "first ms", "SOC/lb", "moves/lb", "steps/lb", "order"]
    lines = [[*head, "kept ms", "SOC/lb", "moves/lb", "steps/lb", "order", "ticks"]]
    lines += [row(name, None, seeds) for name in HARD]
    lines += [row(name, robots, seeds) for name in LARGE for robots in ROBOTS]
    print(machine())
    print(table(lines))


if __name__ == "__main__":
    main()
