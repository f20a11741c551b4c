"""A leader's joint plan, with the robots that it hears and those that it does not."""

from collections.abc import Mapping
from functools import partial

import pytest

from swarm.messages.traffic import Record
from swarm.traffic.joint.goals import FallbackGoal, assign_goals
from swarm.traffic.joint.problem import RELAXATIONS, AvoidedCells, Relaxation
from swarm.traffic.joint.protocol import JointPlanning
from swarm.traffic.joint.states import Free
from swarm.traffic.lattice.cell_map import OUTSIDE, CellMap
from swarm.traffic.peers.records import TrafficNote
from swarm.traffic.peers.situation import Situation
from swarm.traffic.settings import TrafficConstants
from tests.traffic.maps import Drawn

ROUND = Drawn("a.n......f.b", ".##########.", "............")
ROW = Drawn("abcde")


def situation(
    cells: CellMap, tick: int, head: int, goal: int, others: Mapping[str, Record], fresh: Mapping[str, Record]
) -> Situation:
    """Where nobody has seen anything that was not told of."""
    return Situation(tick=tick, cells=cells, head=head, goal=goal, others=others, fresh=fresh)


@pytest.mark.parametrize(("where", "round_it"), [("n", True), ("f", False)], ids=["near", "out of hearing"])
def test_the_silent_are_planned_round_only_where_they_must_be(where: str, round_it: bool) -> None:
    (start, goal, cell), (x, y) = ROUND.at("ab" + where), ROUND.points(where)[0]
    silent = Record(robot="r9", stamp=0, x=x, y=y, goal=cell, held=(cell,))
    joint = JointPlanning("r1", TrafficConstants(radio_range=8.0))
    joint.call = Free(need="r1")
    for tick in range(100, 200):
        joint.handle_occasion(situation(ROUND.cells, tick, start, goal, {"r9": silent}, {}))
        if joint.following is not None:
            break
    assert joint.following is not None
    way = joint.following.plan.ways["r1"]
    assert (cell not in way) is round_it
    assert way[-1] == goal


@pytest.mark.parametrize(
    ("wishes", "idle", "expected"),
    [
        ("bd", "", "bd"),
        ("cc", "", "bc"),  # r2 is nearer
        ("dd", "r2", "de"),  # but has nothing to do there
        ("d-", "r2", "de"),
        ("e-", "r2", "ed"),
        ("ea", "", "ea"),
    ],
)
def test_who_ends_where(wishes: str, idle: str, expected: str) -> None:
    heads = dict(zip(("r1", "r2"), ROW.at("ad"), strict=True))
    wanted = {robot: OUTSIDE if wish == "-" else ROW.at(wish)[0] for robot, wish in zip(heads, wishes, strict=True)}
    goals = assign_goals(ROW.cells, heads, wanted, (), {"r1": 0, "r2": 5}, idle=idle.split())
    assert (goals["r1"], goals["r2"]) == ROW.at(expected)


@pytest.mark.parametrize(("done", "expected"), [("", "ca"), ("r1", "bc")])
def test_who_is_done_does_not_take_a_place_from_which_another_looks(done: str, expected: str) -> None:
    heads = dict(zip(("r1", "r2"), ROW.at("bc"), strict=True))
    place, goal, blocked = ROW.at("ced")
    goals = assign_goals(ROW.cells, heads, {"r1": place, "r2": goal}, (blocked,), {"r1": 0, "r2": 0}, done.split())
    assert (goals["r1"], goals["r2"]) == ROW.at(expected)


def test_who_is_idle_leaves_the_way_of_the_one_that_comes_and_nobody_else_does() -> None:
    """r1 comes to the end of a dead end in which r2 and r3 rest; deeper in it nobody is out of the way."""
    dead_end = Drawn("fdceg", "##b##", "##a##")
    heads = dict(zip(("r1", "r2", "r3", "r4"), dead_end.at("cabf"), strict=True))
    for aside in FallbackGoal:
        goals = assign_goals(
            dead_end.cells, heads, heads | {"r1": heads["r2"]}, (), dict.fromkeys(heads, 0), idle=("r2", "r3", "r4"),
            aside=aside,
        )  # fmt: skip
        assert tuple(goals[robot] for robot in heads) == dead_end.at("adef")


def test_who_waits_for_a_target_does_not_stand_in_the_way_to_it() -> None:
    dead_end = Drawn("fdceg", "##b##", "##a##")
    heads = dict(zip(("r1", "r2"), dead_end.at("cd"), strict=True))
    goals = assign_goals(dead_end.cells, heads, dict.fromkeys(heads, dead_end.at("a")[0]), (), dict.fromkeys(heads, 0))
    assert tuple(goals.values()) == dead_end.at("ad")


