"""Where a robot is in the map: by odometry, by localisations, and when that is not known."""

from math import pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm.bridge.body.body import mean_twist
from swarm.bridge.body.localiser import Localiser, SpeedLimits, odom_in_map
from swarm.bridge.body.readings import Localisation, Odometry
from swarm.geometry import Pose, Twist, from_frame, integrate, wrap

LIMITS = SpeedLimits(1.6, 8.0)
STANDS = Twist(0.0, 0.0)
poses = st.builds(Pose, st.floats(-50, 50), st.floats(-50, 50), st.floats(-pi, pi))
twists = st.builds(Twist, st.floats(-1.6, 1.6), st.floats(-3, 3))


def near(one: Pose | None, other: Pose) -> bool:
    assert one is not None
    return abs(one.x - other.x) + abs(one.y - other.y) + abs(wrap(one.yaw - other.yaw)) < 1e-6


def composed(frame: Pose, pose: Pose) -> Pose:
    return Pose(*from_frame(frame, pose.x, pose.y), wrap(frame.yaw + pose.yaw))


@given(frame=poses, pose=poses)
def test_the_correction_puts_odom_where_both_poses_are_one(frame: Pose, pose: Pose) -> None:
    assert near(composed(odom_in_map(composed(frame, pose), pose), pose), composed(frame, pose))


@given(start=poses, switched_on=poses, twist=twists)
def test_odometry_counts_from_its_first_message_wherever_its_frame_is(
    start: Pose, switched_on: Pose, twist: Twist
) -> None:
    localiser = Localiser(LIMITS)
    for tick in range(20):
        pose = integrate(switched_on, twist, tick * 0.05)
        assert localiser.take_odometry(Odometry(tick * 0.05, pose, twist), tick * 0.05) == ""
        if tick == 0:
            localiser.set_pose(start)
    assert near(localiser.pose_at(0.95), integrate(start, twist, 0.95))
    assert near(localiser.pose_at(1.05), integrate(start, twist, 1.05)), "it goes on as it did"


@given(start=poses, twist=twists, late=st.floats(0.0, 0.2))
def test_a_localisation_is_of_the_time_of_its_stamp(start: Pose, twist: Twist, late: float) -> None:
    localiser = Localiser(LIMITS)
    for tick in range(20):
        localiser.take_odometry(
            Odometry(tick * 0.05, integrate(Pose(0.0, 0.0, 0.0), twist, tick * 0.05), twist), tick * 0.05
        )
    localiser.take_localisation(Localisation(0.95 - late, integrate(start, twist, 0.95 - late)), 0.95)
    assert near(localiser.pose_at(0.95), integrate(start, twist, 0.95))


def test_a_localisation_that_came_first_waits_for_odometry() -> None:
    localiser = Localiser(LIMITS)
    localiser.take_localisation(Localisation(0.0, Pose(3.0, 4.0, 1.0)), 0.0)
    assert localiser.pose_at(0.0) is None
    localiser.take_odometry(Odometry(5.0, Pose(7.0, 7.0, 0.0), STANDS), 5.0)
    assert near(localiser.pose_at(5.0), Pose(3.0, 4.0, 1.0))


@pytest.mark.parametrize(
    ("pose", "stamp", "jump"),
    [
        (Pose(0.15, 0.0, 0.0), 0.05, ""),
        (Pose(0.2, 0.0, 0.0), 0.05, "jumped 0.20 m in 0.05 s"),
        (Pose(0.2, 0.0, 0.0), 0.1, ""),  # a message was lost
        (Pose(0.0, 0.0, 0.7), 0.05, ""),
        (Pose(0.0, 0.0, -0.8), 0.05, "turned 0.80 rad in 0.05 s"),
        (Pose(0.0, 0.0, 2 * pi - 0.1), 0.05, ""),
    ],
)
def test_odometry_jumps_if_no_robot_can_drive_so(pose: Pose, stamp: float, jump: str) -> None:
    localiser = Localiser(LIMITS)
    localiser.take_odometry(Odometry(0.0, Pose(0.0, 0.0, 0.0), STANDS), 0.0)
    localiser.set_pose(Pose(1.0, 1.0, 0.0))
    assert localiser.take_odometry(Odometry(stamp, pose, STANDS), 0.05) == jump
    assert localiser.is_known is (jump == "")
    assert localiser.lost == (f"its odometry {jump}" if jump else "")
    localiser.take_localisation(Localisation(stamp, Pose(2.0, 2.0, 0.0)), 0.05)
    assert near(localiser.pose_at(0.05), Pose(2.0, 2.0, 0.0))
    assert localiser.lost == ""


def test_the_way_since_the_last_localisation_is_counted() -> None:
    localiser = Localiser(LIMITS)
    for tick in range(11):
        localiser.take_odometry(Odometry(tick * 0.1, Pose(tick * 0.1, 0.0, 0.0), Twist(1.0, 0.0)), tick * 0.1)
    assert localiser.alone == pytest.approx(1.0)
    localiser.take_localisation(Localisation(1.0, Pose(0.0, 0.0, 0.0)), 1.0)
    assert localiser.alone == 0.0


@given(start=poses, twist=twists)
def test_poses_tell_a_twist_where_there_is_no_odometry(start: Pose, twist: Twist) -> None:
    found = [(tick * 0.02, integrate(start, twist, tick * 0.02)) for tick in range(30)]
    seen = mean_twist(found)
    assert seen.angular == pytest.approx(twist.angular, abs=1e-6)
    assert seen.linear == pytest.approx(twist.linear, abs=0.1), "the chord of an arc of 0.2 s"
    assert mean_twist(found[:1]) == STANDS


def test_a_localisation_of_another_clock_counts_for_now() -> None:
    localiser = Localiser(LIMITS)
    drives, pose = Twist(0.4, 0.0), Pose(0.0, 0.0, 0.0)
    for tick in range(200):
        localiser.take_odometry(Odometry(100.0 + tick / 20, pose, drives), tick / 20)
        pose = integrate(pose, drives, 1 / 20)
    here = Pose(4.0, 1.0, 0.0)
    assert localiser.take_localisation(Localisation(0.0, here), 199 / 20) == "", "nobody has stamped it"
    assert near(localiser.pose_at(199 / 20), here)
