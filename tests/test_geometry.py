"""Poses, angles and arcs, compared with independent closed forms."""

from cmath import exp, phase, rect
from math import cos, hypot, isclose, pi, sin

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from swarm.geometry import Pose, Twist, bearing, distance, from_frame, integrate, to_frame, wrap

angles = st.floats(-1e4, 1e4)
yaws = st.floats(-pi, pi, exclude_min=True)
places = st.floats(-100.0, 100.0)
poses = st.builds(Pose, places, places, yaws)
twists = st.builds(Twist, st.floats(-2.0, 2.0), st.floats(-4.0, 4.0))
times = st.floats(0.0, 3.0)


def assert_same_pose(a: Pose, b: Pose, within: float = 1e-9) -> None:
    assert hypot(a.x - b.x, a.y - b.y) <= within
    assert abs(phase(rect(1.0, a.yaw - b.yaw))) <= within


def about_the_icc(pose: Pose, twist: Twist, dt: float) -> Pose:
    """Turn the pose about its centre of curvature: the paper's section 2.3, in complex numbers."""
    heading = rect(1.0, pose.yaw)
    icc = complex(pose.x, pose.y) + 1j * heading * (twist.linear / twist.angular)
    end = icc + (complex(pose.x, pose.y) - icc) * exp(1j * twist.angular * dt)
    return Pose(end.real, end.imag, pose.yaw + twist.angular * dt)


def in_small_steps(pose: Pose, twist: Twist, dt: float, steps: int = 4000) -> Pose:
    """Follow the twist by the midpoint rule in small straight steps."""
    x, y, yaw, h = *pose, dt / steps
    for _ in range(steps):
        middle = yaw + twist.angular * h / 2
        x, y, yaw = x + twist.linear * h * cos(middle), y + twist.linear * h * sin(middle), yaw + twist.angular * h
    return Pose(x, y, yaw)


@given(angles)
def test_wrap_gives_the_same_direction_within_half_a_turn(angle: float) -> None:
    wrapped = wrap(angle)
    assert -pi < wrapped <= pi
    assert abs(exp(1j * wrapped) - exp(1j * angle)) < 1e-9
    assert wrap(wrapped) == wrapped


@pytest.mark.parametrize(("angle", "expected"), [(0.0, 0.0), (pi, pi), (-pi, pi), (3 * pi, pi), (1.5 * pi, -0.5 * pi)])
def test_wrap_at_its_edges(angle: float, expected: float) -> None:
    assert isclose(wrap(angle), expected, abs_tol=1e-12)


@given(st.floats(0.0, 1e-15))
def test_wrap_stays_within_its_bounds_a_hair_off_the_edge(hair: float) -> None:
    for angle in (pi + hair, -pi - hair, -pi + hair, pi - hair):
        assert -pi < wrap(angle) <= pi


@given(poses, twists, times)
def test_integrate_turns_about_the_icc(pose: Pose, twist: Twist, dt: float) -> None:
    assume(abs(twist.angular) > 1e-3)
    assert_same_pose(integrate(pose, twist, dt), about_the_icc(pose, twist, dt))


@given(poses, st.floats(-2.0, 2.0), times)
def test_integrate_without_a_turn_goes_straight(pose: Pose, linear: float, dt: float) -> None:
    end = integrate(pose, Twist(linear, 0.0), dt)
    assert_same_pose(end, Pose(pose.x + linear * dt * cos(pose.yaw), pose.y + linear * dt * sin(pose.yaw), pose.yaw))


@given(poses, st.floats(-2.0, 2.0), st.sampled_from([1e-5, 1e-7, 3e-8, 1e-8, 1e-9, 1e-12, 5e-324]))
def test_a_turn_that_vanishes_has_the_straight_line_as_its_limit(pose: Pose, linear: float, angular: float) -> None:
    straight = integrate(pose, Twist(linear, 0.0), 1.0)
    assert_same_pose(integrate(pose, Twist(linear, angular), 1.0), straight, within=2 * angular + 1e-12)


@pytest.mark.parametrize(
    "twist",
    [
        Twist(1.0, 0.5),
        Twist(1.0, -0.5),
        Twist(-0.7, 2.0),
        Twist(0.0, 3.0),
        Twist(0.6, 0.0),
        Twist(1.2, 1e-6),
    ],
)
def test_integrate_agrees_with_small_steps(twist: Twist) -> None:
    pose = Pose(1.0, -2.0, 0.3)
    assert_same_pose(integrate(pose, twist, 2.0), in_small_steps(pose, twist, 2.0), within=1e-6)


@given(poses, twists, times)
def test_driving_there_and_back_returns_to_the_start(pose: Pose, twist: Twist, dt: float) -> None:
    there = integrate(pose, twist, dt)
    assert_same_pose(integrate(there, Twist(-twist.linear, -twist.angular), dt), pose)


@given(poses, twists, times, times)
def test_two_stretches_are_one(pose: Pose, twist: Twist, first: float, second: float) -> None:
    assert_same_pose(
        integrate(integrate(pose, twist, first), twist, second), integrate(pose, twist, first + second), within=1e-8
    )


@given(poses, twists, times)
def test_no_end_is_farther_away_than_the_way_is_long(pose: Pose, twist: Twist, dt: float) -> None:
    assert distance(pose, integrate(pose, twist, dt)) <= abs(twist.linear) * dt + 1e-12


@given(poses, places, places)
def test_frames_there_and_back(frame: Pose, x: float, y: float) -> None:
    back = from_frame(frame, *to_frame(frame, x, y))
    assert distance(back, (x, y)) < 1e-9


@given(poses, st.floats(0.01, 50.0), yaws)
def test_bearing_is_the_direction_in_the_own_frame(pose: Pose, away: float, angle: float) -> None:
    point = from_frame(pose, away * cos(angle), away * sin(angle))
    assert abs(phase(rect(1.0, bearing(pose, point) - angle))) < 1e-6


def test_left_is_positive() -> None:
    pose = Pose(0.0, 0.0, pi / 2)
    assert bearing(pose, (-1.0, 0.0)) == pytest.approx(pi / 2)
    assert integrate(pose, Twist(0.0, 0.1), 1.0).yaw > pi / 2
