"""The driver keeps the footprint in held cells whatever the tables say, and leaves them alone where it can."""

from collections import deque
from dataclasses import replace
from math import cos, hypot, pi, sin

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from swarm.geometry import Pose, Twist, from_frame, integrate
from swarm.planning.grid import Grid
from swarm.traffic.cells import CellMap
from swarm.traffic.driver import CAREFUL, CHANGES, DETOURS, STILL_FAST, Body, Whose, distance_along
from swarm.traffic.settings import NEAR, TrafficSettings
from swarm.traffic.sweep import braking_points, line_room, path_room
from tests.traffic.driving import ACCELERATION, DRIVE, DT, MARGIN, RADIUS, driver, driver_on
from tests.traffic.maps import BAY, DOOR, SIDE


@given(
    x=st.floats(-0.3, 0.3),
    y=st.floats(-0.3, 0.3),
    yaw=st.floats(-pi, pi),
    speeds=st.lists(st.tuples(st.floats(-0.2, 1.6), st.floats(-0.2, 1.6)), min_size=20, max_size=60),
)
def test_no_wheel_speeds_lead_out_of_the_held_cells(
    x: float, y: float, yaw: float, speeds: list[tuple[float, float]]
) -> None:
    """Whatever the tables ask for, tick after tick, wheels ramping: the disc stays inside."""
    a = DOOR.at("a")[0]
    held = (a, a + 1, a + 1 + DOOR.cells.columns)
    centre = DOOR.cells.centre(a)
    driving = driver(DOOR)
    body = Body(Pose(centre[0] + x, centre[1] + y, yaw), 0.0, 0.0)
    waypoints = [DOOR.cells.centre(cell) for cell in held]
    for tables in speeds:
        aim = driving.aim(body.pose, held, waypoints)
        wheels = driving.wheels(body, held, aim, stop_at=distance_along(body.pose, waypoints), tables=tables)
        most = ACCELERATION * DT
        left = min(body.left + most, max(body.left - most, wheels.left))
        right = min(body.right + most, max(body.right - most, wheels.right))
        body = Body(integrate(body.pose, DRIVE.twist(left, right), DT), left, right)
        assert DOOR.cells.fits(held, body.pose.x, body.pose.y, RADIUS)


@given(
    late=st.integers(0, 5),
    yaw=st.floats(-pi, pi),
    pull=st.floats(-0.4, 0.4),
    x=st.floats(-0.3, 0.3),
    y=st.floats(-0.3, 0.3),
)
@example(late=4, yaw=pi, pull=0.0, x=0.3, y=0.0)
def test_it_comes_to_stand_at_its_last_point_though_commands_come_late(
    late: int, yaw: float, pull: float, x: float, y: float
) -> None:
    """Up to a quarter of a second: as on a machine that is busy, or over a radio; and to tables that pull aside."""
    a = DOOR.at("a")[0]
    held = (a, a + 1)
    here, there = (DOOR.cells.centre(cell) for cell in held)
    aim = (there[0] + x, there[1] + y)
    driving = driver(DOOR)
    body = Body(Pose(*here, yaw), 0.0, 0.0)
    underway = deque([(0.0, 0.0)] * late)
    for _ in range(1200):
        waypoints = [here, aim]
        wheels = driving.wheels(
            body,
            held,
            driving.aim(body.pose, held, waypoints),
            stop_at=distance_along(body.pose, waypoints),
            tables=(0.6 - pull, 0.6 + pull),
        )
        underway.append((wheels.left, wheels.right))
        if not any(map(any, underway)) and not body.left and not body.right:
            break
        left, right = underway.popleft()
        most = ACCELERATION * DT
        left = min(body.left + most, max(body.left - most, left))
        right = min(body.right + most, max(body.right - most, right))
        body = Body(integrate(body.pose, DRIVE.twist(left, right), DT), left, right)
    assert hypot(body.pose.x - aim[0], body.pose.y - aim[1]) < 0.1


def test_tables_pass_unchanged_where_there_is_room() -> None:
    a = DOOR.at("a")[0]
    held = (a, a + 1, a + 2)
    start = DOOR.cells.centre(a)
    wheels = driver(DOOR).wheels(
        Body(Pose(*start, 0.0), 0.4, 0.4), held, DOOR.cells.centre(a + 2), stop_at=2.4, tables=(0.5, 0.55)
    )
    assert (wheels.left, wheels.right, wheels.whose) == (0.5, 0.55, Whose.TABLES)


