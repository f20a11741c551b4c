"""Traffic: whole fleets under the rule of holds, in physics, with the paper's controller.

There is one row per case, over ``--seeds`` seeds. The world's own watch, which knows no planner, judges every run. The
columns are:

- complete runs (with a dead robot: runs in which all others arrived whose target could still be reached);
- contacts;
- overlapping reservations, and bodies outside theirs (in brackets: overlaps with a suspended or killed robot);
- time, also as a multiple of the longest shortest way of a robot at cruising speed;
- driven length over shortest length (on the MAPF maps: on a 4-connected grid);
- share of the turned angle that the fuzzy tables steered;
- share of the time spent waiting;
- joint plans, the time from the need of one to following it, and the search time (median and longest).

The cases on MAPF maps need the benchmark data beside the project; without it they are left out, and the page states it.
Several runs go in parallel, one per core.
"""

import argparse
import os
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from functools import cache
from itertools import pairwise
from pathlib import Path
from statistics import median
from time import process_time
from typing import Any, Final, NamedTuple

import msgspec

from benchmarks.measure import DATA, machine, table
from swarm.geometry import Pose
from swarm.scenario.benchmark import from_benchmark
from swarm.scenario.load import Scenario, load
from swarm.scenario.prepare import settle_lattice
from swarm.traffic.joint import problem as question
from swarm.traffic.lattice.cell_map import CellMap
from swarm.traffic.lattice.distances import FAR
from swarm.traffic.lattice.placement import cells_of
from swarm.traffic.mapf.planner import JointSearch, SearchResult
from world.faults import Faults
from world.simulate import Simulation
from world.world import World

ROOT: Final = Path(__file__).parents[1]
CIRCLES: Final = {8: 14.0, 16: 19.0, 32: 29.0}  # robots: diameter [m]
HARD: Final = ("tree", "corners", "tunnel", "string")
MAPS: Final = ("random-32-32-20", "room-32-32-4", "maze-32-32-4", "empty-16-16", "warehouse-10-20-10-2-1")
SHIFT: Final = 0.1  # m along x
ROWS: Final = 50  # rows of a benchmark's file that one seed uses
SCENARIOS: Final = (
    ("corridor", 2),
    ("l_corner", 2),
    ("doorway", 8),
    ("doorway", 16),
    ("crossing", 8),
    ("crossing", 16),
)
LIMIT: Final = 1800.0  # s, simulated

Make = Callable[[], Scenario]


class Case(NamedTuple):
    """One row of the table."""

    name: str
    scenario: str  # a key of ``make``
    robots: int
    radio: dict[str, Any] = {}  # noqa: RUF012  # read only
    faults: Faults = Faults()
    share: float = 1.0  # of the requested seeds; slow rows run on fewer


HARSH: Final = {"range": 5.0, "loss": 0.3}
HELD_UP: Final = Faults(held_up=20.0)
SUSPENDED: Final = Faults(suspended=20.0)
LATE: Final = Faults(late=0.2)


def cases() -> Iterator[Case]:
    """Yield the rows."""
    for robots in (1, 2, 4, 8, 12):
        yield Case(f"paper {robots}", "paper", robots)
    for robots in CIRCLES:
        yield Case(f"circle {robots}", f"circle {robots}", robots, share=0.5)
    for name, robots in SCENARIOS:
        yield Case(f"{name} {robots}", name, robots)
    yield Case("paper 4: answers 0.2 s late", "paper", 4, faults=LATE)
    yield Case("doorway 8: answers 0.2 s late", "doorway", 8, faults=LATE)
    yield from drills(("corridor", 2), ("doorway", 8))
    yield Case("doorway 8: leader killed", "doorway", 8, faults=Faults(kill_leader_at=4.0))
    if not DATA.is_dir():
        return
    for name in HARD:
        yield Case(name, name, len(scenario_of(name).settings.own_targets))
    yield from drills(*((name, len(scenario_of(name).settings.own_targets)) for name in HARD))
    for name in HARD:
        robots = len(scenario_of(name).settings.own_targets)
        yield Case(f"{name}: leader killed", name, robots, faults=Faults(kill_leader_at=4.0))
    for name in MAPS:
        for robots in (16, 32, 50):
            yield Case(f"{name} {robots}", name, robots, share=0.1 if robots > 16 else 0.25)
    yield from drills(("random-32-32-20", 16))
    yield from drills(("random-32-32-20", 32), share=0.15)
    yield Case("random-32-32-20 16: leader killed", "random-32-32-20", 16, faults=Faults(kill_leader_at=4.0), share=0.5)


