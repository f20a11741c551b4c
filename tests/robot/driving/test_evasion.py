"""Getting out of the way of what comes: never a contact that standing would have prevented, as a rule none at all."""

from math import cos, hypot, inf, nan, pi, sin

import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from swarm.geometry import Pose, Twist, distance, wrap
from swarm.planning.grid import Grid
from swarm.robot.driving.aim import Aiming
from swarm.robot.driving.evasion import Evasion
from swarm.robot.driving.safety import STAND, Constraints, DriveState, SafetyFilter
from swarm.traffic.interface import MovingObstacle
from swarm.traffic.obstacles.detector import HALF_WIDTH
from tests.robot.driving.shared import (
    DRIVE,
    DT,
    NO_BOXES,
    RADIUS,
    SETTINGS,
    cells_as_shape,
    constraints,
    footprint,
    rolled,
    sense_of,
)
from tests.shared import scenario_of
from tests.traffic.maps import Drawn

HALL = scenario_of("#" * 30 + "\n" + ("#" + "." * 28 + "#\n") * 20 + "#" * 30 + "\n").map
WIDE = Grid.grown(HALL, RADIUS, 0.8, 0.1)
MIDDLE = Pose(15.0, 10.0, 0.5)
WALLED = Drawn("#######", "#.....#", "#..a..#", "#..#..#", "#.....#", "#######")
WALLED_GRID = Grid.grown(WALLED.occupancy, RADIUS, resolution=0.1)
A = WALLED.at("a")[0]
HELD = (A - 1, A, A + 1)
TOUCHES = RADIUS + HALF_WIDTH  # m
angles = st.floats(-pi, pi)
rims = st.tuples(st.floats(-0.3, 0.7), st.floats(-0.3, 0.7))


def step(
    evasion: Evasion, safety: SafetyFilter, body: DriveState, tick: int, limits: Constraints, *threats: MovingObstacle
) -> DriveState:
    out = evasion.way_out(sense_of(body, tick), limits, NO_BOXES, threats)
    return rolled(body, STAND if out is None else safety.limit_way_out(sense_of(body, tick), out, limits))


def courses(threat: MovingObstacle, turns: list[tuple[int, float]], ticks: int) -> list[MovingObstacle]:
    """Let it go on, and turn by an angle at some ticks."""
    found = []
    for tick in range(ticks):
        x, y, vx, vy = threat
        for _, angle in [turn for turn in turns if turn[0] == tick]:
            vx, vy = cos(angle) * vx - sin(angle) * vy, sin(angle) * vx + cos(angle) * vy
        threat = MovingObstacle(x + vx * DT, y + vy * DT, vx, vy)
        found.append(threat)
    return found


@pytest.mark.parametrize("speed", [0.2, 0.3, 0.4])
@settings(max_examples=15)
@given(angles, angles)
def test_it_gets_out_of_the_way_of_what_comes_from_anywhere(speed: float, yaw: float, coming: float) -> None:
    body = DriveState(MIDDLE._replace(yaw=yaw), 0.0, 0.0)
    x, y = MIDDLE.x + 1.4 * cos(coming), MIDDLE.y + 1.4 * sin(coming)
    evasion, safety = Evasion(SETTINGS), SafetyFilter(SETTINGS)
    for tick, threat in enumerate(courses(MovingObstacle(x, y, -speed * cos(coming), -speed * sin(coming)), [], 160)):
        body = step(evasion, safety, body, tick, constraints(WIDE, body.pose), threat)
        assert distance(body.pose, threat) > TOUCHES


@settings(max_examples=25)
@given(
    angles, angles, st.floats(-0.6, 0.6), st.floats(0.1, 0.4),
    st.lists(st.tuples(st.integers(0, 100), st.sampled_from((pi / 2, -pi / 2, pi))), max_size=2),
)  # fmt: skip
def test_it_never_drives_into_what_comes(
    yaw: float, coming: float, off: float, speed: float, turns: list[tuple[int, float]]
) -> None:
    """Whatever that does: where they touch, the robot did not come nearer faster than it."""
    body = DriveState(MIDDLE._replace(yaw=yaw), 0.0, 0.0)
    x, y = MIDDLE.x + 1.2 * cos(coming), MIDDLE.y + 1.2 * sin(coming)
    heading = coming + pi + off
    evasion, safety = Evasion(SETTINGS), SafetyFilter(SETTINGS)
    for tick, threat in enumerate(
        courses(MovingObstacle(x, y, speed * cos(heading), speed * sin(heading)), turns, 120)
    ):
        before, body = body, step(evasion, safety, body, tick, constraints(WIDE, body.pose), threat)
        away = distance(body.pose, threat)
        if away <= TOUCHES:
            to_x, to_y = (threat.x - body.pose.x) / away, (threat.y - body.pose.y) / away
            mine = ((body.pose.x - before.pose.x) * to_x + (body.pose.y - before.pose.y) * to_y) / DT
            assert mine <= -(threat.vx * to_x + threat.vy * to_y) + 1e-6
            return


