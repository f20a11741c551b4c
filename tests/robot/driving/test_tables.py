"""The tables' inputs in their own units, detours from corners, and where the tables would drive."""

from math import cos, inf, pi, sin
from typing import cast

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from swarm.fuzzy import Controller, load_profile
from swarm.geometry import Pose, bearing, distance
from swarm.maps.occupancy import Point
from swarm.messages import Sense
from swarm.planning.grid import Grid
from swarm.robot.driving.safety import Constraints, DriveState, SafetyFilter
from swarm.robot.driving.tables import Detour, LaneTurn, Rollout, fuzzy_speeds, speeds_towards
from swarm.robot.tuning import DETOUR, ROLLOUT
from tests.robot.driving.shared import DT, NO_BOXES, NOTHING, RADIUS, ROBOT, SETTINGS, constraints, rolled, sense_of
from tests.shared import constant_rules, scenario_of


class Listening:
    """Tables that note what they are asked."""

    def __init__(self) -> None:
        self.asked: list[tuple[float, ...]] = []

    def wheel_speeds(self, *inputs: float) -> tuple[float, float]:
        self.asked.append(inputs)
        return 1.0, 2.0


@pytest.mark.parametrize(
    ("speed", "distance", "scale"), [(1.0, 1.0, 1.0), (0.4, 1.0, 1.0), (0.4, 0.5, 1.0), (0.25, 2.0, 0.5)]
)
def test_the_tables_are_asked_in_their_own_units_and_answer_in_theirs(
    speed: float, distance: float, scale: float
) -> None:
    """Distances divided by both scales, degrees with right positive; rim speeds times theirs."""
    robot = scenario_of(robot={"speed_scale": speed, "distance_scale": distance}).settings.robot
    sense = Sense(
        world="local",
        run=0, tick=0, time=0.0, lockstep=True, x=0.0, y=0.0, yaw=0.0, linear=0.0, angular=0.0,
        left=1.0, front=0.5, right=0.25, bearings=[], hears=[], rays=[],
    )  # fmt: skip
    tables = Listening()
    assert fuzzy_speeds(cast(Controller, tables), robot, sense, pi / 6, scale) == pytest.approx((speed, 2.0 * speed))
    unit = distance * scale
    assert tables.asked == [pytest.approx((1.0 / unit, 0.5 / unit, 0.25 / unit, -30.0))]


HALL = scenario_of("#" * 30 + "\n" + ("#" + "." * 28 + "#\n") * 20 + "#" * 30 + "\n").map
WIDE = Grid.grown(HALL, RADIUS, 0.8, 0.1)
MIDDLE = Pose(15.0, 10.0, 0.0)
PATIENT = 60  # ticks: 3 s
FREE = constraints(WIDE, MIDDLE)
BLOCKED = 0.05  # m, sensed in front
LOW, HIGH = (14.5, 9.0, 15.6, 9.74), (14.5, 10.26, 15.6, 11.0)  # cells not held, to its right and to its left
AHEAD = (15.26, 9.0, 15.6, 11.0)


def told(
    detour: Detour, tick: int, pose: Pose = MIDDLE, front: float = BLOCKED, limits: Constraints = FREE
) -> float | None:
    """Ask what the tables are told of a robot that stands at a pose."""
    sense = sense_of(DriveState(pose, 0.0, 0.0), tick, front=front)
    return detour.heading(sense, limits._replace(local=pose))


def begun() -> Detour:
    """Return a detour that is under way at tick ``PATIENT + 2``."""
    detour = Detour(SafetyFilter(SETTINGS))
    assert [told(detour, tick) for tick in range(PATIENT + 3)][-1] is not None
    return detour


