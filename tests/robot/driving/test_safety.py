"""The safety filter, compared with shapely; its kernel, compared with plain Python."""

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from math import copysign, hypot, inf, nan, pi, sqrt

import msgspec
import numpy as np
import pytest
import shapely
from hypothesis import HealthCheck, assume, example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from swarm.geometry import Pose, Twist, distance, from_frame
from swarm.motion.drive import GRAZE, TIGHT, clearance_along, first_clear
from swarm.planning.grid import Grid
from swarm.robot.driving.aim import Aiming
from swarm.robot.driving.safety import NO_BODIES, STAND, DriveState, SafetyFilter
from swarm.robot.tuning import SAFETY
from swarm.traffic.settings import NEAR
from tests.robot.driving.shared import (
    ACCELERATION,
    DRIVE,
    DT,
    MOST,
    NO_BOXES,
    RADIUS,
    ROBOT,
    SETTINGS,
    TOP,
    cells_as_shape,
    constraints,
    footprint,
    rolled,
    room,
    sense_of,
    solid,
    told,
)
from tests.shared import scenario_of
from tests.traffic.maps import DOOR, SIDE, Drawn

TEXT = """\
############
#..........#
#..#...oo..#
#..#.......#
#......#...#
#.o....#...#
#..........#
############
"""
FLOOR = scenario_of(TEXT).map
GRID = Grid.grown(FLOOR, RADIUS, 0.8, 0.1)
SOLID = solid(FLOOR)
HALL = scenario_of("#" * 30 + "\n" + ("#" + "." * 28 + "#\n") * 20 + "#" * 30 + "\n").map
WIDE = Grid.grown(HALL, RADIUS, 0.8, 0.1)
MIDDLE = Pose(15.0, 10.0, 0.5)
TICKS = round(SAFETY.look / DT)

Speeds = tuple[float, float]
wishes = st.tuples(st.floats(0.0, TOP), st.floats(0.0, TOP))
starts = st.builds(Pose, st.floats(1.3, 10.7), st.floats(1.3, 6.7), st.floats(-pi, pi, exclude_min=True))


def at_rest(pose: Pose) -> DriveState:
    return DriveState(pose, 0.0, 0.0)


def twist_of(speeds: Speeds) -> Twist:
    return DRIVE.twist(*speeds)


# --- whatever the tables say ---


@settings(suppress_health_check=[HealthCheck.filter_too_much])
@given(starts, st.lists(wishes, min_size=1, max_size=12), st.lists(st.integers(1, 25), min_size=12, max_size=12))
def test_whatever_the_tables_say_no_wall_is_touched(pose: Pose, wished: list[Speeds], lengths: list[int]) -> None:
    assume(room(SOLID, pose) > 0.05)
    safety, body, tick = SafetyFilter(SETTINGS), at_rest(pose), 0
    for wish, length in zip(wished, lengths, strict=False):
        for _ in range(length):
            body = rolled(body, safety.check(sense_of(body, tick), wish, constraints(GRID, body.pose)))
            tick += 1
            assert room(SOLID, body.pose) > 0.0, f"tick {tick}: touches at {body.pose}"


WALLED = Drawn("#######", "#.....#", "#..a..#", "#..#..#", "#.....#", "#######")
WALLED_GRID = Grid.grown(WALLED.occupancy, RADIUS, resolution=0.1)
A = WALLED.at("a")[0]
HELD = (A - 1, A, A + 1, A + 1 - WALLED.cells.columns)  # round a corner of the wall below a
WITHIN = cells_as_shape(WALLED.cells, HELD)
WALLS = solid(WALLED.occupancy)
STANDING = (A - 1, A + 1 - WALLED.cells.columns)
OTHERS = np.array([(*WALLED.cells.centre(cell), RADIUS) for cell in STANDING])  # m, they stand
OTHERS_SHAPE = shapely.union_all([shapely.Point(x, y).buffer(radius, quad_segs=32) for x, y, radius in OTHERS.tolist()])

