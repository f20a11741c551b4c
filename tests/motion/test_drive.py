"""The differential drive of the paper's section 2.3."""

from math import cos, hypot, pi, sin

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from swarm.geometry import Pose, Twist, integrate
from swarm.motion.drive import DifferentialDrive, ramp

drives = st.builds(DifferentialDrive, st.floats(0.05, 2.0))
speeds = st.floats(-4.0, 4.0)
poses = st.builds(Pose, st.floats(-50, 50), st.floats(-50, 50), st.floats(-pi, pi, exclude_min=True))

PAPER = DifferentialDrive(track_width=0.4)


@given(drives, speeds, speeds)
def test_rim_speeds_undo_twist(drive: DifferentialDrive, left: float, right: float) -> None:
    assert drive.rim_speeds(drive.twist(left, right)) == pytest.approx((left, right), abs=1e-12)


@given(drives, st.floats(-4.0, 4.0), st.floats(-10.0, 10.0))
def test_twist_undoes_rim_speeds(drive: DifferentialDrive, linear: float, angular: float) -> None:
    assert drive.twist(*drive.rim_speeds(Twist(linear, angular))) == pytest.approx((linear, angular), abs=1e-9)


@pytest.mark.parametrize(
    ("left", "right", "linear", "angular"),
    [
        (1.0, 1.0, 1.0, 0.0),
        (-0.5, 0.5, 0.0, 2.5),  # on the spot, to the left
        (0.5, -0.5, 0.0, -2.5),
        (0.0, 0.4, 0.2, 1.0),  # about the left wheel
    ],
)
def test_the_equations_of_the_paper(left: float, right: float, linear: float, angular: float) -> None:
    assert PAPER.twist(left, right) == pytest.approx((linear, angular))


@given(drives, poses, speeds, speeds)
def test_each_wheel_keeps_its_distance_from_the_icc_and_drives_its_own_length(
    drive: DifferentialDrive, pose: Pose, left: float, right: float
) -> None:
    assume(abs(right - left) > 0.01)
    icc = icc_of(drive, pose, left, right)
    dt = 0.05
    end = integrate(pose, drive.twist(left, right), dt)
    turn = (right - left) / drive.track_width * dt
    for side, speed in ((1, left), (-1, right)):
        before = wheel(drive, pose, side)
        after = wheel(drive, end, side)
        radius = hypot(before[0] - icc[0], before[1] - icc[1])
        assert hypot(after[0] - icc[0], after[1] - icc[1]) == pytest.approx(radius, rel=1e-6, abs=1e-6)
        assert abs(turn) * radius == pytest.approx(abs(speed) * dt, rel=1e-6, abs=1e-6)


def icc_of(drive: DifferentialDrive, pose: Pose, left: float, right: float) -> tuple[float, float]:
    """The instantaneous centre of curvature (the paper's section 2.3): R = (L/2)(v_r + v_l)/(v_r - v_l) to the left."""
    radius = drive.track_width / 2 * (right + left) / (right - left)
    return pose.x - radius * sin(pose.yaw), pose.y + radius * cos(pose.yaw)


def wheel(drive: DifferentialDrive, pose: Pose, side: int) -> tuple[float, float]:
    """Where the left (1) or right (-1) wheel touches the floor."""
    half = drive.track_width / 2 * side
    return pose.x - half * sin(pose.yaw), pose.y + half * cos(pose.yaw)


@given(speeds, speeds, st.floats(0.0, 1.0))
def test_ramp_comes_nearer_by_no_more_than_it_may_and_never_overshoots(
    current: float, wanted: float, most: float
) -> None:
    after = ramp(current, wanted, most)
    assert abs(after - current) <= most + 1e-12
    assert min(current, wanted) - 1e-12 <= after <= max(current, wanted) + 1e-12
    if abs(wanted - current) <= most:
        assert after == pytest.approx(wanted, abs=1e-12)
