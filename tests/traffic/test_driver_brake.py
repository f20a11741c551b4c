"""The brake: what the driver plans with is what the wheels can do."""

from math import cos, pi, sin

import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from swarm.geometry import Pose, integrate
from swarm.planning.grid import Grid
from swarm.traffic.driver import LOOK, Body, Driver, Whose
from tests.traffic.driving import ACCELERATION, DRIVE, DT, MARGIN, RADIUS, driver
from tests.traffic.maps import DOOR, SIDE, Drawn

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
