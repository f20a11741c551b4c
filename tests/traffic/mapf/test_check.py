"""The checker of joint plans finds every kind of fault."""

import pytest

from swarm.traffic.mapf.check import faults

#  3 4 5
#  0 1 2      all joined as a grid
JOINED = {0: (1, 3), 1: (0, 2, 4), 2: (1, 5), 3: (0, 4), 4: (1, 3, 5), 5: (2, 4)}


def test_a_good_plan_has_no_fault() -> None:
    plan = [(0, 2), (1, 5), (4, 2), (4, 1)]
    assert faults(plan, starts=(0, 2), goals=(4, 1), joined=JOINED) == []


@pytest.mark.parametrize(
    ("plan", "words"),
    [
        ([(0, 2), (1, 1)], "both in cell 1"),
        ([(0, 1), (1, 0)], "swap places"),
        ([(0, 1, 4, 3), (1, 4, 3, 0)], "move in a ring"),
        ([(0,), (2,)], "jumps from cell 0 to cell 2"),
        ([(0,), (7,)], "where nobody can stand"),
        ([], "no steps"),
        ([(0, 2), (1,)], "1 robots, not 2"),
    ],
    ids=["vertex", "swap", "ring", "jump", "obstacle", "empty", "lost robot"],
)
def test_bad_plans_are_found_out(plan: list[tuple[int, ...]], words: str) -> None:
    starts, goals = (plan[0], plan[-1]) if plan else ((), ())
    assert any(words in fault for fault in faults(plan, starts=starts, goals=goals, joined=JOINED))


def test_wrong_start_and_goal() -> None:
    found = faults([(0,), (1,)], starts=(3,), goals=(4,), joined=JOINED)
    assert [fault.split()[0] for fault in found] == ["starts", "ends"]
