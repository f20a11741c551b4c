"""A joint plan made quicker: what comes out is a plan and no slower; small ones are compared with all that there are."""

from collections.abc import Sequence
from itertools import pairwise
from random import Random
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm.traffic.lattice.cell_map import CellMap
from swarm.traffic.mapf import planner as joint_search
from swarm.traffic.mapf.check import faults
from swarm.traffic.mapf.lacam import Search, SearchState, Steps
from swarm.traffic.mapf.lns import CHANCE, LONGER, MOST_OUT, POPS, Improving
from swarm.traffic.mapf.schedule import CORNER, duration, pace
from swarm.traffic.mapf.pibt import Configuration, Ties
from swarm.traffic.mapf.planner import Budget, JointSearch
from tests.traffic.maps import Drawn

FLOOR = Drawn("abc", "dme", "fgh")
PILLAR = Drawn("abcd", "e#.f", "gh.i")
BAY = Drawn("a..b", "##.#")
LONGEST = 4  # time steps of a plan whose ways are compared with all others

# fmt: off
JOINT = {  # a floor, starts and goals, and the time steps of the plans it is compared with
    "face to face":        (FLOOR, "de", "ed", 5),
    "crossing":            (FLOOR, "bd", "ge", 4),
    "corner to corner":    (FLOOR, "ah", "ha", 5),
    "one stands":          (FLOOR, "dm", "em", 5),
    "one side of a wall":  (PILLAR, "ac", "ca", 6),
    "only a bay":          (BAY, "ab", "ba", 7),
}
# fmt: on


class Takes(Random):
    """Chance that always takes one robot out."""

    def __init__(self, robot: int, seed: int) -> None:
        super().__init__(seed)
        self.robot = robot

    def sample(self, population: Any, k: int, **_: Any) -> list[Any]:  # noqa: ANN401, as it is there
        return [population[self.robot]]


def tables_of(cells: CellMap, goals: Configuration) -> list[Sequence[int]]:
    return [cells.distances(goal) for goal in goals]


def plan_of(cells: CellMap, starts: Configuration, goals: Configuration, seed: int) -> Steps:
    """Search for any plan, with random ties: a poor one."""
    tables = tables_of(cells, goals)
    search = Search(cells.neighbours, tables, starts, goals, ties=Ties.RANDOM, random=Random(f"plan {seed}"))
    while search.advance(1_000) is SearchState.RUNNING:
        pass
    assert search.state is SearchState.SOLVED
    return search.steps


@given(st.data(), st.integers(0, 99))
def test_a_changed_plan_still_leads_through_what_robots_visit(data: st.DataObject, seed: int) -> None:
    cells, starts, goals = crowd(data, 4)
    visits = data.draw(st.sampled_from(starts + goals))
    tables, vias = tables_of(cells, goals), [cells.distances(visits)] * len(starts)
    search = Search(cells.neighbours, tables, starts, goals, ties=Ties.RANDOM, random=Random(seed), vias=vias)
    while search.advance(1_000) is SearchState.RUNNING:
        pass
    assert search.state is SearchState.SOLVED
    improving = Improving(cells.neighbours, tables, Random(seed), vias)
    for steps in (search.steps, improving.changed(search.steps)):
        if steps is not None:
            assert_plan(cells, steps, (starts, goals))
            assert all(visits in way for way in zip(*steps, strict=True))


def changed(cells: CellMap, steps: Steps, random: Random) -> tuple[Steps | None, int]:
    improving = Improving(cells.neighbours, tables_of(cells, steps[-1]), random)
    return improving.changed(steps), improving.pops


def searched(cells: CellMap, starts: Configuration, goals: Configuration, seed: int) -> tuple[float, float]:
    """Search to the end, and return how the plan is judged."""
    tables = tables_of(cells, goals)
    search = JointSearch(cells.neighbours, tables, starts, goals, budget=Budget(), random=Random(seed))
    while (result := search.advance(1_000)) is None:
        pass
    assert result.order is not None
    assert_plan(cells, result.steps, (starts, goals))
    return duration(result.steps)


def assert_plan(cells: CellMap, steps: Steps, ends: tuple[Configuration, Configuration]) -> None:
    joined = {cell: cells.neighbours[cell] for cell in range(len(cells)) if cells.stands[cell]}
    assert faults(steps, starts=ends[0], goals=ends[1], joined=joined) == []