def test_it_slows_before_its_last_point_and_keeps_the_ratio() -> None:
    a = DOOR.at("a")[0]
    start = DOOR.cells.centre(a)
    wheels = driver(DOOR).wheels(
        Body(Pose(*start, 0.0), 0.4, 0.4), (a, a + 1), (start[0] + 0.2, start[1]), stop_at=0.1, tables=(0.8, 0.9)
    )
    assert wheels.whose is Whose.TABLES
    assert wheels.right < 0.6
    assert wheels.left / wheels.right == pytest.approx(0.8 / 0.9)


def test_it_turns_on_the_spot_when_it_faces_away() -> None:
    a = DOOR.at("a")[0]
    start = DOOR.cells.centre(a)
    aim = DOOR.cells.centre(a + 1)
    wheels = driver(DOOR).wheels(Body(Pose(*start, pi / 2), 0.0, 0.0), (a, a + 1), aim, stop_at=1.2, tables=(0.6, 0.6))
    assert wheels.whose is Whose.TURN
    assert wheels.left == -wheels.right > 0


def test_it_aims_no_farther_than_a_straight_way_goes() -> None:
    a = DOOR.at("a")[0]
    columns = DOOR.cells.columns
    held = (a, a + 1, a + 1 - columns)
    waypoints = [DOOR.cells.centre(cell) for cell in held]
    assert driver(DOOR).aim(Pose(*waypoints[0], 0.0), held, waypoints) == waypoints[1]
    stairs = (*held, a + 2 - columns)
    points = [*waypoints, DOOR.cells.centre(stairs[-1])]
    assert driver(DOOR).aim(Pose(*waypoints[1], 0.0), stairs, points) == points[2]


def test_near_a_corner_it_aims_between_its_waypoints_and_not_back() -> None:
    a = DOOR.at("a")[0] + 2
    columns = DOOR.cells.columns
    held = (a, a - columns)
    here, there = (DOOR.cells.centre(cell) for cell in held)
    pose = Pose(here[0] - 0.54, here[1] - 0.26, -pi / 2)  # beside the corner that it has to drive round
    x, y = driver(DOOR).aim(pose, (a - 1, *held), (here, there))
    assert x == pytest.approx(here[0])
    assert there[1] < y < here[1]


@given(angle=st.floats(-pi, pi), x=st.floats(-1.0, 1.0), y=st.floats(-1.0, 1.0))
def test_who_stands_as_near_its_place_as_it_has_to_touches_no_other_cell(angle: float, x: float, y: float) -> None:
    settings = TrafficSettings(radius=RADIUS, margin=MARGIN)
    a = DOOR.at("a")[0] + 2
    middle = DOOR.cells.centre(a)
    place = DOOR.cells.moved_inside(a, (middle[0] + x, middle[1] + y), settings.standing_room)
    stands = (place[0] + NEAR * cos(angle), place[1] + NEAR * sin(angle))
    assert DOOR.cells.touched(*stands, RADIUS + MARGIN) == (a,)


def test_walls_inside_held_cells_are_kept_clear_of() -> None:
    grid = Grid.grown(BAY.occupancy, RADIUS, resolution=0.1)
    a = BAY.at("a")[0]
    held = tuple(range(len(BAY.cells)))  # held or not, walls are walls
    x, y = BAY.cells.centre(a + 1)
    body = Body(Pose(x, y + 0.2, 1.0), 0.6, 0.6)
    aim = (x + 1.0, y + 0.6)
    free, walled = (
        driver(BAY, known).wheels(body, held, aim, stop_at=2.4, tables=(0.8, 0.8)) for known in (None, grid)
    )
    assert free.left == 0.8
    assert walled.left < 0.5


@given(left=st.floats(-1, 1), right=st.floats(-1, 1), yaw=st.floats(-pi, pi))
def test_the_braking_path_is_what_the_wheels_drive(left: float, right: float, yaw: float) -> None:
    points = braking_points(1.0, 2.0, yaw, left, right, DRIVE.track_width, ACCELERATION, DT)
    pose, most = Pose(1.0, 2.0, yaw), ACCELERATION * DT
    for x, y in points.tolist():
        left -= min(most, max(-most, left))
        right -= min(most, max(-most, right))
        twist: Twist = DRIVE.twist(left, right)
        straight = integrate(pose, twist, DT)
        assert (x, y) == pytest.approx((straight.x, straight.y), abs=0.01)
        pose = straight
    assert left == right == 0.0


