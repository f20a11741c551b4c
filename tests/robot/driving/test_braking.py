"""The brake: the cells that a robot keeps reserved for it are those that the wheels drive through."""

from math import pi

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from swarm.geometry import Pose
from swarm.motion.drive import LONGEST, path_room
from swarm.planning.grid import Grid
from swarm.robot.driving.aim import Aiming
from swarm.robot.driving.safety import DriveState, SafetyFilter
from swarm.robot.tuning import SAFETY
from tests.robot.driving.shared import (
    DRIVE,
    DT,
    MOST,
    RADIUS,
    SETTINGS,
    cells_as_shape,
    constraints,
    rolled,
    room,
    sense_of,
    solid,
    to_a_stand,
    told,
)
from tests.traffic.maps import SIDE, Drawn

rims = st.tuples(st.floats(-0.4, 1.6), st.floats(-0.4, 1.6))
inside = st.builds(Pose, st.floats(-1.5, 1.5), st.floats(-0.9, 0.9), st.floats(-pi, pi))
HALL = Drawn("##########", "#a.......#", "##########")
HALL_GRID = Grid.grown(HALL.occupancy, RADIUS, resolution=0.1)
FREE = Drawn(*["." * 12] * 3)
FREE_GRID = Grid.grown(FREE.occupancy, RADIUS, resolution=0.1)
TICKS = round(SAFETY.look / DT)


@given(pose=inside, now=rims, late=st.lists(rims, max_size=6))
def test_the_braking_points_are_where_the_wheels_come_to_rest_however_many_commands_are_under_way(
    pose: Pose, now: tuple[float, float], late: list[tuple[float, float]]
) -> None:
    """Of the newest commands none, one, and so on to all are carried out, and then the brake."""
    body = DriveState(pose, *now)
    points = SafetyFilter(SETTINGS).braking(body, late).tolist()
    by_hand = []
    for first in range(len(late), -1, -1):
        one, poses = body, []
        for wanted in late[first:]:
            one = rolled(one, wanted)
            poses.append(one.pose)
        by_hand += [*poses, *to_a_stand(one)[1:]]
    assert len(points) == len(by_hand)
    for point, place in zip(points, by_hand, strict=True):
        assert point == pytest.approx(place[:2], abs=0.01)


def test_who_stands_and_was_told_nothing_needs_no_way_to_come_to_rest() -> None:
    safety, body = SafetyFilter(SETTINGS), DriveState(Pose(1.0, 2.0, 0.3), 0.0, 0.0)
    assert len(safety.braking(body)) == 0
    assert len(safety.braking(body, [(0.0, 0.0)] * 4)) == 0
    assert len(safety.braking(body, [(0.0, 0.0), (0.1, 0.0)])) > 0


def test_no_brake_is_longer_than_the_points_that_are_kept() -> None:
    late = [(1.6, 1.6)] * 10
    points = SafetyFilter(SETTINGS).braking(DriveState(Pose(0.0, 0.0, 0.0), 1.6, 1.6), late)
    assert len(points) < (len(late) + 1) * LONGEST
    assert points[:, 0].max() == pytest.approx(told(DriveState(Pose(0.0, 0.0, 0.0), 1.6, 1.6), (1.6, 1.6), 10)[-1].x)


@given(pose=inside, now=rims, wanted=rims)
def test_the_room_in_held_cells_is_that_of_a_way_stepped_by_hand(
    pose: Pose, now: tuple[float, float], wanted: tuple[float, float]
) -> None:
    cells = FREE.cells
    held = tuple(cells.columns + 4 + step for step in range(4))
    x, y = cells.centre(held[1])
    body = DriveState(Pose(x + pose.x, y + pose.y, pose.yaw), *now)
    boxes = Aiming(cells, RADIUS).shut_boxes(held)
    got = path_room(boxes, *body.pose, *now, *wanted, DRIVE.track_width, MOST, DT, TICKS)
    way = [body.pose, *told(body, wanted, TICKS)]
    least = min(min(one.x - x + 1.5 * SIDE, x + 2.5 * SIDE - one.x, SIDE / 2 - abs(one.y - y)) for one in way)
    assume(least > 0.0)
    assert got == pytest.approx(least, abs=0.01)


FAST = {"pose": Pose(-1.2, 0.0, 0.0), "tables": (1.6, 1.6)}
ASLANT = {"pose": Pose(-1.2, -0.2, 0.3), "tables": (1.6, 1.5)}


@given(pose=inside, tables=rims)
@example(**FAST)
@example(**ASLANT)
def test_however_fast_the_tables_are_it_brakes_inside_its_cells(pose: Pose, tables: tuple[float, float]) -> None:
    cells = FREE.cells
    held = tuple(cells.columns + 4 + step for step in range(4))
    x, y = cells.centre(held[1])
    body = DriveState(Pose(x + pose.x, y + pose.y, pose.yaw), 0.0, 0.0)
    outside = cells_as_shape(cells, set(range(len(cells))).difference(held))
    assume(room(outside, body.pose) > SAFETY.gap)
    aiming, safety = Aiming(cells, RADIUS), SafetyFilter(SETTINGS)
    for tick in range(60):
        limits = constraints(FREE_GRID, body.pose, aiming.shut_boxes(held))
        body = rolled(body, safety.check(sense_of(body, tick), tables, limits))
        assert room(outside, body.pose) > 0.0


@pytest.mark.parametrize("walled", [False, True], ids=["the edge of its cells", "a wall"])
@given(away=st.floats(0.3, 2.5), speed=st.floats(0.4, 1.2))
def test_it_slows_down_no_sooner_and_no_later_than_the_brake_needs(walled: bool, away: float, speed: float) -> None:
    """Straight on, the wheels as fast as the tables: the mildest remedy whose way, worked out by hand, stays clear."""
    (a,) = HALL.at("a")
    held = tuple(range(a, a + (8 if walled else 6)))  # all the hall, or a part of it
    x, y = HALL.cells.centre(a + (7 if walled else 5))
    edge = x + SIDE / 2
    body = DriveState(Pose(edge - away, y, 0.0), speed, speed)
    judge = solid(HALL.occupancy) if walled else cells_as_shape(HALL.cells, [held[-1] + 1])
    shares: list[float] = SAFETY.remedies[:, 0].tolist()
    rooms = [
        min(room(judge, pose) for pose in told(body, (share * speed,) * 2, TICKS)) - SAFETY.gap for share in shares
    ]
    assume(min(map(abs, rooms)) > 0.02)  # a grid is not exact
    assume(room(judge, to_a_stand(body)[-1]) > SAFETY.gap)
    limits = constraints(
        HALL_GRID, body.pose, np.empty((0, 4)) if walled else Aiming(HALL.cells, RADIUS).shut_boxes(held)
    )
    speeds = SafetyFilter(SETTINGS).check(sense_of(body), (speed, speed), limits)
    mildest = next((share for share, left in zip(shares, rooms, strict=True) if left > 0.0), 0.0)
    assert speeds == pytest.approx((mildest * speed, mildest * speed))
