"""The checker of joint plans finds every kind of fault."""

import pytest

from swarm.traffic.mapf.check import list_plan_faults

#  3 4 5
#  0 1 2      all joined as a grid
JOINED = {0: (1, 3), 1: (0, 2, 4), 2: (1, 5), 3: (0, 4), 4: (1, 3, 5), 5: (2, 4)}


def test_a_good_plan_has_no_fault() -> None:
    plan = [(0, 2), (1, 5), (4, 2), (4, 1)]
    assert list_plan_faults(plan, starts=(0, 2), goals=(4, 1), joined=JOINED) == []


@pytest.mark.parametrize(
    ("plan", "told"),
    [
        ([(0, 2), (1, 1)], ["time 1: robots 0 and 1 both in cell 1"]),
        ([(0, 1), (1, 0)], ["time 1: robots swap places over cells [0, 1]"]),
        ([(0, 1, 4, 3), (1, 4, 3, 0)], ["time 1: robots move in a ring over cells [0, 1, 4, 3]"]),
        ([(0,), (2,)], ["time 1: robot 0 jumps from cell 0 to cell 2"]),
        ([(0,), (7,)], ["time 1: robot 0 in cell 7, where nobody can stand",
                        "time 1: robot 0 jumps from cell 0 to cell 7"]),
        ([(7,), (8,), (1,)], ["time 0: robot 0 in cell 7, where nobody can stand",
                              "time 1: robot 0 in cell 8, where nobody can stand",
                              "time 1: robot 0 jumps from cell 7 to cell 8",
                              "time 2: robot 0 jumps from cell 8 to cell 1"]),
        ([], ["no steps at all"]),
        ([(0, 2), (1,)], ["time 1: 1 robots, not 2"]),
    ],
    ids=["vertex", "swap", "ring", "jump", "obstacle", "from an obstacle", "empty", "lost robot"],
)  # fmt: skip
def test_bad_plans_are_found_out(plan: list[tuple[int, ...]], told: list[str]) -> None:
    starts, goals = (plan[0], plan[-1]) if plan else ((), ())
    assert sorted(list_plan_faults(plan, starts=starts, goals=goals, joined=JOINED)) == sorted(told)


def test_wrong_start_and_goal() -> None:
    found = list_plan_faults([(0,), (1,), (2,)], starts=(3,), goals=(4,), joined=JOINED)
    assert found == ["starts at (0,), not at (3,)", "ends at (2,), not at (4,)"]
