"""The driver keeps the footprint in held cells whatever the tables say, and leaves them alone where it can."""

from collections import deque
from math import cos, hypot, pi, sin

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from swarm.geometry import Pose, Twist, integrate
from swarm.planning.grid import Grid
from swarm.robot.kinematics import DifferentialDrive
from swarm.traffic.driver import LOOK, Body, Driver, Whose, distance_along
from swarm.traffic.settings import NEAR, TrafficSettings
from swarm.traffic.sweep import braking_points, line_room, path_room
from tests.traffic.maps import BAY, DOOR, SIDE, Drawn

DT = 0.05  # s
ACCELERATION = 2.0  # m/s2, of a rim speed
DRIVE = DifferentialDrive(track_width=0.4, wheel_radius=0.05)
RADIUS, MARGIN = 0.2, 0.03


def driver(drawn: Drawn, grid: Grid | None = None) -> Driver:
    return Driver(
        drawn.cells, DRIVE, radius=RADIUS, margin=MARGIN, acceleration=ACCELERATION, dt=DT, fastest=0.6, grid=grid
    )


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


# --- the brake: what is planned with is what the wheels can do ---

rims = st.tuples(st.floats(-0.4, 1.6), st.floats(-0.4, 1.6))
inside = st.builds(Pose, st.floats(-1.5, 1.5), st.floats(-0.9, 0.9), st.floats(-pi, pi))
WALLED = Drawn("#######", "#.....#", "#..a..#", "#..#..#", "#.....#", "#######")
WALLED_GRID = Grid.grown(WALLED.occupancy, RADIUS, resolution=0.1)


def rolled(body: Body, wanted: tuple[float, float]) -> Body:
    """Let a tick pass by hand, the rim speeds ramping."""
    most = ACCELERATION * DT
    left = min(body.left + most, max(body.left - most, wanted[0]))
    right = min(body.right + most, max(body.right - most, wanted[1]))
    return Body(integrate(body.pose, DRIVE.twist(left, right), DT), left, right)


def to_a_stand(body: Body) -> list[Pose]:
    """Brake by hand: every pose from now until the wheels stand."""
    poses = [body.pose]
    while body.left or body.right:
        body = rolled(body, (0.0, 0.0))
        poses.append(body.pose)
    return poses


@given(pose=inside, now=rims)
def test_the_braking_path_that_traffic_keeps_cells_for_is_the_brake_of_the_wheels(
    pose: Pose, now: tuple[float, float]
) -> None:
    body = Body(pose, *now)
    by_hand = to_a_stand(body)[1:]
    points = driver(DOOR).braking(body)
    assert len(points) == len(by_hand)
    for (x, y), place in zip(points, by_hand, strict=True):
        assert (x, y) == pytest.approx((place.x, place.y), abs=0.01)


def drive_on(driving: Driver, body: Body, held: tuple[int, ...], tables: tuple[float, float], aim: float) -> list[Pose]:
    """Drive for three seconds towards an aim far away: nothing but the edge of the cells, or a wall, slows it."""
    poses = []
    for _ in range(60):
        x, y, _ = body.pose
        target = (x + 9.0 * cos(aim), y + 9.0 * sin(aim))
        wheels = driving.wheels(body, held, target, stop_at=9.0, tables=tables)
        body = rolled(body, (wheels.left, wheels.right))
        poses.append(body.pose)
    return poses


FAST = {"pose": Pose(-1.2, 0.0, 0.0), "tables": (1.6, 1.6), "aim": 0.0}
ASLANT = {"pose": Pose(-1.2, -0.2, 0.3), "tables": (1.6, 1.5), "aim": 0.3}


@given(pose=inside, tables=rims, aim=st.floats(-pi, pi))
@example(**FAST)
@example(**ASLANT)
def test_however_fast_the_tables_are_it_brakes_inside_its_cells(
    pose: Pose, tables: tuple[float, float], aim: float
) -> None:
    held = tuple(DOOR.at("a")[0] + step for step in range(4))
    x, y = DOOR.cells.centre(held[1])
    body = Body(Pose(x + pose.x, y + pose.y, pose.yaw), 0.0, 0.0)
    assume(DOOR.cells.fits(held, *body.pose[:2], RADIUS + MARGIN))
    for one in drive_on(driver(DOOR), body, held, tables, aim):
        assert DOOR.cells.fits(held, one.x, one.y, RADIUS)


@given(pose=inside, tables=rims, aim=st.floats(-pi, pi))
@example(**FAST)
@example(**ASLANT)
def test_however_fast_the_tables_are_it_brakes_before_a_wall(
    pose: Pose, tables: tuple[float, float], aim: float
) -> None:
    cells = WALLED.cells
    everywhere = tuple(range(len(cells)))
    x, y = cells.centre(WALLED.at("a")[0])
    body = Body(Pose(x + pose.x, y + pose.y, pose.yaw), 0.0, 0.0)
    assume(cells.fits(everywhere, *body.pose[:2], RADIUS + 0.08))
    for one in drive_on(driver(WALLED, WALLED_GRID), body, everywhere, tables, aim):
        assert cells.fits(everywhere, one.x, one.y, RADIUS)