@pytest.mark.parametrize(
    ("left", "right", "shut", "side"),
    [
        (1.0, 0.2, (), 1),
        (0.2, 1.0, (), -1),
        (0.5, 0.4, (), 1),
        (0.4, 0.5, (), -1),
        (0.2, 1.0, (AHEAD, LOW), 1),
        (1.0, 0.2, (AHEAD, HIGH), -1),
    ],
)
def test_where_it_gets_nowhere_the_tables_are_told_to_turn_to_the_freer_side(
    left: float, right: float, shut: tuple[tuple[float, ...], ...], side: int
) -> None:
    detour, limits = Detour(SafetyFilter(SETTINGS)), constraints(WIDE, MIDDLE, np.array(shut or NO_BOXES, np.float64))
    elsewhere = Pose(10.0, 10.0, 0.0)
    for tick in range(5):  # what was free before shortens no patience
        told(detour, tick - 5, elsewhere)
    stands = DriveState(MIDDLE, 0.0, 0.0)
    found = [detour.heading(sense_of(stands, tick, left, BLOCKED, right), limits) for tick in range(2 * PATIENT)]
    began = next(tick for tick, heading in enumerate(found) if heading is not None)
    assert PATIENT <= began <= PATIENT + 3, "the tables have the time to turn out of it themselves"
    assert found[began:] == [side * DETOUR.aside] * len(found[began:]), "and to one side alone"


def test_once_there_is_a_way_ahead_it_leads_a_little_along_it() -> None:
    detour, tick = begun(), PATIENT + 3
    for yaw in (0.2, 0.4, 0.6):
        assert told(detour, tick, MIDDLE._replace(yaw=yaw)) == DETOUR.aside
    turned = MIDDLE._replace(yaw=pi / 2)
    for share in (0.0, 0.5, 0.9):
        assert told(detour, tick, turned._replace(y=10.0 + share * DETOUR.done), front=1.6) == 0.0
    assert told(detour, tick, turned._replace(y=10.0 + 1.1 * DETOUR.done), front=1.6) is None
    assert told(detour, tick + 1, turned._replace(y=10.0 + 1.1 * DETOUR.done)) is None, "and patience begins anew"


@pytest.mark.parametrize("front", [BLOCKED, 1.6])
def test_it_ends_though_nothing_came_of_it(front: float) -> None:
    detour = begun()
    found = [told(detour, PATIENT + 3 + tick, front=front) for tick in range(PATIENT + 5)]
    assert None in found
    ended = found.index(None)
    assert ended == pytest.approx(PATIENT + 1 if front > BLOCKED else PATIENT - 1, abs=1), "3 s after its phase began"
    assert found[:5] == [0.0 if front > BLOCKED else DETOUR.aside] * 5


def test_who_has_a_way_ahead_needs_none() -> None:
    """Its wheels do not obey: it is held up."""
    detour = Detour(SafetyFilter(SETTINGS))
    assert {told(detour, tick, front=1.6) for tick in range(3 * PATIENT)} == {None}