Tables = Callable[[np.random.Generator, int], Speeds]
# fmt: off
ADVERSARIES: dict[str, Tables] = {
    "full speed":        lambda dice, tick: (TOP, TOP),
    "backwards":         lambda dice, tick: (-TOP, -TOP),
    "hard left":         lambda dice, tick: (0.0, TOP),
    "hard right":        lambda dice, tick: (TOP, 0.0),
    "a wide curve":      lambda dice, tick: (0.75 * TOP, TOP),
    "wheels swapped":    lambda dice, tick: (TOP, 0.3) if tick // 17 % 2 else (0.3, TOP),
    "random each tick":  lambda dice, tick: (dice.uniform(-TOP, TOP), dice.uniform(-TOP, TOP)),
    "random, forward":   lambda dice, tick: (dice.uniform(0.0, TOP), dice.uniform(0.0, TOP)),
    "not a number":      lambda dice, tick: (nan, TOP) if tick % 3 else (TOP, TOP),
    "infinite":          lambda dice, tick: (inf, -inf) if tick % 3 else (TOP, 0.8 * TOP),
    "huge":              lambda dice, tick: (1e300, 1e308) if tick % 2 else (1e300, -1e300),
}
# fmt: on


@pytest.mark.parametrize("name", ADVERSARIES)
@pytest.mark.parametrize("seed", range(6))
def test_no_tables_lead_out_of_the_held_cells_or_to_a_contact(name: str, seed: int) -> None:
    """Walls, cells that are not held and robots that stand in held ones, for 20 s."""
    dice = np.random.default_rng(seed)
    cells, safety = WALLED.cells, SafetyFilter(SETTINGS)
    aiming = Aiming(cells, RADIUS)
    x, y = cells.centre(A)
    body = at_rest(Pose(x + dice.uniform(-0.3, 0.3), y + dice.uniform(-0.3, 0.3), dice.uniform(-pi, pi)))
    for tick in range(400):
        limits = constraints(WALLED_GRID, body.pose, aiming.shut_boxes(HELD), OTHERS)
        body = rolled(body, safety.check(sense_of(body, tick), ADVERSARIES[name](dice, tick), limits))
        assert shapely.contains(WITHIN, footprint(body.pose)), f"tick {tick}: out of its cells at {body.pose}"
        assert room(WALLS, body.pose) > 0.0, f"tick {tick}: touches a wall at {body.pose}"
        assert room(OTHERS_SHAPE, body.pose) > 0.0, f"tick {tick}: touches a robot at {body.pose}"


# fmt: off
NONE_AT_ALL: dict[str, Speeds] = {
    "left is no number": (nan, 0.3), "right is no number": (0.3, nan), "neither is": (nan, nan),
    "infinite": (inf, inf), "one is infinite": (0.3, inf), "both ways": (-inf, inf), "the sum overflows": (1e308, 1e308),
}
# fmt: on


@pytest.mark.parametrize("name", NONE_AT_ALL)
@pytest.mark.parametrize("speed", [0.0, 0.5])
def test_tables_that_give_no_number_make_it_stand(name: str, speed: float) -> None:
    body = DriveState(MIDDLE, speed, speed)
    assert SafetyFilter(SETTINGS).check(sense_of(body), NONE_AT_ALL[name], constraints(WIDE, MIDDLE)) == STAND


@given(starts, wishes, st.integers(0, 120))
def test_what_is_commanded_is_a_remedy(pose: Pose, wish: Speeds, ticks: int) -> None:
    """So whoever does not turn is not turned, however long it gets nowhere."""
    assume(room(SOLID, pose) > 0.05)
    safety, body = SafetyFilter(SETTINGS), at_rest(pose)
    linear, angular = twist_of(wish)
    known = [(share * linear, turn * angular) for share, turn in SAFETY.remedies.tolist()]
    known += [(0.0, 0.0)]
    for tick in range(ticks + 1):
        speeds = safety.check(sense_of(body, tick), wish, constraints(GRID, body.pose))
        assert any(twist_of(speeds) == pytest.approx(one, abs=1e-9) for one in known)
        body = rolled(body, speeds)


