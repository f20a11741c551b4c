"""A joint plan made quicker: what comes out is a plan and no slower; small ones are compared with all that there are."""

from collections.abc import Sequence
from itertools import pairwise
from math import inf
from random import Random
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm.traffic.lattice.cell_map import CellMap
from swarm.traffic.mapf import planner as joint_search
from swarm.traffic.mapf.check import list_plan_faults
from swarm.traffic.mapf.lacam import LacamSearch, SearchState, Steps
from swarm.traffic.mapf.lns import MOST_OUT, PlanImprover
from swarm.traffic.mapf.pibt import Configuration, TieBreak
from swarm.traffic.mapf.planner import Budget, JointSearch
from swarm.traffic.mapf.schedule import (
    ARRIVES,
    CHANCE,
    CORNER,
    ON_THE_SPOT,
    POPS,
    WIDER,
    Schedule,
    makespan_and_flowtime,
    move_time,
    schedule_plan,
)
from tests.traffic.maps import Drawn

FLOOR = Drawn("abc", "dme", "fgh")
PILLAR = Drawn("abcd", "e#.f", "gh.i")
BAY = Drawn("a..b", "##.#")
LONGEST = 5  # moves of the ways that a new one is compared with
CORNERS = st.sampled_from((CORNER, ON_THE_SPOT))

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
    search = LacamSearch(cells.neighbours, tables, starts, goals, ties=TieBreak.RANDOM, random=Random(f"plan {seed}"))
    while search.advance(1_000) is SearchState.RUNNING:
        pass
    assert search.state is SearchState.SOLVED
    return search.steps


@given(st.data(), st.integers(0, 99))
def test_a_changed_plan_still_leads_through_what_robots_visit(data: st.DataObject, seed: int) -> None:
    cells, starts, goals = crowd(data, 4)
    visits = data.draw(st.sampled_from(starts + goals))
    tables, vias = tables_of(cells, goals), [cells.distances(visits)] * len(starts)
    search = LacamSearch(cells.neighbours, tables, starts, goals, ties=TieBreak.RANDOM, random=Random(seed), vias=vias)
    while search.advance(1_000) is SearchState.RUNNING:
        pass
    assert search.state is SearchState.SOLVED
    found = PlanImprover(cells.neighbours, tables, Random(seed), vias).replan_robots(schedule_plan(search.steps))
    for steps in (search.steps, found and found.steps()):
        if steps is not None:
            assert_plan(cells, steps, (starts, goals))
            assert all(visits in way for way in zip(*steps, strict=True))


def changed(cells: CellMap, steps: Steps, random: Random, corner: float = CORNER) -> tuple[Schedule | None, int]:
    improving = PlanImprover(cells.neighbours, tables_of(cells, steps[-1]), random)
    return improving.replan_robots(schedule_plan(steps, corner)), improving.pops


def way_of(plan: Schedule, robot: int) -> list[int]:
    return [int(cell) for cell in plan.ways[robot, : plan.lengths[robot]]]


def occupied(plan: Schedule, robot: int) -> list[tuple[int, float, float]]:
    """List the cells of a robot, each with the time from which and to which nobody else may be there."""
    way, (begins, arrives) = way_of(plan, robot), plan.times[:, robot].tolist()
    ends = [*arrives[1 : len(way)], inf]
    return list(zip(way, begins[: len(way)], ends, strict=True))


def searched(cells: CellMap, starts: Configuration, goals: Configuration, seed: int) -> tuple[float, float]:
    """Search to the end, and return how the plan is judged."""
    tables = tables_of(cells, goals)
    search = JointSearch(cells.neighbours, tables, starts, goals, budget=Budget(), random=Random(seed))
    while (result := search.advance(1_000)) is None:
        pass
    assert result.order is not None
    assert_plan(cells, result.steps, (starts, goals))
    return makespan_and_flowtime(result.steps)


def assert_plan(cells: CellMap, steps: Steps, ends: tuple[Configuration, Configuration]) -> None:
    joined = {cell: cells.neighbours[cell] for cell in range(len(cells)) if cells.stands[cell]}
    assert list_plan_faults(steps, starts=ends[0], goals=ends[1], joined=joined) == []


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


def quickest(
    cells: CellMap, ends: tuple[int, int], taken: Sequence[tuple[int, float, float]], most: int, corner: float
) -> float:
    """Return the first arrival for good, of all ways of at most so many moves past what is taken."""
    last = max((end for cell, _, end in taken if cell == ends[1]), default=0.0)

    def arrival(way: list[int], now: float) -> float:
        best = now if way[-1] == ends[1] and now >= last else inf
        if len(way) > most:
            return best
        until = min((begin for cell, begin, _ in taken if cell == way[-1] and begin >= now), default=inf)
        for other in cells.neighbours[way[-1]]:
            lasts = move_time(way[-2] if len(way) > 1 else way[-1], way[-1], other, corner)
            begins = {now} | {end for cell, _, end in taken if cell == other and end >= now}
            for begin in sorted(begins):
                arrives = begin + lasts
                free = all(end <= begin or arrives < start for cell, start, end in taken if cell == other)
                if free and arrives <= until:
                    best = min(best, arrival([*way, other], arrives))
        return best

    return arrival([ends[0]], 0.0)