def drills(*of: tuple[str, int], share: float = 1.0) -> Iterator[Case]:
    """Yield the rows of scenarios with a bad radio, and with robots that are held up or suspended."""
    for name, robots in of:
        for text, radio, faults in (
            ("8 m", {"range": 8.0}, Faults()),
            ("8 m, 30 % loss, held up", {"range": 8.0, "loss": 0.3}, HELD_UP),
            ("5 m", {"range": 5.0}, Faults()),
            ("5 m, 30 % loss", HARSH, Faults()),
            ("5 m, 30 % loss, held up", HARSH, HELD_UP),
            ("5 m, sight, 30 % loss, held up", HARSH | {"line_of_sight": True}, HELD_UP),
            ("5 m, 30 % loss, suspended", HARSH, SUSPENDED),
        ):
            yield Case(f"{name} {robots}: {text}", name, robots, radio, faults, share)


@cache
def scenario_of(name: str) -> Scenario:
    """Return the scenario that a row names."""
    if name.startswith("circle"):
        diameter = CIRCLES[int(name.split()[1])]
        return changed(load(ROOT / "scenarios" / "circle.yaml"), start={"circle": (18.0, 18.0, diameter)})
    if name in HARD:
        return from_benchmark(DATA / "hard" / f"{name}.map", DATA / "hard" / f"{name}.scen", None)
    if name in MAPS:
        return from_benchmark(DATA / f"{name}.map", DATA / f"{name}-random-1.scen", None)
    return load(ROOT / "scenarios" / f"{name}.yaml")


def rows_for(scenario: Scenario, seed: int) -> Scenario:
    """Return the scenario with the seed's own ``ROWS`` rows of the benchmark's file, cyclically.

    A circle draws no chance: each seed moves it by ``SHIFT`` on the lattice, so that each is a run of its own.
    """
    settings = scenario.settings
    if settings.start.circle is not None:
        x, y, diameter = settings.start.circle
        return changed(scenario, start={"circle": (x + (seed - 1) * SHIFT, y, diameter)})
    blocks = len(settings.own_targets) // ROWS
    if scenario.settings.name not in MAPS or blocks < 1:
        return scenario
    rows = slice(first := (seed - 1) % blocks * ROWS, first + ROWS)
    assert settings.start.poses is not None
    start = msgspec.structs.replace(settings.start, poses=settings.start.poses[rows])
    chosen = msgspec.structs.replace(settings, start=start, own_targets=settings.own_targets[rows])
    return Scenario(chosen, scenario.map, scenario.profile)


def changed(scenario: Scenario, **sections: dict[str, Any]) -> Scenario:
    """Return the scenario with some fields of its sections changed."""
    settings = scenario.settings
    for name, fields in sections.items():
        section = msgspec.structs.replace(getattr(settings, name), **fields)
        settings = msgspec.structs.replace(settings, **{name: section})
    return settle_lattice(Scenario(settings, scenario.map, scenario.profile))


class Ran(NamedTuple):
    """The figures of one run."""

    complete: bool
    contacts: int
    faults: int  # overlaps, and bodies outside their reservations, of robots that were never suspended or killed
    others: int  # overlaps with a robot that was
    time: float  # s
    ratio: float  # time over that of the longest shortest way at cruising speed
    length: float  # driven length over shortest length
    tables: float  # share of the turned angle that the tables steered
    waiting: float  # share of the robots' time
    plans: int
    settling: list[float]  # s, from the need of a joint plan to following one
    searches: list[float]  # s of processor time, of each search for a joint plan
    wall: float  # s


def run(case: Case, seed: int) -> Ran:
    """Run one case with one seed to its end."""
    scenario = changed(rows_for(scenario_of(case.scenario), seed), radio=case.radio)
    simulation = Simulation.of(scenario, case.robots, seed, case.faults)
    world, settings = simulation.world, scenario.settings
    settling = Settling(simulation)
    searches: list[float] = []
    question.JointSearch = timed(searches)  # type: ignore[attr-defined]
    cells = cells_of(scenario.map, settings)

    def over(world: World) -> bool:
        return world.is_finished or (bool(simulation.drill.dead) and not remaining(simulation, cells))

    report = simulation.run(limit=LIMIT, watch=settling.look, over=over)
    marked = simulation.drill.struck
    faults = world.measures.reservations.state.watch.faults
    others = sum(fault.kind == "overlap" and not marked.isdisjoint(fault.robots) for fault in faults)
    per_robot = report["per_robot"].values()
    bounds = [bound(cells, start, world.tasks.missions.stops(number)) for number, start in enumerate(world.starts)]
    shortest = bounds if scenario.map.resolution == cells.side else [one["shortest_length"] for one in per_robot]
    return Ran(
        complete=not remaining(simulation, cells),
        contacts=sum(report["contacts"].values()),
        faults=len(faults) - others - sum(fault.kind == "contact" for fault in faults),
        others=others,
        time=report["sim_time"],
        ratio=report["sim_time"] * 1.5 * settings.robot.speed_scale / max(shortest),
        length=sum(one["path_length"] for one in per_robot) / sum(shortest),
        tables=report["steering"]["angle"]["tables"],
        waiting=sum(one["waiting"] for one in per_robot) / (report["sim_time"] * case.robots),
        plans=report["traffic"]["joint_plans"],
        settling=settling.times,
        searches=searches,
        wall=report["wall_time"],
    )


