"""A robot's own path: how the robot follows it, and when it gives it up."""

import pytest

from swarm.geometry import Pose, distance
from swarm.planning.grid import Grid
from swarm.robot.navigator import Navigator
from swarm.robot.tuning import REPLAN
from swarm.scenario.prepare import planning_grid
from tests.shared import scenario_of

RADIUS = 0.2  # m
REACH = 0.4  # m
OPEN = "#" * 16 + "\n" + ("#" + "." * 14 + "#\n") * 8 + "#" * 16 + "\n"
GRID = planning_grid(scenario_of(OPEN))
START, GOAL = (2.0, 5.0), (12.0, 5.0)


def under_way(grid: Grid = GRID, start: tuple[float, float] = START, goal: tuple[float, float] = GOAL) -> Navigator:
    navigator = Navigator(grid, RADIUS, REACH)
    assert navigator.head_for(start, goal)
    return navigator


def test_what_is_left_is_counted_from_where_the_robot_is() -> None:
    navigator = Navigator(GRID, RADIUS, REACH)
    assert navigator.remaining == 0.0
    navigator = under_way()
    for x in (2.0, 2.5, 4.0):
        assert navigator.advance(Pose(x, 5.1, 0.0))
        assert navigator.remaining == pytest.approx(12.0 - x)
    navigator.clear()
    assert navigator.path is None
    assert navigator.remaining == 0.0


@pytest.mark.parametrize(("off", "on_path"), [(REPLAN.strayed - 0.01, True), (REPLAN.strayed + 0.01, False)])
@pytest.mark.parametrize("side", [1, -1])
def test_who_is_too_far_off_its_path_has_strayed(off: float, on_path: bool, side: int) -> None:
    assert under_way().advance(Pose(4.0, 5.0 + side * off, 0.0)) is on_path


def test_progress_leaps_no_farther_than_a_robot_can() -> None:
    navigator = under_way()
    navigator.advance(Pose(2.0 + REPLAN.jump + 3.0, 5.0, 0.0))
    assert navigator.remaining == pytest.approx(10.0 - REPLAN.jump, abs=0.01)


def test_each_path_is_counted_and_begun_at_its_start() -> None:
    navigator = under_way()
    navigator.advance(Pose(3.5, 5.0, 0.0))
    assert navigator.plans == 1
    assert navigator.head_for((3.5, 5.0), (3.5, 8.0))
    assert navigator.plans == 2
    assert navigator.remaining == pytest.approx(3.0)
    assert not navigator.head_for((3.5, 5.0), (-5.0, 0.5)), "no path leads there"
    assert navigator.plans == 2
    assert navigator.remaining == pytest.approx(3.0), "and the one at hand stays"


@pytest.mark.parametrize(
    ("x", "ends"),
    [
        (1.25, 1.25),  # the wall ends at x = 1.0: there is room
        (1.05, 1.25),  # a wall too near: as near as it fits, to a cell of the grid
        (0.9, 1.25),
        (0.8, None),  # farther than 0.9 of the reach from where it fits
    ],
)
def test_beside_a_stop_too_near_a_wall_it_ends_within_reach(x: float, ends: float | None) -> None:
    navigator = Navigator(GRID, RADIUS, REACH)
    assert navigator.head_for(START, (x, 5.0)) is (ends is not None)
    if ends is not None:
        assert navigator.path is not None
        assert navigator.path.points[-1] == pytest.approx((ends, 5.0), abs=GRID.resolution)


def test_it_plans_round_who_stands_in_the_way_but_not_round_who_touches_it() -> None:
    navigator = Navigator(GRID, RADIUS, REACH)
    body = (7.0, 5.0)
    assert navigator.head_for(START, GOAL, [body])
    assert navigator.path is not None
    way = [navigator.path.point_at(0.01 * k) for k in range(round(100 * navigator.path.length) + 1)]
    assert min(distance(point, body) for point in way) >= 2 * RADIUS + REPLAN.body_gap - 0.02
    assert navigator.path.length > 10.05
    assert navigator.head_for(START, GOAL, [(START[0] + 2 * RADIUS - 0.01, 5.0)]), "it is in it already"
    assert navigator.path.length == pytest.approx(10.0)


def test_a_wall_in_the_way_makes_a_path_be_forgotten_and_one_behind_does_not() -> None:
    navigator = under_way()
    for x in (3.5, 5.0, 6.5):
        navigator.advance(Pose(x, 5.0, 0.0))
    rows = OPEN.splitlines()
    behind = planning_grid(scenario_of("\n".join([*rows[:4], "#..#" + rows[4][4:], *rows[5:]]) + "\n"))
    navigator.take_ground(behind)
    assert navigator.path is not None
    assert navigator.grid is behind
    before = planning_grid(scenario_of("\n".join([*rows[:4], rows[4][:9] + "#" + rows[4][10:], *rows[5:]]) + "\n"))
    navigator.take_ground(before)
    assert navigator.path is None