def test_who_gets_on_a_little_all_the_time_needs_none() -> None:
    detour = Detour(SafetyFilter(SETTINGS))
    for tick in range(3 * PATIENT):
        assert told(detour, tick, MIDDLE._replace(x=10.0 + 1.1 * DETOUR.progress * (tick // (PATIENT // 2)))) is None


def test_who_shall_not_drive_on_waits_without_one() -> None:
    """The cells ahead are not granted yet."""
    detour, limits = Detour(SafetyFilter(SETTINGS)), FREE._replace(stop_within=0.0)
    assert {told(detour, tick, limits=limits) for tick in range(3 * PATIENT)} == {None}
    detour = begun()
    assert told(detour, PATIENT + 3, limits=limits) is None
    assert told(detour, PATIENT + 4) is None, "and one under way is over"


def test_who_is_stopped_before_a_body_turns_away_from_it() -> None:
    """The tables, so near to it, may turn to where they ask for no turn (storm, ``dead`` 9100)."""
    detour, stopped = Detour(SafetyFilter(SETTINGS)), FREE._replace(may_drive=False)
    found = [told(detour, tick, front=1.6, limits=stopped) for tick in range(PATIENT + 3)]
    assert (found[PATIENT], found[-1]) == (None, DETOUR.aside)
    assert told(detour, PATIENT + 3, front=1.6) == 0.0, "and drives on once it no longer faces it"


def test_after_a_detour_patience_begins_anew_and_then_another_detour() -> None:
    detour = begun()
    found = [told(detour, PATIENT + 3 + tick) for tick in range(3 * PATIENT)]
    waits = [heading is None for heading in found]
    assert waits.count(True) == pytest.approx(PATIENT, abs=3)
    assert not waits[-1]


def test_who_has_a_little_way_to_drive_begins_one_all_the_same() -> None:
    detour, limits = Detour(SafetyFilter(SETTINGS)), FREE._replace(stop_within=0.2)
    assert [told(detour, tick, limits=limits) for tick in range(PATIENT + 3)][-1] == DETOUR.aside


@pytest.mark.parametrize(("moves", "begins"), [(0.0, True), (0.09, True), (0.11, False)])
def test_after_3_s_with_no_decimetre_of_progress_a_quarter_turn_is_asked_for(moves: float, begins: bool) -> None:
    """The robot stands for 2.9 s, moves, and stands for 0.3 s more."""
    detour = Detour(SafetyFilter(SETTINGS))
    assert {told(detour, tick) for tick in range(58)} == {None}
    there = MIDDLE._replace(x=MIDDLE.x + moves)
    found = [told(detour, tick, there) for tick in range(58, 64)]
    assert found[-1] == (pytest.approx(1.5708, abs=1e-4) if begins else None)


@pytest.mark.parametrize(("away", "over"), [(0.39, False), (0.41, True)])
def test_a_detour_is_over_40_cm_from_its_beginning(away: float, over: bool) -> None:
    found = told(begun(), PATIENT + 3, MIDDLE._replace(y=MIDDLE.y + away))
    assert (found is None) is over


def test_who_rests_forgets_it() -> None:
    detour = begun()
    detour.end()
    assert told(detour, PATIENT + 3) is None


PAPER = Controller(load_profile("paper"))
ROLL = Rollout(PAPER, SETTINGS)
START = Pose(0.0, 0.0, 0.0)
TICKS = round(ROLLOUT.ahead / DT)
FAR = 9.0  # m, from where it circles round nothing

distances = st.floats(0.05, NOTHING)


def by_hand(controller: Controller, sense: Sense, body: DriveState, aim: Point, scale: float) -> list[Pose]:
    """Ask the tables and let a tick pass, as long as is looked ahead or until it is there."""
    poses: list[Pose] = []
    while len(poses) < TICKS and distance(body.pose, aim) > ROLLOUT.there:
        body = rolled(body, fuzzy_speeds(controller, ROBOT, sense, bearing(body.pose, aim), scale))
        poses.append(body.pose)
    return poses


@given(
    aim=st.tuples(st.floats(-4.0, 4.0), st.floats(-4.0, 4.0)),
    yaw=st.floats(-pi, pi),
    now=st.tuples(st.floats(-0.4, 1.0), st.floats(-0.4, 1.0)),
    seen=st.tuples(distances, distances, distances),
    scale=st.sampled_from([0.15, 0.5, 1.0]),
)
def test_the_rollout_is_the_tables_and_the_kinematics_stepped_by_hand(
    aim: Point, yaw: float, now: tuple[float, float], seen: tuple[float, float, float], scale: float
) -> None:
    body = DriveState(START._replace(yaw=yaw), *now)
    sense = sense_of(body, 0, *seen)
    expected = by_hand(PAPER, sense, body, aim, scale)
    before, after = distance(START, aim), distance(expected[-1], aim) if expected else 0.0
    circles = len(expected) == TICKS and before < ROLLOUT.round and after > ROLLOUT.nearer * before
    assume(len(expected) < TICKS or abs(after - ROLLOUT.there) > 0.01)
    assume(abs(after - ROLLOUT.nearer * before) > 0.01)
    behind = min((abs(abs(bearing(pose, aim)) - pi) for pose in (body.pose, *expected)), default=pi)
    assume(behind > 0.05)  # there the tables' two sides meet: a bit decides
    points = ROLL(sense, body, aim, scale)
    if circles:
        assert len(points) == 0
        return
    assert abs(len(points) - len(expected)) <= 1
    for point, pose in zip(points.tolist(), expected, strict=False):
        assert point == pytest.approx(pose[:2], abs=0.02)


def test_it_ends_at_the_aim() -> None:
    body = DriveState(START, 0.0, 0.0)
    for away in (0.3, 0.8):
        points = ROLL(sense_of(body), body, (away, 0.0), 1.0)
        assert 0 < len(points) < TICKS
        assert distance(points[-1].tolist(), (away, 0.0)) <= ROLLOUT.there
        assert all(distance(point, (away, 0.0)) > ROLLOUT.there for point in points[:-1].tolist())
    assert len(ROLL(sense_of(body), body, (0.9 * ROLLOUT.there, 0.0), 1.0)) == 0, "it is there"


def test_to_a_far_aim_it_looks_no_farther_ahead_than_it_says() -> None:
    body = DriveState(START, 0.0, 0.0)
    assert len(ROLL(sense_of(body), body, (FAR, 0.0), 1.0)) == TICKS


@pytest.mark.parametrize(("away", "empty"), [(0.9 * ROLLOUT.round, True), (1.1 * ROLLOUT.round, False)])
def test_where_it_would_circle_round_a_near_aim_it_is_empty(away: float, empty: bool) -> None:
    """Tables that turn left whatever they are told; the aim is the middle of the circle."""
    circling = Rollout(Controller(constant_rules(load_profile("paper"), "slow", "medium")), SETTINGS)
    body = DriveState(START, 0.0, 0.0)
    points = circling(sense_of(body), body, (0.0, away), 1.0)
    assert (len(points) == 0) is empty


@pytest.mark.parametrize("yaw", [0.0, pi / 2, pi, -pi / 2])
def test_who_drives_straight_to_a_near_aim_does_not_circle(yaw: float) -> None:
    """Tables that drive straight on at 0.4 m/s, after a ramp over three ticks: 0.97 m in 2.5 s, of 1.2 m."""
    straight = Rollout(Controller(constant_rules(load_profile("paper"), "slow", "slow")), SETTINGS)
    body = DriveState(Pose(3.0, -2.0, yaw), 0.0, 0.0)
    points = straight(sense_of(body), body, (3.0 + 1.2 * cos(yaw), -2.0 + 1.2 * sin(yaw)), 1.0)
    assert len(points) == TICKS
    assert points[-1].tolist() == pytest.approx((3.0 + 0.97 * cos(yaw), -2.0 + 0.97 * sin(yaw)))


@pytest.mark.parametrize("far", [inf, NOTHING])
def test_it_asks_with_the_distances_as_they_are_sensed(far: float) -> None:
    """What is seen at a side now is taken to stay there: another distance gives another way."""
    body = DriveState(START, 0.3, 0.3)
    free, beside = (ROLL(sense_of(body, 0, left), body, (3.0, 1.0), 1.0) for left in (min(far, NOTHING), 0.2))
    count = min(len(free), len(beside))
    assert np.abs(free[:count] - beside[:count]).max() > 0.02


@given(
    left=st.floats(0.0, 1.2),
    right=st.floats(0.0, 1.2),
    heading=st.floats(-0.35, 0.35),
)
def test_a_robot_at_its_place_turns_to_it_whatever_stands_beside(left: float, right: float, heading: float) -> None:
    """The tables' speeds stay unless they turn away from the place; the forward speed is always theirs."""
    speeds = speeds_towards((left, right), heading, ROBOT)
    assert sum(speeds) == pytest.approx(left + right)
    assert (speeds[1] - speeds[0]) * heading >= 0.0
    if (right - left) * heading >= 0.0:
        assert speeds == (left, right)


# fmt: off
TURNS = {  # side of a cell [m], speed [m/s], whether it is between others, errors of its heading in turn -> does it turn
    "a lane":               (0.8, 0.0, True,  (0.4, 0.2, 0.1, 0.05, 0.2), (True, True, True, False, False)),
    "nearly straight":      (0.8, 0.0, True,  (0.3,),                     (False,)),
    "to the right":         (0.8, 0.0, True,  (-2.0, -0.1),               (True, True)),
    "it drives":            (0.8, 0.3, True,  (0.4,),                     (False,)),
    "alone, or threatened": (0.8, 0.0, False, (0.4,),                     (False,)),
    "room for the tables":  (1.2, 0.0, True,  (0.4,),                     (False,)),
}
# fmt: on


@pytest.mark.parametrize("name", TURNS)
def test_in_narrow_cells_a_robot_that_stands_turns_to_its_aim_on_the_spot(name: str) -> None:
    side, speed, between_others, errors, turns = TURNS[name]
    lane = LaneTurn(side, RADIUS)
    sense = sense_of(DriveState(Pose(0.0, 0.0, 0.0), speed, speed))
    assert tuple(lane.check(sense, error, between_others=between_others) for error in errors) == turns