@pytest.mark.parametrize("wish", [(0.6, 0.6), (1.2, 0.4), (0.0, 0.5), (0.3, 0.7), (-0.2, 0.2)])
def test_with_room_around_the_tables_speeds_pass_unchanged(wish: Speeds) -> None:
    aiming, a = Aiming(DOOR.cells, RADIUS), DOOR.at("a")[0]
    free = constraints(WIDE, MIDDLE)
    assert SafetyFilter(SETTINGS).check(sense_of(DriveState(MIDDLE, *wish)), wish, free) == pytest.approx(
        wish, abs=1e-12
    )
    held = tuple(a + row * DOOR.cells.columns + column for row in (-1, 0, 1) for column in range(4))
    x, y = DOOR.cells.centre(a + 1)
    body = DriveState(Pose(x, y, 0.3), *wish)
    grid = Grid.grown(DOOR.occupancy, RADIUS, resolution=0.1)
    speeds = SafetyFilter(SETTINGS).check(sense_of(body), wish, constraints(grid, body.pose, aiming.shut_boxes(held)))
    assert speeds == pytest.approx(wish, abs=1e-12)


def test_the_remedies_go_from_mild_to_strong_and_end_with_turning_on_the_spot() -> None:
    remedies = SAFETY.remedies.tolist()
    assert remedies[0] == [1.0, 1.0], "nothing is changed where nothing has to be"
    assert remedies[-1] == [0.0, 1.0]
    assert all(0.0 <= share <= turn <= 1.0 for share, turn in remedies), "none widens a turn"
    arcs, tighter = [one for one in remedies if one[0] == one[1]], [one for one in remedies if one[0] < one[1]]
    assert remedies == [*arcs, *tighter], "the same arc comes first"
    for kind in (arcs, tighter):
        assert all(more[0] > less[0] for more, less in pairwise(kind))


# --- what it has to heed ---


def test_the_front_sensor_stops_it_though_the_map_is_free() -> None:
    wall_at, safety, body = 11.7, SafetyFilter(SETTINGS), at_rest(Pose(10.0, 10.0, 0.0))
    for tick in range(60):
        front = max(0.0, min(1.6, wall_at - RADIUS - body.pose.x))
        body = rolled(body, safety.check(sense_of(body, tick, front=front), (0.6, 0.6), constraints(WIDE, body.pose)))
        assert body.pose.x + RADIUS < wall_at
    gap = wall_at - RADIUS - body.pose.x
    assert SAFETY.front_gap / 2 < gap < 2 * SAFETY.front_gap, "it comes as near as it may"


@given(st.floats(0.0, 1.6), st.floats(0.1, TOP))
def test_the_brake_stops_it_before_what_the_front_sector_sees(front: float, wish: float) -> None:
    """It stands before the gap, and is not slower than that needs."""
    body = DriveState(MIDDLE, wish, wish)
    left, right = SafetyFilter(SETTINGS).check(sense_of(body, front=front), (wish, wish), constraints(WIDE, MIDDLE))
    assert left == pytest.approx(right)
    room_ahead = max(0.0, front - SAFETY.front_gap)
    assert left**2 / (2 * ACCELERATION) <= room_ahead + 1e-9
    fastest = sqrt(2 * ACCELERATION * room_ahead)
    if fastest > SAFETY.creep:
        assert left == pytest.approx(min(wish, fastest))


@given(st.floats(0.0, 2 * pi), wishes)
def test_another_robots_place_is_kept_clear_of(angle: float, wish: Speeds) -> None:
    other = (5.2, 2.5)
    pose = Pose(5.2 + 1.1 * np.cos(angle), 2.5 + 1.1 * np.sin(angle), (angle + 2 * pi) % (2 * pi) - pi)
    assume(room(SOLID, pose) > 0.05)
    body, safety = at_rest(pose), SafetyFilter(SETTINGS)
    for tick in range(60):
        limits = constraints(GRID, body.pose, bodies=np.array([(*other, RADIUS)]))
        body = rolled(body, safety.check(sense_of(body, tick), wish, limits))
        assert distance(body.pose, other) > 2 * RADIUS