def ahead_by_hand(now: float, wanted: float) -> float:
    """How far a body rolls straight on [m] that is told a speed for as long as is looked ahead, and then to stop."""
    body, ticks = Body(Pose(0.0, 0.0, 0.0), now, now), round(LOOK / DT)
    for _ in range(ticks):
        body = rolled(body, (wanted, wanted))
    return to_a_stand(body)[-1].x


HALL = Drawn("##########", "#a.......#", "##########")
HALL_GRID = Grid.grown(HALL.occupancy, RADIUS, resolution=0.1)


@pytest.mark.parametrize("walled", [False, True], ids=["the edge of its cells", "a wall"])
@given(away=st.floats(0.3, 2.5), speed=st.floats(0.4, 1.2))
def test_it_slows_down_no_sooner_and_no_later_than_the_brake_needs(walled: bool, away: float, speed: float) -> None:
    """Straight on, the wheels as fast as the tables: the mildest change whose way, worked out by hand, stays clear."""
    a = HALL.at("a")[0]
    held = tuple(range(a, a + (10 if walled else 6)))  # up to the wall's own cells, or short of them
    x, y = HALL.cells.centre(a + (7 if walled else 5))
    edge = x + SIDE / 2
    body = Body(Pose(edge - away, y, 0.0), speed, speed)
    clear = [away - ahead_by_hand(speed, share * speed) - (RADIUS + MARGIN) for share in (1.0, 0.7, 0.45)]
    assume(min(map(abs, clear)) > 0.02)  # a grid is not exact
    assume(away - to_a_stand(body)[-1].x + body.pose.x > RADIUS + MARGIN)
    wheels = driver(HALL, HALL_GRID if walled else None).wheels(
        body, held, (edge + 9.0, y), stop_at=9.0, tables=(speed, speed)
    )
    mildest = next((share for share, room in zip((1.0, 0.7, 0.45), clear, strict=True) if room > 0.0), None)
    if mildest is None:
        assert wheels.left <= 0.45 * speed or wheels.whose is Whose.BLEND
    else:
        assert (wheels.left, wheels.right) == pytest.approx((mildest * speed, mildest * speed))
        assert wheels.whose is Whose.TABLES


@given(pose=inside, now=rims, wanted=rims)
def test_the_room_in_held_cells_is_that_of_a_way_stepped_by_hand(
    pose: Pose, now: tuple[float, float], wanted: tuple[float, float]
) -> None:
    held = tuple(DOOR.at("a")[0] + step for step in range(4))
    x, y = DOOR.cells.centre(held[1])
    body = Body(Pose(x + pose.x, y + pose.y, pose.yaw), *now)
    room = driver(DOOR).room_in(body.pose, held)(now, wanted)
    way = [body.pose]
    for _ in range(round(LOOK / DT)):
        body = rolled(body, wanted)
        way.append(body.pose)
    way += to_a_stand(body)
    least = min(min(one.x - x + 1.5 * SIDE, x + 2.5 * SIDE - one.x, SIDE / 2 - abs(one.y - y)) for one in way)
    assume(least > 0.0)
    assert room == pytest.approx(least, abs=0.01)


@given(pose=inside, now=rims, tables=rims, aim=st.floats(-pi, pi), stop_at=st.floats(0.05, 3.0))
def test_whose_speeds_they_are_is_told_truly(
    pose: Pose, now: tuple[float, float], tables: tuple[float, float], aim: float, stop_at: float
) -> None:
    """A blend is never called the tables' own: their ratio is kept to the last bit, or it is somebody else's."""
    held = tuple(DOOR.at("a")[0] + step for step in range(4))
    x, y = DOOR.cells.centre(held[1])
    body = Body(Pose(x + pose.x, y + pose.y, pose.yaw), *now)
    target = (body.pose.x + 9.0 * cos(aim), body.pose.y + 9.0 * sin(aim))
    wheels = driver(DOOR).wheels(body, held, target, stop_at=stop_at, tables=tables)
    if wheels.whose is Whose.TABLES:
        assert wheels.left * tables[1] == pytest.approx(wheels.right * tables[0], abs=1e-9)
        assert abs(wheels.left) <= abs(tables[0]) + 1e-9
        assert abs(wheels.right) <= abs(tables[1]) + 1e-9
    if wheels.whose is Whose.TURN:
        assert wheels.left == pytest.approx(-wheels.right)
    if wheels.whose is Whose.REST:
        assert wheels.left == wheels.right == 0.0
