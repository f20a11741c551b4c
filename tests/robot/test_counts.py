"""Learning by counting, with figures worked out by hand: when a hit makes a wall, where, and who is told."""

from dataclasses import replace
from itertools import chain
from math import cos, pi, sin

import numpy as np
import pytest

from swarm.geometry import Pose, from_frame
from swarm.maps.occupancy import WALL, Point
from swarm.messages import Edit, Kind, Sense
from swarm.robot.ground import Ground
from swarm.scenario.load import Scenario
from tests.shared import scenario_of, with_settings

TEXT = "\n".join(["#" * 10, *["#" + "." * 8 + "#"] * 4, "#" * 10]) + "\n"
HERE = Pose(5.05, 3.05, 0.0)  # the centre of cell 50 of row 30; cells of 0.1 m
RADIUS, FREE_WAY = 0.2, 1.6  # m; a ray that sees nothing reads its range


def ground(rays: int = 1, noise: float = 0.0) -> Ground:
    scenario = scenario_of(TEXT, map={"text": TEXT, "cell": 1.0, "known": False})
    return Ground(with_settings(scenario, sensors={"rays": rays, "noise": noise}))


def sense(read: list[float], pose: Pose = HERE) -> Sense:
    return Sense(
        world="local",
        run=0, tick=0, time=0.0, lockstep=True, x=pose.x, y=pose.y, yaw=pose.yaw, linear=0.0, angular=0.0,
        left=1.6, front=1.6, right=1.6, bearings=[], hears=[], rays=read,
    )  # fmt: skip


def looks(one: Ground, front: float, times: int = 1, pose: Pose = HERE) -> list[bool]:
    """Look with one ray ahead that reads ``front`` [m]; the rays to the sides see nothing."""
    return [one.learn(sense([FREE_WAY, front, FREE_WAY], pose), lambda place: False) for _ in range(times)]


def walls(one: Ground) -> list[tuple[int, int]]:
    return [(row, column) for row, column in np.argwhere(one.map.cells == WALL).tolist()]


CELL = 30 * 100 + 62  # of the hit 1.2 m ahead


@pytest.mark.parametrize(("hits", "passes"), [(2, 4), (3, 6), (5, 10), (8, 10)])
def test_two_hits_make_a_wall_and_as_many_passes_as_its_count_unmake_it(hits: int, passes: int) -> None:
    """A hit adds 2, a pass takes 1, 4 is solid, 10 is the most."""
    one = ground()
    assert looks(one, 1.0, hits) == [number == 1 for number in range(hits)]
    assert walls(one) == [(30, 62)]
    assert looks(one, FREE_WAY, passes) == [number == passes - 1 for number in range(passes)]
    assert walls(one) == []


def test_a_wall_is_told_from_the_fourth_hit_on() -> None:
    one, told = ground(), []
    for _ in range(5):
        looks(one, 1.0)
        told.append(set(one.tell()))
    assert told == [set(), set(), set(), {CELL}, {CELL}]


@pytest.mark.parametrize(
    ("noise", "read", "hit"), [(0.0, 1.585, True), (0.0, 1.595, False), (0.02, 1.50, True), (0.02, 1.52, False)]
)
@pytest.mark.parametrize("turns", range(4))
def test_a_reading_close_to_the_range_may_have_hit_nothing(noise: float, read: float, hit: bool, turns: int) -> None:
    """The range is 1.6 m: a hit is 0.01 m and four standard deviations shorter."""
    one = ground(noise=noise)
    assert looks(one, read, 2, HERE._replace(yaw=turns * pi / 2))[-1] is hit


@pytest.mark.parametrize(
    ("noise", "end", "column"),
    [(0.0, 6.19, 61), (0.02, 6.15, 61), (0.02, 6.17, 62), (0.05, 6.14, 61), (0.05, 6.16, 62)],
)
def test_a_hit_counts_two_deviations_deeper_and_half_a_cell_at_most(noise: float, end: float, column: int) -> None:
    one = ground(noise=noise)
    looks(one, end - HERE.x - RADIUS, 2)
    assert walls(one) == [(30, column)]


@pytest.mark.parametrize(("end", "second"), [(6.13, 61), (6.15, None), (6.33, None), (6.35, 63)])
def test_a_hit_near_a_known_wall_makes_no_second_one(end: float, second: int | None) -> None:
    """The noise is 0.02 m: a wall one deviation behind the hit or four before it is what was hit."""
    one = ground(noise=0.02)
    looks(one, 6.23 - HERE.x - RADIUS, 5)
    assert walls(one) == [(30, 62)]
    looks(one, end - HERE.x - RADIUS, 5)  # the cell before the wall was passed five times
    assert walls(one) == sorted([(30, 62)] + [(30, second)] * (second is not None))