def test_who_may_not_drive_may_turn() -> None:
    pose = Pose(5.2, 2.5, 0.0)
    for wish in ((0.6, 0.6), (0.2, 1.0)):
        limits = constraints(GRID, pose)._replace(may_drive=False)
        left, right = SafetyFilter(SETTINGS).check(sense_of(at_rest(pose)), wish, limits)
        assert left + right == pytest.approx(0.0)
        assert right - left == pytest.approx(wish[1] - wish[0])


@pytest.mark.parametrize("wish", [(0.6, 0.6), (0.2, 1.0), (1.0, 0.2)])
@pytest.mark.parametrize("forward", [1, -1])
def test_who_may_not_drive_brakes_with_both_wheels_before_it_turns(wish: Speeds, forward: int) -> None:
    pose = Pose(5.2, 2.5, 0.0)
    body, limits = DriveState(pose, 0.4 * forward, 0.4 * forward), constraints(GRID, pose)._replace(may_drive=False)
    assert SafetyFilter(SETTINGS).check(sense_of(body), wish, limits) == STAND


@pytest.mark.parametrize(("gap", "share"), [(1.0, 1.0), (0.3, 1.0), (0.2, 0.6), (0.12, 0.3), (0.05, 0.0)])
def test_a_way_out_keeps_its_turn_and_has_no_more_speed_than_the_gap_ahead_allows(gap: float, share: float) -> None:
    """At 0.6 m/s it drives about 0.24 m before it stands again, at 0.36 m/s 0.14 m, at 0.18 m/s 0.07 m."""
    ahead = np.array([(MIDDLE.x + RADIUS + gap, 0.0, MIDDLE.x + 2.0, 20.0)])
    body = at_rest(MIDDLE._replace(yaw=0.0))
    speeds = SafetyFilter(SETTINGS).limit_way_out(sense_of(body), Twist(0.6, 1.0), constraints(WIDE, body.pose, ahead))
    assert twist_of(speeds) == pytest.approx((0.6 * share, 1.0))


# --- many looks ---

CORRIDOR = scenario_of("#" * 42 + "\n" + ("#" + "." * 40 + "#\n") * 4 + "#" * 42 + "\n").map  # walls at y = 1 and 5
CORRIDOR_GRID = Grid.grown(CORRIDOR, RADIUS, 0.8, 0.1)
CORRIDOR_WALLS = solid(CORRIDOR)
BESIDE = np.array([(-9.0, 2.0, 99.0, 2.5)])  # cells beside it that are not held, and no wall


@pytest.mark.parametrize("what", ["a wall", "cells not held"])
@pytest.mark.parametrize("side", [1, -1])
@given(
    left=st.floats(0.0, 0.05),
    off=st.floats(-0.02, 0.1),
    wish=st.tuples(st.floats(0.1, 0.6), st.floats(-0.2, 0.2)),
)
@example(left=0.03, off=0.02, wish=(0.6, 0.0))
@example(left=0.011, off=0.005, wish=(0.6, 0.0))
@example(left=0.009, off=0.1, wish=(0.6, 0.0))
@settings(max_examples=30)
def test_many_looks_lose_no_clearance_below_what_is_tight(
    what: str, side: int, left: float, off: float, wish: Speeds
) -> None:
    """It drives along something, aslant to it, for 500 ticks: a little lost at each look would be a contact."""
    y = 1.0 + RADIUS + left if what == "a wall" else 2.5 + RADIUS + left
    pose = Pose(3.0, y, -off) if side > 0 else Pose(39.0, y, off - pi)
    judge = CORRIDOR_WALLS if what == "a wall" else shapely.union_all([shapely.box(*box) for box in BESIDE.tolist()])
    shut = NO_BOXES if what == "a wall" else BESIDE
    tables = (wish[0] - wish[1] / 2, wish[0] + wish[1] / 2)
    safety, body, began = SafetyFilter(SETTINGS), at_rest(pose), room(judge, pose)
    for tick in range(500):
        body = rolled(body, safety.check(sense_of(body, tick), tables, constraints(CORRIDOR_GRID, body.pose, shut)))
        assert room(judge, body.pose) >= min(began, TIGHT) - 1e-5, f"tick {tick}"


