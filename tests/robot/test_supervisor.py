"""What keeps a robot clear: the lookahead against stepping by hand, and the supervisor against shapely."""

from dataclasses import replace
from math import inf, pi

import msgspec
import numpy as np
import pytest
import shapely
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from swarm.geometry import Pose, distance, from_frame, integrate
from swarm.maps.occupancy import OBSTACLE, WALL, OccupancyMap
from swarm.messages import Sense
from swarm.planning.grid import Grid
from swarm.robot.kinematics import DifferentialDrive, ramp
from swarm.robot.lookahead import least_clearance
from swarm.robot.supervisor import ESCAPE, ESCAPED, GAP, HALTED, PATIENCE, REMEDIES, Supervisor
from tests.shared import scenario_of

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
SCENARIO = scenario_of(TEXT)
SETTINGS = SCENARIO.settings
RADIUS, DT = SETTINGS.robot.radius, 1.0 / SETTINGS.rate
MOST = SETTINGS.robot.wheel_acceleration * DT
DRIVE = DifferentialDrive(SETTINGS.robot.track_width, SETTINGS.robot.wheel_radius)
GRID = Grid.grown(SCENARIO.map, RADIUS, 0.8, 0.1)
HALL = scenario_of("#" * 30 + "\n" + ("#" + "." * 28 + "#\n") * 20 + "#" * 30 + "\n")
WIDE = Grid.grown(HALL.map, RADIUS, 0.8, 0.1)
TOP = 4.0 * SETTINGS.robot.speed_scale

wishes = st.tuples(st.floats(0.0, TOP), st.floats(0.0, TOP))
starts = st.builds(Pose, st.floats(1.3, 10.7), st.floats(1.3, 6.7), st.floats(-pi, pi, exclude_min=True))


def solid(floor: OccupancyMap) -> shapely.Geometry:
    """Everything solid as one shape, cell by cell, made from the drawing alone."""
    rows, columns = floor.shape
    return shapely.union_all(
        [
            shapely.box(column, row, column + 1, row + 1)
            for row in range(rows)
            for column in range(columns)
            if floor.cells[row, column] in {WALL, OBSTACLE}
        ]
    )


SOLID = solid(SCENARIO.map)


def gap(pose: Pose) -> float:
    """Gap between the footprint and whatever is solid [m]."""
    return float(shapely.distance(SOLID, shapely.Point(pose.x, pose.y))) - RADIUS


def sense_at(pose: Pose, wheels: tuple[float, float], tick: int) -> Sense:
    """A sense of a robot whose distance sensors see nothing: only the map keeps it clear."""
    twist = DRIVE.twist(*wheels)
    return Sense(
        run=0, tick=tick, time=tick * DT, lockstep=True, x=pose.x, y=pose.y, yaw=pose.yaw, linear=twist.linear,
        angular=twist.angular, left=1.6, front=1.6, right=1.6, bearings=[None, None], hears=[], rays=[],
    )  # fmt: skip


def roll(pose: Pose, wheels: tuple[float, float], wanted: tuple[float, float]) -> tuple[Pose, tuple[float, float]]:
    wheels = (ramp(wheels[0], wanted[0], MOST), ramp(wheels[1], wanted[1], MOST))
    return integrate(pose, DRIVE.twist(*wheels), DT), wheels


@settings(suppress_health_check=[HealthCheck.filter_too_much])
@given(starts, st.lists(wishes, min_size=1, max_size=12), st.lists(st.integers(1, 25), min_size=12, max_size=12))
def test_whatever_the_tables_say_a_robot_that_asks_never_touches_a_wall(
    pose: Pose, wished: list[tuple[float, float]], lengths: list[int]
) -> None:
    assume(gap(pose) > 0.05)
    supervisor, wheels, tick = Supervisor(SETTINGS), (0.0, 0.0), 0
    for (left, right), length in zip(wished, lengths, strict=False):
        for _ in range(length):
            speeds = supervisor.check(sense_at(pose, wheels, tick), GRID, [], False, left, right)
            pose, wheels = roll(pose, wheels, (speeds.left, speeds.right))
            tick += 1
            assert gap(pose) > 0.0, f"tick {tick}: touches at {pose}"


@given(starts, wishes, st.integers(0, 30))
def test_what_is_commanded_is_a_remedy_or_a_turn_on_the_spot(pose: Pose, wish: tuple[float, float], ticks: int) -> None:
    assume(gap(pose) > 0.05)
    supervisor, wheels = Supervisor(SETTINGS), (0.0, 0.0)
    forward, turn = sum(wish), wish[1] - wish[0]
    remedies = [(share * forward, rate * turn) for share, rate in REMEDIES]
    for tick in range(ticks + 1):
        speeds = supervisor.check(sense_at(pose, wheels, tick), GRID, [], False, *wish)
        got = (sum(speeds), speeds.right - speeds.left)
        assert abs(got[0]) < 1e-9 or any(got == pytest.approx(remedy, abs=1e-9) for remedy in remedies)
        pose, wheels = roll(pose, wheels, (speeds.left, speeds.right))


