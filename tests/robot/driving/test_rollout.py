"""The compiled rollout of the tables equals the controller and the kinematics, stepped by hand."""

from math import cos, inf, pi, sin

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from swarm.fuzzy import Controller, load_profile
from swarm.geometry import Pose, bearing, distance
from swarm.maps.occupancy import Point
from swarm.messages import Sense
from swarm.robot.driving.safety import DriveState
from swarm.robot.driving.tables import Rollout, fuzzy_speeds
from swarm.robot.tuning import ROLLOUT
from tests.robot.driving.shared import DT, NOTHING, ROBOT, SETTINGS, rolled, sense_of
from tests.shared import constant_rules

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
@settings(max_examples=60)
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