# --- what a leader says when there is no plan ---

ROW_OF_FOUR = Drawn("abcd")
TICKS = 200

# fmt: off
NO_PLAN = {  # where robots stand, where they want to be: what is said, and of whom
    "two swap in a corridor":              ("ab", "ba", "unsolvable", ("r1", "r2")),
    "a third one stands by":               ("abd", "bad", "unsolvable", ("r1", "r2")),
    "one of two wants another's target":   ("abc", "bab", "unsolvable", ("r1", "r2")),
}
# fmt: on


@pytest.mark.parametrize("name", NO_PLAN)
def test_a_jam_is_called_unsolvable_only_where_each_was_planned_to_its_own_target(name: str) -> None:
    """Where a target was given to somebody else, that there is no plan proves nothing about the mission."""
    heads, wishes, kind, who = NO_PLAN[name]
    others, joint = {}, JointPlanning("r1", TrafficConstants())
    joint.call = Free(need="r1")
    events: list[TrafficNote] = []
    for tick in range(TICKS):
        for number, (head, wish) in enumerate(zip(ROW_OF_FOUR.at(heads), ROW_OF_FOUR.at(wishes), strict=True), 1):
            x, y = ROW_OF_FOUR.cells.centre(head)
            others[f"r{number}"] = Record(
                robot=f"r{number}", stamp=tick, x=x, y=y, goal=wish, held=(head,), frozen=joint.call_epoch
            )
        mine = others.pop("r1")
        events += joint.handle_occasion(
            situation(ROW_OF_FOUR.cells, tick, mine.held[-1], mine.goal, dict(others), dict(others))
        ).events
    assert [(event.kind, event.robots) for event in events] == [(kind, who)]
    assert joint.following is None


@pytest.mark.parametrize("what", ["blocked", "bodies"])
def test_what_shuts_the_way_but_is_no_wall_makes_no_jam_unsolvable(what: str) -> None:
    """Two swap in a room of two by two: they can where it is empty, and it may be empty again."""
    square = Drawn("ab", "cd")
    a, b, c, d = square.at("abcd")
    said: dict[bool, list[tuple[str, bool]]] = {}
    for shut in (True, False):
        joint = JointPlanning("r1", TrafficConstants())
        joint.call = Free(need="r1")
        events: list[TrafficNote] = []
        for tick in range(TICKS):
            x, y = square.cells.centre(b)
            other = {"r2": Record(robot="r2", stamp=tick, x=x, y=y, goal=a, held=(b,), frozen=joint.call_epoch)}
            cells = frozenset({c, d} if shut else ())
            centres = [(robot, *square.cells.centre(cell)) for robot, cell in (("r3", c), ("r4", d))]
            dead = {robot: Record(robot=robot, stamp=0, x=x, y=y, goal=-1) for robot, x, y in centres}
            found = situation(square.cells, tick, a, b, other | dead, other)
            found = (
                found._replace(blocked=cells) if what == "blocked" else found._replace(bodies=partial(frozenset, cells))
            )
            events += joint.handle_occasion(found).events
            if joint.following is not None:
                break
        said[shut] = [(event.kind, joint.following is not None) for event in events]
    assert said == {True: [("no_plan_found", False)], False: [("joint_plan", True)]}


def test_the_last_attempt_leads_into_a_cell_that_a_dead_body_may_have_left() -> None:
    """It reached into d when it was heard last; its middle was in f. A look into d shows whether it is still there."""
    square = Drawn("abe", "#df")
    a, e, d, f = square.at("aedf")
    x, y = square.cells.centre(f)
    dead = Record(robot="r3", stamp=0, x=x - square.cells.side / 2 + 0.1, y=y, goal=-1)
    joint = JointPlanning("r1", TrafficConstants())
    joint.call = Free(need="r1")
    for tick in range(TICKS):
        x, y = square.cells.centre(e)
        other = {"r2": Record(robot="r2", stamp=tick, x=x, y=y, goal=a, held=(e,), frozen=joint.call_epoch)}
        found = situation(square.cells, tick, a, e, other | {"r3": dead}, other)._replace(
            bodies=lambda: frozenset({d, f})
        )
        events = joint.handle_occasion(found).events
        if joint.following is not None:
            break
    assert [event.kind for event in events] == ["joint_plan"]


def test_each_attempt_puts_another_question_the_whole_one_first() -> None:
    """The first also leads on through targets that robots share; the second is the same without."""
    whole = Relaxation(AvoidedCells.HELD, True, FallbackGoal.NEAR)
    assert RELAXATIONS[:2] == (whole._replace(through=True), whole)
    assert len(set(RELAXATIONS)) == len(RELAXATIONS)