def test_rooms_are_distances_to_boxes() -> None:
    boxes = np.array([[1.0, -1.0, 2.0, 1.0]])
    assert line_room(boxes, 0.0, 0.0, 0.5, 0.0) == pytest.approx(0.5)
    assert path_room(boxes, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.4, 0.1, 0.05, 8) == pytest.approx(1.0)
    assert path_room(boxes, 0.0, 0.0, 0.0, 0.5, 0.5, 0.5, 0.5, 0.4, 0.1, 0.05, 8) < 0.8


# --- how it chooses ---


def test_changes_go_from_mild_to_strong_and_detours_from_near_to_far() -> None:
    shares, blends = CHANGES[:, 0], CHANGES[:, 1]
    assert tuple(CHANGES[0]) == (1.0, 0.0), "nothing is changed where nothing has to be"
    assert ((shares > 0.0) & (shares <= 1.0) & (blends >= 0.0) & (blends <= 1.0)).all()
    assert blends[-1] == 1.0, "the last ones lead to the aim"
    assert len({tuple(change) for change in CHANGES.tolist()}) == len(CHANGES)
    assert list(DETOURS) == sorted(DETOURS, key=lambda off: (abs(off), -off))
    assert set(DETOURS) == {-off for off in DETOURS}, "to both sides"
    assert max(DETOURS) < pi / 2, "none leads back"


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_tables_that_would_lead_out_of_its_cells_are_bent_towards_the_aim(side: float) -> None:
    a = BAY.at("a")[0]
    x, y = BAY.cells.centre(a)
    blends = 0
    for yaw in np.arange(0.1, 1.05, 0.05) * side:
        body = Body(Pose(x, y + 0.25 * side, yaw), 0.3, 0.3)  # near the edge already
        wheels = driver(BAY).wheels(body, (a, a + 1), (x + SIDE, y), stop_at=SIDE, tables=(0.9, 0.9))
        if wheels.whose is Whose.BLEND:
            blends += 1
            assert (wheels.right - wheels.left) * side < 0.0, "back from where it heads"
    assert blends > 5


def test_who_faced_its_aim_while_it_turned_fast_drives_with_care_for_a_while() -> None:
    """Its commands came late: it then turns no faster than it can settle. After a while it is trusted again."""
    driving, (a,) = driver(BAY), BAY.at("a")
    x, y = BAY.cells.centre(a)
    aim = (x + 1.0, y)

    def turn(error: float, angular: float = 0.0) -> float:
        body = Body(Pose(x, y, -error), *DRIVE.rim_speeds(Twist(0.0, angular)))
        wheels = driving.wheels(body, (a, a + 1), aim, stop_at=1.0, tables=(0.3, 0.3))
        return DRIVE.twist(wheels.left, wheels.right).angular

    trusted = turn(2.0), turn(0.3)
    turn(0.0, STILL_FAST + 0.1)  # it has turned past the point where it should have come to a stand
    careful = turn(2.0), turn(0.3)
    assert careful[1] < trusted[1] - 0.1
    rates = [turn(0.3) for _ in range(2 * round(CAREFUL / DT))]
    lasts = sum(rate == pytest.approx(careful[1]) for rate in rates)
    assert lasts == round(CAREFUL / DT) - 3, "the two turns before, and the tick in which it was late, count too"
    assert rates[-1] == pytest.approx(trusted[1])


@given(
    pose=st.builds(Pose, st.floats(-0.5, 1.7), st.floats(-0.3, 0.3), st.floats(-pi, pi)),
    tables=st.tuples(st.floats(0.0, 1.6), st.floats(0.0, 1.6)),
    origin=st.builds(Pose, st.floats(-30.0, 30.0), st.floats(-30.0, 30.0), st.floats(-pi, pi)),
)
def test_on_a_floor_that_lies_elsewhere_and_turned_it_drives_the_same(
    pose: Pose, tables: tuple[float, float], origin: Pose
) -> None:
    """Beside a wall, on the way from one cell to the next but one."""
    a = BAY.at("a")[0]
    x, y = BAY.cells.centre(a)
    held, driven = (a, a + 1, a + 2), []
    for lies in (Pose(0.0, 0.0, 0.0), origin):
        floor = replace(BAY.occupancy, origin=lies)
        driving = driver_on(CellMap(floor, side=SIDE, radius=0.23), Grid.grown(floor, RADIUS, resolution=0.1))
        body = Body(Pose(*from_frame(lies, x + pose.x, y + pose.y), pose.yaw + lies.yaw), *tables)
        aim = from_frame(lies, x + 2 * SIDE, y)
        driven.append(driving.wheels(body, held, aim, stop_at=2.0, tables=tables))
    assert driven[1][:2] == pytest.approx(driven[0][:2], abs=1e-3)