@pytest.mark.parametrize(("yaw", "side"), [(-pi / 4, 1), (-3 * pi / 4, -1)])
def test_the_freer_side_is_that_of_the_smaller_turn_away_from_a_wall(yaw: float, side: int) -> None:
    """The wall is below; the sensors see more room to the other side."""
    body = at_rest(Pose(20.0, 1.0 + RADIUS + 0.05, yaw))
    sense = sense_of(body, left=0.5, right=0.6) if side > 0 else sense_of(body, left=0.6, right=0.5)
    assert SafetyFilter(SETTINGS).freer_side(sense, constraints(CORRIDOR_GRID, body.pose)) == side


# --- coming to a stand ---


@pytest.mark.parametrize("slowly", [False, True])
@given(away=st.floats(0.2, 2.5), wish=st.floats(0.2, TOP), speed=st.floats(0.0, 1.0))
@settings(max_examples=40)
def test_it_stands_no_farther_on_than_it_is_told(slowly: bool, away: float, wish: float, speed: float) -> None:
    """Straight on, as fast as the tables like: the way to the place is a line."""
    start = Pose(10.0, 10.0, 0.0)
    stop = away + speed**2 / (2 * ACCELERATION) + speed * DT  # m; nearer than that it could not stop at all
    safety, body = SafetyFilter(SETTINGS), DriveState(start, speed, speed)
    for tick in range(400):
        left = stop - (body.pose.x - start.x)
        limits = constraints(WIDE, body.pose)._replace(stop_within=max(0.0, left), slowly=slowly)
        speeds = STAND if left <= NEAR else safety.check(sense_of(body, tick), (wish, wish), limits)
        body = rolled(body, speeds)
        if speeds == STAND and body.left == body.right == 0.0:
            break
    left = stop - (body.pose.x - start.x)
    assert left > -NEAR, "it does not drive past"
    assert left <= NEAR, "and it comes there"
    assert not slowly or left > -NEAR / 2, "to the very place"


def test_told_to_come_slowly_it_turns_the_more_tightly_the_nearer_it_is() -> None:
    """Tables that pull aside: the same yaw rate with less and less speed."""
    wish, body = (0.5, 0.7), at_rest(MIDDLE)
    rates, speeds = [], []
    for within in (1.0, 0.5, 0.2, 0.1):
        limits = constraints(WIDE, MIDDLE)._replace(stop_within=within, slowly=True)
        twist = twist_of(SafetyFilter(SETTINGS).check(sense_of(body), wish, limits))
        speeds.append(twist.linear)
        rates.append(twist.angular)
    assert rates == pytest.approx([twist_of(wish).angular] * 4)
    assert all(nearer < farther for farther, nearer in pairwise(speeds[1:]))


@pytest.mark.parametrize(
    ("within", "slowly", "speed"), [(0.5, True, 0.4), (0.1, True, 0.08), (0.15, False, 0.6), (0.0, False, 0.0)]
)
def test_the_speed_before_a_place_is_that_of_a_gentle_brake_or_eight_tenths_of_the_way_per_second(
    within: float, slowly: bool, speed: float
) -> None:
    """The gentle brake has 0.6 * 2 m/s2: v^2 = 2 * 1.2 * s."""
    robot = msgspec.structs.replace(ROBOT, wheel_acceleration=2.0)
    safety = SafetyFilter(msgspec.structs.replace(SETTINGS, robot=robot))
    limits = constraints(WIDE, MIDDLE)._replace(stop_within=within, slowly=slowly)
    assert safety.check(sense_of(at_rest(MIDDLE)), (1.0, 1.0), limits) == pytest.approx((speed, speed))


# --- turning to face something ---


@pytest.mark.parametrize(("error", "keeps"), [(2.59, False), (2.61, True)])
def test_from_149_degrees_on_it_keeps_the_side_that_it_turns_to(error: float, keeps: bool) -> None:
    safety = SafetyFilter(SETTINGS)
    assert safety.face(at_rest(MIDDLE), 1.0).right > 0.0
    assert (safety.face(at_rest(MIDDLE), -error).right > 0.0) is keeps