def test_with_room_around_the_tables_speeds_pass_unchanged() -> None:
    for wish in ((0.6, 0.6), (1.2, 0.4), (0.0, 0.5), (0.3, 0.7)):
        speeds = Supervisor(SETTINGS).check(sense_at(Pose(15.0, 10.0, 0.5), wish, 0), WIDE, [], False, *wish)
        assert speeds == pytest.approx(wish, abs=1e-12)


def test_what_the_front_sensor_sees_stops_it_though_the_map_is_free() -> None:
    pose, wheels, supervisor = Pose(1.5, 1.5, 0.0), (0.0, 0.0), Supervisor(SETTINGS)
    wall_at = 4.0
    for tick in range(200):
        front = max(0.0, min(1.6, wall_at - RADIUS - pose.x))
        sense = msgspec.structs.replace(sense_at(pose, wheels, tick), front=front)
        speeds = supervisor.check(sense, GRID, [], False, 0.6, 0.6)
        if speeds.left != speeds.right:
            break  # it has begun to turn away
        pose, wheels = roll(pose, wheels, (speeds.left, speeds.right))
        assert pose.x + RADIUS < wall_at
    assert wall_at - RADIUS - pose.x < 0.6, "it went near before"


@given(st.floats(0.0, 2 * pi), wishes)
def test_another_robots_place_is_kept_clear_of(angle: float, wish: tuple[float, float]) -> None:
    other = (5.2, 2.5)
    pose = Pose(5.2 + 1.1 * np.cos(angle), 2.5 + 1.1 * np.sin(angle), (angle + 2 * pi) % (2 * pi) - pi)
    assume(gap(pose) > 0.05)
    wheels, supervisor = (0.0, 0.0), Supervisor(SETTINGS)
    for tick in range(60):
        speeds = supervisor.check(sense_at(pose, wheels, tick), GRID, [other], False, *wish)
        pose, wheels = roll(pose, wheels, (speeds.left, speeds.right))
        assert distance(pose, other) > 2 * RADIUS


def test_halt_lets_it_turn_and_not_drive_on() -> None:
    for wish in ((0.6, 0.6), (0.2, 1.0)):
        speeds = Supervisor(SETTINGS).check(sense_at(Pose(5.2, 2.5, 0.0), (0.0, 0.0), 0), GRID, [], True, *wish)
        assert speeds.left + speeds.right == pytest.approx(0.0)


def test_told_to_halt_it_brakes_with_both_wheels_before_it_turns() -> None:
    for wish in ((0.6, 0.6), (0.2, 1.0), (1.0, 0.2)):
        speeds = Supervisor(SETTINGS).check(sense_at(Pose(5.2, 2.5, 0.0), (0.4, 0.4), 0), GRID, [], True, *wish)
        assert (speeds.left, speeds.right) == (0.0, 0.0)


def test_the_remedies_go_from_mild_to_strong_and_end_with_turning_on_the_spot() -> None:
    assert REMEDIES[0] == (1.0, 1.0)
    assert REMEDIES[-1][0] == 0.0
    assert all(0.0 <= share <= 1.0 for remedy in REMEDIES for share in remedy)


# --- the lookahead ---


def by_hand(pose: Pose, now: tuple[float, float], wanted: tuple[float, float], ticks: int) -> list[Pose]:
    """Step the kinematics: ``wanted`` for so many ticks, then the brake until it stands."""
    poses = []
    while ticks > 0 or now != (0.0, 0.0):
        pose, now = roll(pose, now, wanted if ticks > 0 else (0.0, 0.0))
        poses.append(pose)
        ticks -= 1
    return poses


