"""The same question has the same answer on every machine, and after every change that is only for speed.

The figures are those of the searches as they are. Whoever changes a choice on purpose takes the new ones over.
"""

from random import Random
from zlib import crc32

import pytest

from swarm.traffic.mapf.best_first import BestFirst
from swarm.traffic.mapf.lacam import LacamSearch, SearchState, remove_detours
from swarm.traffic.mapf.lns import PlanImprover
from swarm.traffic.mapf.pibt import TieBreak
from swarm.traffic.mapf.planner import Budget, JointSearch
from swarm.traffic.mapf.schedule import schedule_plan
from tests.traffic.maps import BAY, DOOR, RING, TREE, Drawn

CROWD = Drawn("abcd", "efgh", "ijkl")
ROOMS = Drawn("a.#.b", "...c.", "d.#.e")
FULL = Drawn("abc.")

CASES = {
    "bay": (BAY, "abc", "bac"),
    "tree": (TREE, "abcd", "badc"),
    "ring": (RING, "aceg", "gace"),
    "door": (DOOR, "abcdefgh", "hgfedcba"),
    "crowd": (CROWD, "abcdefghi", "lkjihgfed"),
    "rooms": (ROOMS, "abcde", "badec"),
    "full": (FULL, "abc", "acb"),
}

# fmt: off
PLANS: dict[tuple[str, TieBreak], tuple[int, int]] = {  # expansions of the search, checksum of its plan
    ("bay", TieBreak.RANDOM): (300, 880301402),
    ("bay", TieBreak.STRAIGHT): (300, 880301402),
    ("tree", TieBreak.RANDOM): (8, 3436762514),
    ("tree", TieBreak.STRAIGHT): (8, 3436762514),
    ("ring", TieBreak.RANDOM): (2, 1435640760),
    ("ring", TieBreak.STRAIGHT): (2, 1435640760),
    ("door", TieBreak.RANDOM): (24, 4285081311),
    ("door", TieBreak.STRAIGHT): (36, 3833273280),
    ("crowd", TieBreak.RANDOM): (44, 3560693331),
    ("crowd", TieBreak.STRAIGHT): (13, 524954718),
    ("rooms", TieBreak.RANDOM): (14, 2109134604),
    ("rooms", TieBreak.STRAIGHT): (14, 3004565273),
    ("full", TieBreak.RANDOM): (100, 880301402),
    ("full", TieBreak.STRAIGHT): (100, 880301402),
}
JOINT: dict[str, tuple[str, int, int]] = {  # outcome, expansions of all starts, checksum of the plan and its order
    "bay": ("solved", 200, 3389009930),
    "tree": ("solved", 41, 3265825765),
    "ring": ("solved", 8, 2785445292),
    "door": ("solved", 100, 992674711),
    "crowd": ("solved", 81, 160229382),
    "rooms": ("solved", 59, 4051939910),
    "full": ("solved for one", 192, 2563501636),
}
ANY: dict[str, tuple[int, int]] = {  # expansions, checksum of a plan in which one robot moves at a time
    "bay": (86, 1501418535),
    "tree": (25, 437922271),
    "ring": (9, 3781846800),
    "door": (129, 1255980386),
    "crowd": (122, 812160477),
    "rooms": (55, 3313261762),
    "full": (4, 880301402),
}
CHANGES: dict[str, tuple[int, int]] = {  # expansions of 20 changes, checksum of the plans
    "tree": (197, 2228684879),
    "ring": (141, 3717148199),
    "door": (9867, 437463452),
    "crowd": (1391, 1546172085),
    "rooms": (746, 2328351114),
}
# fmt: on


def planned(name: str, ties: TieBreak) -> LacamSearch:
    drawn, starts, goals = CASES[name]
    tables = [drawn.cells.distances(goal) for goal in drawn.at(goals)]
    search = LacamSearch(drawn.cells.neighbours, tables, drawn.at(starts), drawn.at(goals), ties=ties, random=Random(5))
    search.advance(300)
    return search


def checksum(*what: object) -> int:
    text = repr(what).replace("Precedence(", "Order(").replace("EntryConstraint(", "After(")  # as they were recorded
    return crc32(text.encode())


@pytest.mark.parametrize(("name", "ties"), PLANS)
def test_a_search_finds_the_same_plan(name: str, ties: TieBreak) -> None:
    search = planned(name, ties)
    assert (search.expansions, checksum(search.steps)) == PLANS[name, ties]


@pytest.mark.parametrize("name", JOINT)
def test_a_leader_finds_the_same_plan(name: str) -> None:
    drawn, starts, goals = CASES[name]
    tables = [drawn.cells.distances(goal) for goal in drawn.at(goals)]
    search = JointSearch(
        drawn.cells.neighbours, tables, drawn.at(starts), drawn.at(goals), budget=Budget(expansions=3000), random=Random(5)
    )  # fmt: skip
    while (result := search.advance(100)) is None:
        pass
    order = result.order and tuple(result.order)  # without the name of its class
    assert (result.outcome.value, result.expansions, checksum(result.steps, order, result.who)) == JOINT[name]


@pytest.mark.parametrize("name", ANY)
def test_moving_one_at_a_time_finds_the_same_plan(name: str) -> None:
    drawn, starts, goals = CASES[name]
    tables = [drawn.cells.distances(goal) for goal in drawn.at(goals)]
    search = BestFirst(drawn.cells.neighbours, tables, drawn.at(starts))
    assert search.advance(2000) is not SearchState.RUNNING
    assert (search.expansions, checksum(search.steps)) == ANY[name]


@pytest.mark.parametrize("name", CHANGES)
def test_a_plan_is_changed_in_the_same_way(name: str) -> None:
    drawn, _, goals = CASES[name]
    steps = remove_detours(planned(name, TieBreak.RANDOM).steps)
    tables = [drawn.cells.distances(goal) for goal in drawn.at(goals)]
    improving = PlanImprover(drawn.cells.neighbours, tables, Random(5))
    plans = (improving.replan_robots(schedule_plan(steps)) for _ in range(20))
    changed = [plan and plan.steps() for plan in plans]
    assert (improving.pops, checksum(changed)) == CHANGES[name]
