from collections.abc import Sequence
from itertools import groupby
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dashboard.fold.plans import Followed, plans_under_way
from swarm.messages.traffic import Entry, Epoch, JointPlan, Record
from swarm.traffic.mapf.precedence import order_of

EPOCH = Epoch(40, "r1")
STEPS = [(0, 3, 9), (1, 3, 9), (2, 1, 9), (2, 5, 1), (2, 5, 5)]  # three robots through cell 1, one after the other


def plan_of(steps: Sequence[tuple[int, ...]], epoch: Epoch = EPOCH) -> JointPlan:
    """Write a plan as a leader does."""
    order = order_of(steps)
    names = [f"r{number}" for number in range(1, len(order.ways) + 1)]
    return JointPlan(
        epoch=epoch,
        ways=dict(zip(names, order.ways, strict=True)),
        after={
            robot: tuple(Entry(step, names[before.robot], before.place) for step, before in sorted(after.items()))
            for robot, after in zip(names, order.after, strict=True)
            if after
        },
    )


def record(robot: str, epoch: Epoch | None = EPOCH, left: int = 0, entered: int = 0, **changes: Any) -> Record:  # noqa: ANN401
    now = Record(robot=robot, stamp=50, x=0.0, y=0.0, goal=0, epoch=epoch, left=left, entered=entered)
    return msgspec.structs.replace(now, **changes)


def told(plan: JointPlan, *records: Record) -> list[Followed]:
    return plans_under_way({record.robot: record for record in records}, {plan.epoch: plan})


def test_a_plan_is_told_by_leader_members_ways_and_order() -> None:
    [plan] = told(plan_of(STEPS), record("r1"), record("r2"), record("r3"))
    assert plan.leader == "r1"
    assert plan.ways == {"r1": (0, 1, 2), "r2": (3, 1, 5), "r3": (9, 1, 5)}
    assert plan.turns == {1: ("r1", "r2", "r3")}, "cell 5 tells no more than that r2 is before r3: cell 1 does so too"


def test_what_is_behind_is_told_no_more() -> None:
    [plan] = told(plan_of(STEPS), record("r1", left=1, entered=2), record("r2"), record("r3"))
    assert plan.ways["r1"] == (1, 2)
    assert plan.turns == {1: ("r2", "r3")}


def test_who_has_left_the_plan_has_no_part_in_it() -> None:
    [plan] = told(plan_of(STEPS), record("r1"), record("r2", epoch=None), record("r3"))
    assert set(plan.ways) == {"r1", "r3"}
    assert plan.turns == {1: ("r1", "r3")}


def test_a_plan_is_done_when_nobody_has_anything_left_to_drive() -> None:
    ends = [record(f"r{number}", left=2, entered=2) for number in (1, 2, 3)]
    assert told(plan_of(STEPS), *ends) == []
    assert told(plan_of(STEPS), record("r1", epoch=None), record("r2", epoch=None)) == []


def test_a_cell_entered_twice_by_one_robot_is_told_twice() -> None:
    """Robot 1 makes way in a siding of its own and comes back: cell 1 is its, then the other's, then its again."""
    steps = [(0, 5), (1, 5), (4, 5), (4, 1), (4, 0), (1, 0)]
    [plan] = told(plan_of(steps), record("r1"), record("r2"))
    assert plan.turns == {1: ("r1", "r2", "r1")}


def test_two_plans_are_two() -> None:
    first, second = plan_of(STEPS), plan_of([(20,), (21,)], Epoch(60, "r9"))
    second = msgspec.structs.replace(second, ways={"r9": (20, 21)})
    records = {"r1": record("r1"), "r2": record("r2"), "r9": record("r9", epoch=second.epoch)}
    assert [plan.leader for plan in plans_under_way(records, {plan.epoch: plan for plan in (second, first)})] == [
        "r1",
        "r9",
    ]


def test_of_a_plan_never_heard_the_next_cells_are_told() -> None:
    [plan] = plans_under_way({"r2": record("r2", held=(3, 1), ahead=(5,))}, {})
    assert plan == Followed("r1", {"r2": (3, 1, 5)}, {})


@pytest.mark.parametrize("place", [0, 1, 2, 99])
def test_nonsense_from_the_wire_ends(place: int) -> None:
    """Entries that wait for themselves, for each other, or for what is not there."""
    after = {"r1": (Entry(1, "r2", place),), "r2": (Entry(1, "r1", place), Entry(2, "r2", 2), Entry(7, "gone", place))}
    ways = {"r1": (0, 1, 2), "r2": (3, 1, 2), "r3": ()}
    told(
        JointPlan(epoch=EPOCH, ways=ways, after=after), record("r1", left=99), record("r2"), record("r3"), record("r4")
    )


@given(data=st.data(), robots=st.integers(2, 4))
def test_every_order_told_is_the_order_of_the_plan(data: st.DataObject, robots: int) -> None:
    """Robots move one at a time over a few cells: where an order is told, they were entered in that order."""
    places = [100 + number for number in range(robots)]
    moves = st.tuples(st.integers(0, robots - 1), st.integers(0, 4))
    steps, entered = [tuple(places)], dict[int, list[str]]()
    for number, cell in data.draw(st.lists(moves, max_size=30)):
        if cell not in places:
            places[number] = cell
            steps.append(tuple(places))
            entered.setdefault(cell, []).append(f"r{number + 1}")
    for plan in told(plan_of(steps), *(record(f"r{number + 1}") for number in range(robots))):
        for cell, order in plan.turns.items():
            assert order == tuple(robot for robot, _ in groupby(entered[cell]))
        longest = max((len(list(groupby(robots))) for robots in entered.values()), default=0)
        assert max(map(len, plan.turns.values()), default=1) == max(longest, 1)