@given(starts, wishes, wishes, st.integers(1, 12))
def test_the_lookahead_is_stepping_by_hand(
    pose: Pose, now: tuple[float, float], wanted: tuple[float, float], ticks: int
) -> None:
    poses = by_hand(pose, now, wanted, ticks)
    expected = min(gap(place) + RADIUS for place in poses)
    assume(expected > 0.3)  # nearer than that the grid's clearance is a cell's, not a point's
    got = least_clearance(
        GRID, pose, now, wanted, np.empty((0, 2)), body_radius=0.0, track_width=DRIVE.track_width,
        acceleration=SETTINGS.robot.wheel_acceleration, dt=DT, ticks=ticks,
    )  # fmt: skip
    assert got == pytest.approx(expected, abs=0.1)
    body = poses[len(poses) // 2]
    beside = least_clearance(
        GRID, pose, now, wanted, np.array([[body.x, body.y]]), body_radius=0.27, track_width=DRIVE.track_width,
        acceleration=SETTINGS.robot.wheel_acceleration, dt=DT, ticks=ticks,
    )  # fmt: skip
    nearest = min((distance(place, body) for place in poses), default=inf) - 0.27
    assert beside == pytest.approx(min(got, nearest), abs=2e-3)


@given(starts, wishes, wishes, st.builds(Pose, st.floats(-30.0, 30.0), st.floats(-30.0, 30.0), st.floats(-pi, pi)))
def test_on_a_floor_that_lies_elsewhere_and_turned_the_lookahead_is_the_same(
    pose: Pose, now: tuple[float, float], wanted: tuple[float, float], origin: Pose
) -> None:
    there = Grid.grown(replace(SCENARIO.map, origin=origin), RADIUS, 0.8, 0.1)
    moved = Pose(*from_frame(origin, pose.x, pose.y), pose.yaw + origin.yaw)
    here, elsewhere = (
        least_clearance(
            grid, place, now, wanted, np.empty((0, 2)), body_radius=0.0, track_width=DRIVE.track_width,
            acceleration=SETTINGS.robot.wheel_acceleration, dt=DT, ticks=8,
        )
        for grid, place in ((GRID, pose), (there, moved))
    )  # fmt: skip
    assert elsewhere == pytest.approx(here, abs=1e-4)


# --- the way out of a place without one ---


@pytest.mark.parametrize(("left", "right", "side"), [(1.0, 0.2, 1), (0.2, 1.0, -1), (0.5, 0.4, 1), (0.4, 0.5, -1)])
def test_where_the_tables_find_no_way_it_turns_to_the_freer_side_until_there_is_one(
    left: float, right: float, side: int
) -> None:
    supervisor, pose = Supervisor(SETTINGS), Pose(6.3, 2.5, 0.0)  # 0.5 m before a wall, as the map has it
    for tick in range(5):  # what was free before shortens no patience
        assert supervisor.check(sense_at(Pose(5.0, 4.5, pi), (0.3, 0.3), tick), GRID, [], False, 0.3, 0.3).left == 0.3
    turned = []
    for tick in range(60):
        sense = msgspec.structs.replace(sense_at(pose, (0.0, 0.0), tick), left=left, front=0.05, right=right)
        speeds = supervisor.check(sense, GRID, [], False, 0.3, 0.3)
        turned.append(speeds.right - speeds.left)
        assert speeds.left == pytest.approx(-speeds.right), "nothing is free ahead"
    assert turned[0] == 0.0, "the tables have the time to turn out of it themselves"
    assert turned[-1] == pytest.approx(side * ESCAPE * DRIVE.track_width)
    began = next(tick for tick, turn in enumerate(turned) if turn)
    assert began == round(PATIENCE / DT) + 1
    assert turned[began:] == turned[-1:] * (60 - began), "and to one side alone"
    pose = Pose(5.0, 4.5, pi)
    for front, free in ((ESCAPED - 0.01, False), (ESCAPED, True)):
        sense = msgspec.structs.replace(sense_at(pose, (0.0, 0.0), 60), left=left, front=front, right=right)
        speeds = supervisor.check(sense, GRID, [], False, 0.3, 0.3)
        assert (speeds.left + speeds.right > 0.0) is free


def test_something_unexplained_is_given_more_time_to_go_away() -> None:
    supervisor, pose = Supervisor(SETTINGS), Pose(5.0, 4.5, pi)
    for tick in range(200):
        sense = msgspec.structs.replace(sense_at(pose, (0.0, 0.0), tick), front=0.3)
        speeds = supervisor.check(sense, GRID, [], True, 0.3, 0.3)
        if speeds.left:
            break
    assert tick == round(PATIENCE / DT) * HALTED + 1


# --- how fast it may go towards what it sees ---


@given(st.floats(0.0, 1.6), st.floats(0.1, TOP))
def test_the_brake_stops_it_before_what_the_front_sector_sees(front: float, wish: float) -> None:
    """Rolled by hand with the wheels' own brake: it stands before the gap, and is not slower than that needs."""
    pose = Pose(15.0, 10.0, 0.0)
    sense = msgspec.structs.replace(sense_at(pose, (wish, wish), 0), front=front)
    speeds = Supervisor(SETTINGS).check(sense, WIDE, [], False, wish, wish)
    speed = speeds.left
    stops_in = speed**2 / (2 * SETTINGS.robot.wheel_acceleration)
    assert stops_in <= max(0.0, front - GAP) + 1e-9
    mildest = next((share for share, _ in REMEDIES if (share * wish) ** 2 / (2 * 2.0) <= front - GAP), 0.0)
    assert speed == pytest.approx(mildest * wish if front > GAP else 0.0)