@pytest.mark.parametrize(
    ("linear", "turns"), [(0.0, True), (0.019, True), (0.021, False), (-0.019, True), (-0.021, False)]
)
def test_to_face_something_it_brakes_first(linear: float, turns: bool) -> None:
    speeds = SafetyFilter(SETTINGS).face(DriveState(MIDDLE, linear - 0.1, linear + 0.1), 1.0)
    assert (speeds != STAND) is turns
    assert speeds.left == pytest.approx(-speeds.right)


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize(
    ("error", "rate"), [(0.03, 0.0), (0.035, 0.0), (0.135, 1.0), (0.26, 1.5), (0.8, 2.5), (3.0, 2.5)]
)
def test_a_turn_ends_with_six_tenths_of_the_brake(side: float, error: float, rate: float) -> None:
    """A track of 0.48 m and 2 m/s2 at the rims: 8.33 rad/s2, of which 5 are used; r^2 = 2 * 5 * (e - 0.035)."""
    robot = msgspec.structs.replace(ROBOT, track_width=0.48, wheel_acceleration=2.0)
    speeds = SafetyFilter(msgspec.structs.replace(SETTINGS, robot=robot)).face(at_rest(MIDDLE), side * error)
    assert speeds == pytest.approx((-0.24 * side * rate, 0.24 * side * rate), abs=1e-9)


@given(st.floats(-pi, pi))
def test_to_face_something_it_turns_the_short_way(error: float) -> None:
    assume(abs(error) > SAFETY.turn_until)
    left, right = SafetyFilter(SETTINGS).face(at_rest(MIDDLE), error)
    assert left == -right
    assert copysign(1.0, right) == copysign(1.0, error)
    assert twist_of((left, right)).angular <= SAFETY.turn_rate + 1e-9


@given(st.floats(-pi, pi), st.floats(-pi, pi))
def test_it_comes_to_stand_facing_what_it_is_told_to(yaw: float, there: float) -> None:
    safety, body = SafetyFilter(SETTINGS), at_rest(MIDDLE._replace(yaw=yaw))
    turned = 0.0
    for _ in range(round(5.0 / DT)):
        error = (there - body.pose.yaw + pi) % (2 * pi) - pi
        body = rolled(body, safety.face(body, error))
        turned += abs(DRIVE.twist(body.left, body.right).angular) * DT
    assert abs((there - body.pose.yaw + pi) % (2 * pi) - pi) < SAFETY.turn_until
    assert turned < pi + 2 * SAFETY.turn_until, "never round and round"


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_nearly_opposite_it_keeps_the_side_that_it_turns_to(side: float) -> None:
    """What is measured jumps between left and right there."""
    safety = SafetyFilter(SETTINGS)
    first = safety.face(at_rest(MIDDLE), side * (SAFETY.half_turn + 0.1))
    again = safety.face(at_rest(MIDDLE), -side * (SAFETY.half_turn + 0.2))
    assert copysign(1.0, again.right) == copysign(1.0, first.right) == side
    back = safety.face(at_rest(MIDDLE), -side * (SAFETY.half_turn - 0.1))
    assert copysign(1.0, back.right) == -side, "nearer than that the short way is the short way"


@given(st.floats(-pi, pi), st.sampled_from([0.3, -0.3]))
def test_it_brakes_before_it_turns_to_face_something(error: float, speed: float) -> None:
    safety, body = SafetyFilter(SETTINGS), DriveState(MIDDLE, speed, speed)
    while abs(DRIVE.twist(body.left, body.right).linear) > SAFETY.stands:
        speeds = safety.face(body, error)
        assert speeds == STAND
        body = rolled(body, speeds)
    assert abs(error) < SAFETY.turn_until or safety.face(body, error).right != 0.0


# --- the kernel ---


def gap_by_hand(boxes: list[list[float]], x: float, y: float) -> float:
    return min((hypot(max(a - x, x - c, 0.0), max(b - y, y - d, 0.0)) for a, b, c, d in boxes), default=inf)


