"""Lifelong: a pool that never runs empty, and what driving among others costs: ``python -m benchmarks.lifelong``.

A clerk keeps ``WAITING`` random targets a robot in the pool, from a seed, for ten simulated minutes. The ratio is the
errands a minute over what they could be with no other robot there. That is measured: each robot drives the very errands
that it has done, in their order, alone on the floor, from the same start, by the same orders of the pool. The sum of
these times over the time that the robots had is the ratio; an errand that is under way at the end counts for neither.

The maps are the public benchmark maps beside the project; without them nothing is measured, and the output says so.
"""

import argparse
import random
from collections.abc import Iterator, Sequence
from time import perf_counter
from typing import Final, NamedTuple

import msgspec

from benchmarks.measure import DATA, machine, printed
from swarm.geometry import Pose
from swarm.maps.occupancy import Point
from swarm.messages import PoolTargets
from swarm.scenario.benchmark import from_benchmark
from swarm.scenario.load import Scenario
from swarm.scenario.prepare import settle_lattice
from swarm.traffic.lattice.distances import FAR
from swarm.traffic.lattice.placement import cells_of
from world.simulate import Simulation

CASES: Final = (("maze-32-32-4", 12), ("random-32-32-20", 24))
MINUTES: Final = 10.0
WAITING: Final = 1  # errands that wait, for each robot
HEAD: Final = (
    "map, robots", "errands", "a minute", "alone", "ratio", "contacts", "stalled", "waiting", "oldest [s]", "wall [s]",
)  # fmt: skip


class Done(NamedTuple):
    """An errand that a robot has done."""

    at: Point
    taken: float  # s
    ended: float  # s


def scenario_of(name: str, pool: Sequence[Point], poses: Sequence[Pose] | None = None) -> Scenario:
    """Return the scenario of a map with nothing to do but the pool."""
    given = from_benchmark(DATA / f"{name}.map", DATA / f"{name}-random-1.scen", None)
    start = given.settings.start
    if poses is not None:
        start = msgspec.structs.replace(start, poses=list(poses))
    settings = msgspec.structs.replace(
        given.settings, own_targets=[], pool=list(pool), return_home=True, patrol=False, start=start
    )
    return settle_lattice(Scenario(settings, given.map, given.profile))


def places(scenario: Scenario, start: Point, seed: int) -> Iterator[Point]:
    """Yield random middles of cells that a robot at ``start`` [m] can reach."""
    cells, draw = cells_of(scenario.map, scenario.settings), random.Random(seed)
    table = cells.distances(cells.nearest_standable(*start))
    able = [cell for cell, steps in enumerate(table) if steps < FAR and cells.stands[cell]]
    while True:
        yield cells.centre(draw.choice(able))


class Clerk:
    """The clerk of one run: it keeps the pool filled, and records who has done what."""

    def __init__(self, simulation: Simulation, targets: Iterator[Point], waiting: int) -> None:
        self.done: list[list[Done]] = [[] for _ in simulation.robots]
        self.oldest = 0.0  # s that an errand has waited, at most
        self._simulation, self._targets, self._waiting = simulation, targets, waiting
        self._taken: dict[str, float] = {}
        self._told = 0

    def look(self) -> None:
        """Record what has been done in a tick, and fill the pool."""
        world = self._simulation.world
        pool = world.tasks.pool
        for errand in pool.taken_errands:
            if errand.name not in self._taken:
                self._taken[errand.name] = world.time
                self.oldest = max(self.oldest, world.time - errand.given)
        while self._told < pool.done:
            errand = list(pool.closed.values())[self._told - pool.done]
            assert errand.robot is not None
            assert errand.ended is not None
            self.done[errand.robot].append(Done(errand.at, self._taken.pop(errand.name, errand.ended), errand.ended))
            self._told += 1
        lacking = self._waiting - len(pool.waiting)
        if lacking > 0:
            world.put_in(PoolTargets(id=f"clerk-{world.tick}", targets=[next(self._targets) for _ in range(lacking)]))


def together(name: str, robots: int, seed: int, seconds: float) -> tuple[Simulation, Clerk]:
    """Run a fleet with its clerk."""
    scenario = scenario_of(name, [])
    simulation = Simulation.of(scenario, robots, seed)
    clerk = Clerk(simulation, places(simulation.scenario, simulation.world.starts[0][:2], seed), WAITING * robots)
    while simulation.world.time < seconds:
        simulation.step()
        clerk.look()
    return simulation, clerk


def alone(name: str, start: Pose, errands: Sequence[Done], seed: int, limit: float) -> float:
    """Return the time [s] that one robot needs for errands, one after the other, with nobody else there."""
    simulation = Simulation.of(scenario_of(name, [], [start]), 1, seed)
    world = simulation.world
    for number, errand in enumerate(errands):
        world.put_in(PoolTargets(id=f"alone-{number}", targets=[errand.at]))
        while world.tasks.pool.open:
            simulation.step()
            if world.time > limit:
                raise RuntimeError(f"{name}: errand {number} at {errand.at} alone took more than {limit:g} s")
    return world.time


def measure(name: str, robots: int, seed: int, minutes: float) -> list[str]:
    """Return the cells of a row."""
    began, seconds = perf_counter(), 60.0 * minutes
    simulation, clerk = together(name, robots, seed, seconds)
    world = simulation.world
    report = simulation.report(perf_counter() - began, seconds)
    had = needed = 0.0
    for start, errands in zip(world.starts, clerk.done, strict=True):
        if errands:
            had += errands[-1].ended
            needed += alone(name, start, errands, seed, 2 * seconds)
        else:
            had += seconds  # it has done nothing in all the time
    count = sum(map(len, clerk.done))
    return [
        str(count),
        f"{count / minutes:.1f}",
        f"{count / minutes * had / needed:.1f}" if needed else "",
        f"{needed / had:.2f}",
        str(sum(report["contacts"].values())),
        str(report["traffic"]["stalled"]),
        f"{sum(world.measures.recorder.counts.waiting) / (robots * seconds):.0%}",
        f"{clerk.oldest:.0f}",
        f"{perf_counter() - began:.0f}",
    ]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=MINUTES, help="simulated minutes of each run")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="only maps whose name begins with this")
    given = parser.parse_args()
    print(machine())
    if not DATA.is_dir():
        print("\nThe MAPF maps are not beside the project: nothing is measured.")
        return
    cases = [case for case in CASES if case[0].startswith(given.only)]
    rows = [(f"{name}, {robots}", lambda name=name, robots=robots: measure(name, robots, given.seed, given.minutes))  # type: ignore[misc]
            for name, robots in cases]  # fmt: skip
    printed(HEAD, rows)


if __name__ == "__main__":
    main()