@pytest.mark.long("thousands of simulated ways out")
@settings(max_examples=25)
@given(
    st.floats(-0.3, 0.3), st.floats(-0.3, 0.3), angles,
    st.lists(st.tuples(st.floats(-1.2, 1.2), st.floats(-1.2, 1.2)), min_size=4, max_size=4),
)  # fmt: skip
def test_it_never_leaves_the_held_cells(dx: float, dy: float, yaw: float, threats: list[tuple[float, float]]) -> None:
    x, y = WALLED.cells.centre(A)
    body, aiming = DriveState(Pose(x + dx, y + dy, yaw), 0.0, 0.0), Aiming(WALLED.cells, RADIUS)
    evasion, safety, within = Evasion(SETTINGS), SafetyFilter(SETTINGS), cells_as_shape(WALLED.cells, HELD)
    for tick in range(120):
        off = threats[tick // 30]
        far = max(0.1, hypot(*off))
        threat = MovingObstacle(x + off[0], y + off[1], -0.3 * off[0] / far, -0.3 * off[1] / far)
        body = step(evasion, safety, body, tick, constraints(WALLED_GRID, body.pose, aiming.shut_boxes(HELD)), threat)
        assert shapely.contains(within, footprint(body.pose)), f"tick {tick}: out of its cells at {body.pose}"


def test_the_tables_may_not_drive_towards_what_may_turn_round() -> None:
    body, evasion = DriveState(MIDDLE._replace(yaw=0.0), 0.0, 0.0), Evasion(SETTINGS)
    for gap, threatened in ((0.6, True), (1.4, False)):
        threat = MovingObstacle(MIDDLE.x + TOUCHES + gap, MIDDLE.y, 0.3, 0.0)
        said = evasion.threatens(sense_of(body), (0.6, 0.6), constraints(WIDE, body.pose), [threat])
        assert said is threatened


@pytest.mark.parametrize("yaw", [0.0, 2.0, pi])
@pytest.mark.parametrize(
    ("coming", "linear", "angular"),
    [
        (180, 0.6, 0.0),  # deg, from behind: straight on is the first way out that is tried
        (120, 0.6, 0.0),
        (-120, 0.6, 0.0),
        (90, 0.6 * cos(pi / 4), -5.0 * pi / 4),  # from the left: 45 degrees to the right
        (-90, 0.6 * cos(pi / 4), 5.0 * pi / 4),
        (0, 0.0, -4.0),  # head-on: of two that are equally good, the one to the right
        (60, 0.6 * cos(5 * pi / 12), -4.0),  # from ahead: 75 degrees, for which it turns as fast as it may
        (-60, 0.6 * cos(5 * pi / 12), 4.0),
    ],
)
def test_the_first_way_out_is_the_smallest_turn_that_is_enough(
    yaw: float, coming: float, linear: float, angular: float
) -> None:
    body, side = DriveState(MIDDLE._replace(yaw=yaw), 0.0, 0.0), yaw + coming * pi / 180
    threat = MovingObstacle(MIDDLE.x + 0.8 * cos(side), MIDDLE.y + 0.8 * sin(side), -0.3 * cos(side), -0.3 * sin(side))
    twist = Evasion(SETTINGS).way_out(sense_of(body), constraints(WIDE, body.pose), NO_BOXES, (threat,))
    assert twist == pytest.approx((linear, angular))


def coming_from(degrees: float, away: float = 0.8, speed: float = 0.3) -> MovingObstacle:
    """Return what comes straight towards a robot in the middle; it is ``away`` [m] now."""
    x, y = cos(degrees * pi / 180), sin(degrees * pi / 180)
    return MovingObstacle(MIDDLE.x + away * x, MIDDLE.y + away * y, -speed * x, -speed * y)


def test_a_way_out_is_over_as_soon_as_standing_is_enough() -> None:
    body, evasion = DriveState(MIDDLE._replace(yaw=0.0), 0.0, 0.0), Evasion(SETTINGS)
    for away, out in ((0.8, True), (3.0, False), (0.8, True)):
        twist = evasion.way_out(sense_of(body), constraints(WIDE, body.pose), NO_BOXES, (coming_from(180, away),))
        assert (twist is not None) is out


# fmt: off
THEN = {  # how far away it is [m], from where it comes at first, and then: the heading of the second way out [deg]
    "head-on, and a way to the left is under way":   (0.6, -10, 0,    90),
    "still nearly as good":                          (0.6, -10, 30,   90),
    "a smaller turn would be as good":               (0.6, -10, -90,  90),
    "far worse than to the right":                   (0.6, -10, 60,   -75),
    "far worse than straight on":                    (0.6, -10, 180,  -15),
    "from behind on the right":                      (0.6, -10, -135, 15),
    "from the left, farther off":                    (1.0, -10, 75,   -15),
    "straight on is under way and still good":       (1.0, -90, -75,  0),
    "it comes from ahead now":                       (0.8, -90, -45,  90),
}
# fmt: on


@pytest.mark.parametrize("name", THEN)
def test_a_way_out_under_way_is_kept_unless_another_is_better_by_a_decimetre(name: str) -> None:
    away, first, then, heading = THEN[name]
    body, evasion = DriveState(MIDDLE._replace(yaw=0.0), 0.0, 0.0), Evasion(SETTINGS)
    for coming in (first, then):
        threat = coming_from(coming, away)
        twist = evasion.way_out(sense_of(body), constraints(WIDE, body.pose), NO_BOXES, (threat,))
    off = heading * pi / 180
    assert twist == pytest.approx((0.6 * cos(off), max(-4.0, min(4.0, 5.0 * off))))


@pytest.mark.parametrize(("gap", "threatened"), [(0.0, True), (0.5, True), (1.08, True), (1.13, False)])
@pytest.mark.parametrize("yaw", [0.0, 2.0])
def test_the_tables_keep_a_gap_of_30_cm_to_what_may_turn_round(gap: float, threatened: bool, yaw: float) -> None:
    """In 0.4 s and while it brakes the robot drives 0.24 m; what turns back comes 0.585 m nearer in 39 ticks."""
    body, away = DriveState(MIDDLE._replace(yaw=yaw), 0.0, 0.0), TOUCHES + gap
    threat = MovingObstacle(MIDDLE.x + away * cos(yaw), MIDDLE.y + away * sin(yaw), 0.3 * cos(yaw), 0.3 * sin(yaw))
    for speed, said in ((0.6, threatened), (0.0, False), (-0.3, False)):
        limits = constraints(WIDE, body.pose)
        assert Evasion(SETTINGS).threatens(sense_of(body), (speed, speed), limits, [threat]) is said


@pytest.mark.parametrize("speed", [0.6, 1.2])
def test_who_cannot_stop_clear_of_a_wall_has_no_way_out(speed: float) -> None:
    """The safety filter alone brakes it."""
    body = DriveState(Pose(1.0 + RADIUS + 0.05, 10.0, pi), speed, speed)
    threat = MovingObstacle(body.pose.x + 0.8, 10.0, -0.3, 0.0)
    assert Evasion(SETTINGS).way_out(sense_of(body), constraints(WIDE, body.pose), NO_BOXES, (threat,)) is None
    assert Evasion(SETTINGS).threatens(sense_of(body), (0.0, 0.0), constraints(WIDE, body.pose), [threat])


# courses of a threat: its turn [rad], and the share of its speed that it keeps
COURSES = ((0.0, 1.0), (0.4, 1.0), (-0.4, 1.0), (1.6, 1.0), (-1.6, 1.0), (pi, 1.0), (0.0, 0.0))


def gaps_by_hand(
    body: DriveState, threat: MovingObstacle, heading: float, speeds: tuple[float, float], drive: int
) -> list[float]:
    """Drive for so many ticks, then brake, for 2.5 s in all: the least gap [m] on each course."""
    start, least = Pose(*body.pose), [inf] * len(COURSES)
    for tick in range(50):
        for number, (turn, share) in enumerate(COURSES):
            vx, vy = share * threat.vx, share * threat.vy
            x = threat.x + (cos(turn) * vx - sin(turn) * vy) * tick * DT
            y = threat.y + (sin(turn) * vx + cos(turn) * vy) * tick * DT
            least[number] = min(least[number], distance(body.pose, (x, y)) - TOUCHES)
        wanted = speeds if tick < drive else STAND
        if tick < drive and heading == heading:
            off = wrap(heading - body.pose.yaw)
            wanted = DRIVE.rim_speeds(Twist(0.6 * max(0.0, cos(off)), max(-4.0, min(4.0, 5.0 * off))))
        body = rolled(body, wanted)
    assert distance(start, body.pose) < 2.0, "it stays in the open"
    return least


@given(
    yaw=angles, now=rims, at=st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0)),
    coming=st.tuples(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5)),
    heading=st.floats(-3.0, 3.0) | st.just(nan), speeds=rims, drive=st.integers(0, 36),
)  # fmt: skip
def test_the_gaps_to_a_threat_are_those_of_stepping_by_hand(
    yaw: float, now: tuple[float, float], at: tuple[float, float], coming: tuple[float, float],
    heading: float, speeds: tuple[float, float], drive: int,
) -> None:  # fmt: skip
    body = DriveState(MIDDLE._replace(yaw=yaw), *now)
    threat = MovingObstacle(MIDDLE.x + at[0], MIDDLE.y + at[1], *coming)
    assume(abs(abs(wrap(yaw - heading)) - pi) > 1.0 or heading != heading)  # turned away, a bit decides the side
    gaps = Evasion(SETTINGS).gaps(
        sense_of(body), constraints(WIDE, body.pose), (threat,), heading, drive * DT, speeds=speeds
    )
    assert gaps is not None
    assert gaps.tolist() == pytest.approx(gaps_by_hand(body, threat, heading, speeds, drive), abs=0.01)