def field_by_hand(grid: Grid, x: float, y: float) -> float:
    """Read the clearance between the four middles of cells about a point."""
    along, up = (part - 0.5 for part in grid.to_cells(x, y))
    row, column = int(np.floor(up)), int(np.floor(along))
    u, v = up - row, along - column
    (a, b), (c, d) = grid.clearance[row : row + 2, column : column + 2].astype(float).tolist()
    return float((1 - u) * ((1 - v) * a + v * b) + u * ((1 - v) * c + v * d))


def rooms_by_hand(
    grid: Grid, boxes: list[list[float]], bodies: list[list[float]], pose: Pose
) -> tuple[float, float, float]:
    """Return a centre's distances [m] to cells, walls and bodies: the lattice lies as the map does."""
    nearest = min((distance(pose, tuple(body)) - RADIUS for body in bodies), default=inf)
    return gap_by_hand(boxes, *pose[:2]), field_by_hand(grid, *pose[:2]), nearest


def first_by_hand(
    grid: Grid, boxes: list[list[float]], bodies: list[list[float]], body: DriveState, wanted: Speeds, fastest: float
) -> tuple[int, Speeds, float]:
    """Find the first clear remedy, and by how much [m] the nearest decision was made."""
    needs = [
        min(RADIUS + SAFETY.gap, max(here - GRAZE, min(here, RADIUS + TIGHT)))
        for here in rooms_by_hand(grid, boxes, bodies, body.pose)
    ]
    surest = inf
    for number, (share, turn) in enumerate(SAFETY.remedies.tolist()):
        forward, rate = share * wanted[0], turn * wanted[1]
        if forward > fastest:
            if share == turn:
                if fastest < SAFETY.creep:
                    continue
                rate *= fastest / forward
            forward = fastest
        speeds = DRIVE.rim_speeds(Twist(forward, rate))
        ways = [told(body, speeds, ticks) for ticks in (1, TICKS)]
        rooms = [rooms_by_hand(grid, boxes, bodies, pose) for way in ways for pose in way]
        spares = [min(leasts) - need for leasts, need in zip(zip(*rooms, strict=True), needs, strict=True)]
        surest = min(surest, *map(abs, spares))
        if min(spares) >= 0.0:
            return number, speeds, surest
    return -1, (0.0, 0.0), surest


rims = st.floats(-0.4, TOP)


@settings(suppress_health_check=[HealthCheck.filter_too_much])
@given(
    pose=st.builds(Pose, st.floats(1.5, 10.5), st.floats(1.5, 6.5), st.floats(-pi, pi)),
    now=st.tuples(rims, rims),
    wanted=st.tuples(st.floats(-0.5, TOP), st.floats(-4.0, 4.0)),
    fastest=st.sampled_from([inf, 0.5, 0.1, SAFETY.creep / 2, 0.0]),
    corners=st.lists(st.tuples(st.floats(0.0, 12.0), st.floats(0.0, 8.0)), max_size=4),
    others=st.lists(st.tuples(st.floats(0.0, 12.0), st.floats(0.0, 8.0)), max_size=3),
)
def test_the_first_clear_remedy_is_that_of_stepping_by_hand(
    pose: Pose,
    now: Speeds,
    wanted: Speeds,
    fastest: float,
    corners: list[Speeds],
    others: list[Speeds],
) -> None:
    boxes = [[x, y, x + SIDE, y + SIDE] for x, y in corners]
    bodies = [list(other) for other in others]
    discs = [[*other, RADIUS] for other in others]
    body = DriveState(pose, *now)
    assume(room(SOLID, pose) > 0.0)
    assume(max(distance(pose, one) for one in told(body, now, TICKS)) < 1.4)  # it stays within the map
    number, speeds, sure = first_by_hand(GRID, boxes, bodies, body, wanted, fastest)
    assume(sure > 2e-4)  # the kernel takes the chord of a step for its arc, as short as it is
    got, left, right = first_clear(
        SAFETY.remedies, *wanted, fastest, SAFETY.creep, RADIUS + SAFETY.gap, np.array(boxes, np.float64).reshape(-1, 4), *pose,
        GRID.clearance, GRID.resolution, *GRID.origin, np.array(discs, np.float64).reshape(-1, 3), RADIUS,
        *pose, *now, DRIVE.track_width, MOST, DT, TICKS,
    )  # fmt: skip
    assert got == number
    assert (left, right) == pytest.approx(speeds)