def test_a_hit_is_looked_for_among_robots_half_a_radius_behind_it() -> None:
    asked: list[Point] = []
    pose = HERE._replace(yaw=0.3)

    def is_robot(place: Point) -> bool:
        asked.append(place)
        return True

    assert not any(ground().learn(sense([0.4, 0.5, 0.6], pose), is_robot) for _ in range(3))
    expected = [
        (HERE.x + away * cos(0.3 + side), HERE.y + away * sin(0.3 + side))
        for away, side in ((0.7, pi / 3), (0.8, 0.0), (0.9, -pi / 3))
    ]
    assert len(asked) == 9
    for place, there in zip(asked[:3], expected, strict=True):
        assert place == pytest.approx(there)


@pytest.mark.parametrize("origin", [Pose(-3.0, 4.0, 1.0), Pose(2.0, -7.0, -2.5)])
def test_on_a_map_that_lies_elsewhere_and_turned_the_same_cells_are_learned(origin: Pose) -> None:
    scenario = scenario_of(TEXT, map={"text": TEXT, "cell": 1.0, "known": False})
    scenario = with_settings(scenario, sensors={"rays": 1})
    there = Ground(Scenario(scenario.settings, replace(scenario.map, origin=origin), scenario.profile))
    for yaw in (0.3, 2.0, -1.0):
        here = ground()
        looks(here, 1.02, 2, HERE._replace(yaw=yaw))
        there.forget(0.0)
        looks(there, 1.02, 2, Pose(*from_frame(origin, HERE.x, HERE.y), yaw + origin.yaw))
        assert walls(there) == walls(here)
        assert len(walls(here)) == 1


# --- what others tell ---


@pytest.mark.parametrize(("row", "column"), [(0, 0), (0, 99), (59, 0), (59, 99), (30, 62)])
def test_each_cell_that_is_heard_is_a_wall_and_one_block_of_news(row: int, column: int) -> None:
    one = ground()
    assert one.hear([100 * row + column], 0.0)
    assert walls(one) == [(row, column)]
    assert one.take_news() == [((row, column), (row + 1, column + 1))]
    assert one.take_news() == []


def test_who_forgot_everything_believes_others_again_after_30_s() -> None:
    one = ground()
    looks(one, 1.0, 5)
    one.take_news()
    one.forget(7.0)
    assert one.take_news() == [((0, 0), (60, 100))]
    assert not one.hear([CELL], 36.9)
    assert one.hear([CELL], 37.1)
    assert walls(one) == [(30, 62)]


def test_who_forgot_everything_plans_as_on_an_empty_floor() -> None:
    one, empty = ground(), ground()
    one.hear([0, 99, 5900, 5999, CELL], 0.0)
    assert (one.grid.solid != empty.grid.solid).any()
    one.forget(0.0)
    assert (one.grid.solid == empty.grid.solid).all()
    assert (one.grid.free == empty.grid.free).all()
    assert np.allclose(one.grid.clearance, empty.grid.clearance)


def surrounded(*places: Point) -> Ground:
    """Look four times with many rays at each place: arcs of walls, 1.2 m away."""
    one = ground(rays=45)
    for x, y in places:
        for _ in range(4):
            one.learn(sense([1.0] * 135, Pose(x, y, 0.0)), lambda place: False)
    return one


ROWS = [(x, y) for y in (1.55, 4.45) for x in (0.75, 3.25, 5.75, 8.25)]


def test_a_broadcast_has_120_cells_and_new_ones_are_not_repeated() -> None:
    one = surrounded(*ROWS)
    told = [one.tell() for _ in range(3)]
    assert [len(cells) for cells in told] == [120] * 3
    assert len({*told[0], *told[1]}) == 240


def test_of_many_new_cells_four_broadcasts_more_are_kept_and_then_all_come_in_turn(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("swarm.robot.ground.TELL", 7)
    one = surrounded(*ROWS[:2])
    known = sorted(100 * row + column for row, column in walls(one))
    told = [one.tell() for _ in range(8)]
    assert len(set(chain.from_iterable(told[:5]))) == 35
    assert told[5:] == [known[:7], known[7:14], known[14:21]]


# --- edits ---

EDITS = [Edit(kind=Kind.WALL, low=(column + 0.1, 2.1), high=(column + 0.9, 2.9)) for column in (2, 4, 6)]


def test_edits_that_a_map_includes_are_not_applied_again() -> None:
    scenario = scenario_of(TEXT)
    one, before = Ground(scenario, None, 1), Ground(scenario)
    assert before.edits == 0
    assert one.take_edits(0, EDITS[:2])
    assert [one.map.cells[2, column] == WALL for column in (2, 4, 6)] == [False, True, False]
    assert one.edits == 2
    for number, edits in ((0, EDITS[:2]), (1, EDITS[1:2]), (2, []), (3, EDITS)):
        assert not one.take_edits(number, edits)
        assert one.edits == 2
    assert (one.has_missed_edits(2), one.has_missed_edits(3)) == (False, True)
    assert one.take_edits(1, EDITS[1:])
    assert [one.map.cells[2, column] == WALL for column in (2, 4, 6)] == [False, True, True]
    assert one.edits == 3