@given(st.data(), st.integers(0, 99), CORNERS)
def test_a_changed_plan_is_a_plan(data: st.DataObject, seed: int, corner: float) -> None:
    """Within its width and budget, judged as it is timed; and the same again for the same seed."""
    cells, starts, goals = crowd(data, 6)
    before = plan_of(cells, starts, goals, seed)
    found, pops = changed(cells, before, Random(seed), corner)
    again, pops_again = changed(cells, before, Random(seed), corner)
    assert pops == pops_again <= MOST_OUT * POPS
    assert (found is None) == (again is None)
    if found is not None and again is not None:
        steps = found.steps()
        assert steps == again.steps()
        assert max(found.lengths) <= WIDER * max(schedule_plan(before).lengths)
        assert_plan(cells, steps, (starts, goals))
        assert makespan_and_flowtime(steps, corner) == pytest.approx((found.last, found.total))


@given(st.data(), st.integers(0, 99))
def test_an_improved_plan_is_never_slower(data: st.DataObject, seed: int) -> None:
    cells, starts, goals = crowd(data, 6)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(joint_search, "LONG", inf)  # no plan for one robot instead of all
        improved = searched(cells, starts, goals, seed)
        patch.setattr(joint_search, "FRUITLESS", 0)
        assert improved <= searched(cells, starts, goals, seed)


@given(st.data(), st.integers(0, 99), CORNERS)
def test_a_new_way_is_one_of_the_quick_ones(data: st.DataObject, seed: int, corner: float) -> None:
    """The steps left count as whole ones though corners are cut: that much longer than all that there are it may be."""
    cells, starts, goals = crowd(data, 3)
    before = schedule_plan(plan_of(cells, starts, goals, seed), corner)
    robot = data.draw(st.integers(0, len(starts) - 1))
    found, _ = changed(cells, before.steps(), Takes(robot, seed), corner)
    assert found is not None
    taken = [spot for other in range(len(starts)) if other != robot for spot in occupied(before, other)]
    best = quickest(cells, (starts[robot], goals[robot]), taken, LONGEST, corner)
    arrived = found.times[ARRIVES, robot, found.lengths[robot] - 1]
    assert arrived <= (best + CHANCE * len(cells)) / min(1.0, corner)


@given(st.data(), st.integers(0, 99))
def test_nobody_drives_into_a_cell_before_the_one_there_has_arrived_in_its_next(data: st.DataObject, seed: int) -> None:
    cells, starts, goals = crowd(data, 6)
    plan, _ = changed(cells, plan_of(cells, starts, goals, seed), Random(seed))
    for spots in by_cell(plan).values() if plan else ():
        spots.sort(key=lambda spot: spot[1])
        assert all(one[2] <= other[1] + 1e-9 for one, other in pairwise(spots)), spots


def by_cell(plan: Schedule) -> dict[int, list[tuple[int, float, float]]]:
    cells: dict[int, list[tuple[int, float, float]]] = {}
    for robot in range(len(plan.ways)):
        for spot in occupied(plan, robot):
            cells.setdefault(spot[0], []).append(spot)
    return cells


@pytest.mark.parametrize(("drawn", "starts", "goals", "longest"), JOINT.values(), ids=JOINT)
def test_two_come_within_a_step_of_the_best_plan_there_is(drawn: Drawn, starts: str, goals: str, longest: int) -> None:
    """All pairs of ways are tried."""
    cells, ends = drawn.cells, (drawn.at(starts), drawn.at(goals))
    mine, theirs = ([start] * longest + [goal] for start, goal in zip(*ends, strict=True))
    pairs = ((one, other) for one in every_way(cells, mine, []) for other in every_way(cells, theirs, [one]))
    best = min(makespan_and_flowtime(list(zip(*pair, strict=True))) for pair in pairs)
    found = searched(cells, *ends, 1)
    assert best <= (found[0] + 1e-9, found[1])
    assert found[0] <= best[0] + 1.0


def test_a_search_for_a_way_ends_after_its_expansions() -> None:
    """The goal is taken for long, and the floor is wide: there are many cells to reach before it is free."""
    cells = Drawn(*["." * 60] * 60).cells
    goal = 1830
    other = [goal + 1, goal] * 100 + [goal + 1] * 2
    steps: Steps = list(zip([goal - 1] * 201 + [goal], other, strict=True))
    assert changed(cells, steps, Takes(0, 1)) == (None, POPS)