def crowd(data: st.DataObject, most: int) -> tuple[CellMap, Configuration, Configuration]:
    cells = data.draw(st.sampled_from((FLOOR, PILLAR))).cells
    places = [cell for cell in range(len(cells)) if cells.stands[cell]]
    count = data.draw(st.integers(1, most))
    starts, goals = (tuple(data.draw(st.permutations(places))[:count]) for _ in range(2))
    return cells, starts, goals


def every_way(cells: CellMap, old: Sequence[int], others: Sequence[Sequence[int]]) -> list[list[int]]:
    """List all ways past the others, in no more steps, that begin and end where the old one does."""
    ways = [[old[0]]]
    for time in range(1, len(old)):
        moves = {(way[time - 1], way[time]) for way in others}
        taken = {cell for _, cell in moves}
        ways = [
            [*way, cell]
            for way in ways
            for cell in (way[-1], *cells.neighbours[way[-1]])
            if cell not in taken and (cell, way[-1]) not in moves
        ]
    return [way for way in ways if way[-1] == old[-1]]


def takes(way: Sequence[int]) -> float:
    """Return when a way first is at its end for good [steps]."""
    now = arrived = 0.0
    before = way[0]
    for cell, other in pairwise(way):
        now += 1.0 if cell == other else pace(before, cell, other)
        if cell != other:
            before, arrived = cell, now
    return arrived


@given(st.data(), st.integers(0, 99))
def test_a_changed_plan_is_a_plan(data: st.DataObject, seed: int) -> None:
    """Not much longer, within its budget, without a circle of waits; and the same again for the same seed."""
    cells, starts, goals = crowd(data, 6)
    steps = plan_of(cells, starts, goals, seed)
    found, pops = changed(cells, steps, Random(seed))
    assert changed(cells, steps, Random(seed)) == (found, pops)
    assert pops <= MOST_OUT * POPS
    if found is not None:
        assert len(found) <= len(steps) + LONGER
        assert_plan(cells, found, (starts, goals))
        duration(found)  # raises where the order runs in a circle


@given(st.data(), st.integers(0, 99))
def test_an_improved_plan_is_never_slower(data: st.DataObject, seed: int) -> None:
    cells, starts, goals = crowd(data, 6)
    improved = searched(cells, starts, goals, seed)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(joint_search, "FRUITLESS", 0)
        assert improved <= searched(cells, starts, goals, seed)


@given(st.data(), st.integers(0, 99))
def test_a_new_way_is_one_of_the_quick_ones(data: st.DataObject, seed: int) -> None:
    """Of all that there are. The steps left count as whole ones though corners are cut: that much longer it may be."""
    cells, starts, goals = crowd(data, 3)
    short = plan_of(cells, starts, goals, seed)[: LONGEST + 1]
    steps = short + [short[-1]] * LONGER
    robot = data.draw(st.integers(0, len(starts) - 1))
    ways = list(zip(*steps, strict=True))
    found, _ = changed(cells, short, Takes(robot, seed))
    assert found is not None
    way = [at[robot] for at in found] + [steps[-1][robot]] * (len(steps) - len(found))
    every = every_way(cells, ways[robot], [*ways[:robot], *ways[robot + 1 :]])
    assert way in every
    assert takes(way) <= (min(map(takes, every)) + CHANCE * len(steps)) / CORNER


@pytest.mark.parametrize(("drawn", "starts", "goals", "longest"), JOINT.values(), ids=JOINT)
def test_two_come_within_a_step_of_the_best_plan_there_is(drawn: Drawn, starts: str, goals: str, longest: int) -> None:
    """All pairs of ways are tried."""
    cells, ends = drawn.cells, (drawn.at(starts), drawn.at(goals))
    mine, theirs = ([start] * longest + [goal] for start, goal in zip(*ends, strict=True))
    pairs = ((one, other) for one in every_way(cells, mine, []) for other in every_way(cells, theirs, [one]))
    best = min(duration(list(zip(*pair, strict=True))) for pair in pairs)
    found = searched(cells, *ends, 1)
    assert best <= (found[0] + 1e-9, found[1])
    assert found[0] <= best[0] + 1.0


def test_a_search_for_a_way_ends_after_1000_expansions() -> None:
    """The goal is taken for long, and the floor is wide: there are many ways to wait."""
    cells = Drawn(*["." * 9] * 9).cells
    start, goal, beside = 40, 41, 42
    steps: Steps = [*((start, goal) for _ in range(20)), (start, beside), (goal, beside)]
    assert changed(cells, steps, Takes(0, 1)) == (None, 1000)