def clearance(grid: Grid, body: DriveState, wanted: Speeds, bodies: NDArray[np.float64], ticks: int) -> float:
    rooms = clearance_along(
        grid.clearance, grid.resolution, *grid.origin, bodies, *body.pose, body.left, body.right, *wanted,
        DRIVE.track_width, MOST, DT, ticks,
    )  # fmt: skip
    return min(rooms)


@given(starts, wishes, wishes, st.integers(1, 12))
def test_the_clearance_along_a_way_is_that_of_stepping_by_hand(
    pose: Pose, now: Speeds, wanted: Speeds, ticks: int
) -> None:
    poses = told(DriveState(pose, *now), wanted, ticks)
    expected = min(room(SOLID, place) + RADIUS for place in poses)
    assume(expected > 0.3)  # nearer than that the grid's clearance is a cell's, not a point's
    got = clearance(GRID, DriveState(pose, *now), wanted, NO_BODIES, ticks)
    assert got == pytest.approx(expected, abs=0.1)
    body = poses[len(poses) // 2]
    beside = clearance(GRID, DriveState(pose, *now), wanted, np.array([[body.x, body.y, 0.27]]), ticks)
    nearest = min(distance(place, body) for place in poses) - 0.27
    assert beside == pytest.approx(min(got, nearest), abs=2e-3)


origins = st.builds(Pose, st.floats(-30.0, 30.0), st.floats(-30.0, 30.0), st.floats(-pi, pi))


@given(starts, wishes, wishes, origins)
def test_on_a_floor_that_lies_elsewhere_and_turned_the_clearance_is_the_same(
    pose: Pose, now: Speeds, wanted: Speeds, origin: Pose
) -> None:
    there = Grid.grown(replace(FLOOR, origin=origin), RADIUS, 0.8, 0.1)
    moved = Pose(*from_frame(origin, pose.x, pose.y), pose.yaw + origin.yaw)
    here, elsewhere = (
        clearance(grid, DriveState(place, *now), wanted, NO_BODIES, 8) for grid, place in ((GRID, pose), (there, moved))
    )
    assert elsewhere == pytest.approx(here, abs=1e-4)


@given(
    pose=st.builds(Pose, st.floats(-0.5, 1.7), st.floats(-0.3, 0.3), st.floats(-pi, pi)), wish=wishes, origin=origins
)
def test_on_a_floor_that_lies_elsewhere_and_turned_it_drives_the_same(pose: Pose, wish: Speeds, origin: Pose) -> None:
    """Beside a wall, on the way from one cell to the next but one."""
    x, y = WALLED.cells.centre(A)
    held, boxes = (A, A + 1, A + 2), Aiming(WALLED.cells, RADIUS)
    here = Pose(x + pose.x, y + pose.y, pose.yaw)
    _, _, sure = first_by_hand(
        WALLED_GRID, boxes.shut_boxes(held).tolist(), [], DriveState(here, *wish), twist_of(wish), inf
    )
    assume(sure > 2e-4)
    driven = []
    for lies in (Pose(0.0, 0.0, 0.0), origin):
        floor = replace(WALLED.occupancy, origin=lies)
        aiming = Aiming(type(WALLED.cells)(floor, side=SIDE, radius=0.23), RADIUS)
        place = Pose(*from_frame(lies, here.x, here.y), here.yaw + lies.yaw)
        limits = constraints(Grid.grown(floor, RADIUS, resolution=0.1), place, aiming.shut_boxes(held))
        limits = limits._replace(local=aiming.to_lattice_frame(place))
        driven.append(SafetyFilter(SETTINGS).check(sense_of(DriveState(place, *wish)), wish, limits))
    assert driven[1] == pytest.approx(driven[0], abs=1e-6)