def timed(into: list[float]) -> type[JointSearch]:
    """Return a search class that appends the processor time of each search to ``into``."""

    class Timed(JointSearch):
        begun = False

        def advance(self, expansions: int) -> SearchResult | None:
            if not self.begun:
                self.begun = True
                into.append(0.0)
            began = process_time()
            result = super().advance(expansions)
            into[-1] += process_time() - began
            return result

    return Timed


def bound(cells: CellMap, start: Pose, stops: tuple[tuple[float, float], ...]) -> float:
    """Return the length [m] of the shortest way over joined cells."""
    at = [cells.cell_of(*point[:2]) for point in (start, *stops)]
    return cells.side * sum(cells.distances(b)[a] for a, b in pairwise(at))


def remaining(simulation: Simulation, cells: CellMap) -> list[str]:
    """Return the living robots that missed a stop although a way past the dead robots leads there."""
    world = simulation.world
    pose = dict(zip(world.robots, world.poses(), strict=True))
    dead = simulation.drill.dead
    shut = {cell for name in dead for cell in cells.cells_under_disc(*pose[name][:2], 0.2)}
    lacking = []
    for number, (name, row) in enumerate(zip(world.robots, world.tasks.missions.reached_at, strict=True)):
        if name in dead or all(time is not None for time in row):
            continue
        here = cells.cell_of(*pose[name][:2])
        stops = zip(world.tasks.missions.stops(number), row, strict=True)
        ends = [cells.cell_of(*stop) for stop, time in stops if time is None]
        if all(end not in shut and cells.distances(end, shut)[here] < FAR for end in ends):
            lacking.append(name)
    return lacking


class Settling:
    """The times that robots wait from the need of a joint plan until they follow one, read from broadcasts."""

    def __init__(self, simulation: Simulation) -> None:
        self.times: list[float] = []
        self._simulation = simulation
        self._asked: dict[str, tuple[float, object]] = {}

    def look(self, world: World) -> None:
        """Read the broadcasts of one tick."""
        for (name, _), broadcast in self._simulation.broadcasts.items():
            if broadcast.traffic is None:
                continue
            own = broadcast.traffic.own
            began = self._asked.get(name)
            if began is not None and own.epoch is not None and own.epoch != began[1]:
                self.times.append(world.time - began[0])
                del self._asked[name]
            elif began is None and own.need is not None:
                self._asked[name] = (world.time, own.epoch)
            elif began is not None and own.need is None and own.frozen is None and own.collect is None:
                del self._asked[name]  # the need ended without a plan


def row(case: Case, runs: list[Ran]) -> tuple[str, ...]:
    """Return the row of a case."""
    settling = [time for one in runs for time in one.settling]
    searches = [time for one in runs for time in one.searches]
    return (
        case.name,
        f"{sum(one.complete for one in runs)} of {len(runs)}",
        str(sum(one.contacts for one in runs)),
        str(sum(one.faults for one in runs)) + (f" ({n})" if (n := sum(one.others for one in runs)) else ""),
        f"{median(one.time for one in runs):.0f}",
        f"{median(one.ratio for one in runs):.2f}",
        f"{max(one.ratio for one in runs):.2f}",
        f"{median(one.length for one in runs):.2f}",
        f"{median(one.tables for one in runs):.2f}",
        f"{median(one.waiting for one in runs):.2f}",
        f"{median(one.plans for one in runs):.0f}",
        f"{median(settling):.1f}, {max(settling):.0f}" if settling else "",
        f"{1000 * median(searches):.0f}, {1000 * max(searches):.0f}" if searches else "",
        f"{median(one.wall for one in runs):.0f}",
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--only", default="", help="only cases whose name begins with this")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    given = parser.parse_args()
    head = "case|complete|contacts|overlaps, outside|time [s]"
    head += "|/ shortest at cruise|worst|driven / shortest|angle by the tables|waiting|joint plans"
    head += "|settled in [s], longest|search [ms], longest|wall [s]"
    rows: list[tuple[str, ...]] = [tuple(head.split("|"))]
    chosen = [case for case in cases() if case.name.startswith(given.only)]
    with ProcessPoolExecutor(given.jobs) as pool:
        work = [
            (case, [pool.submit(run, case, seed) for seed in range(1, 1 + max(1, round(case.share * given.seeds)))])
            for case in chosen
        ]
        for case, futures in work:
            rows.append(row(case, [future.result() for future in futures]))
            print(" | ".join(rows[-1]), file=sys.stderr, flush=True)  # progress, not on the page
    print(f"\n{machine()}\n\n{table(rows)}")
    if not DATA.is_dir():
        print("\nThe MAPF maps are not beside the project: their cases are left out.")


if __name__ == "__main__":
    main()
