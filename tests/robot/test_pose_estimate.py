"""The pose estimate: what it says of the true pose holds for every error that keeps its bound, and a jump is seen."""

from math import cos, hypot, pi, sin
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm.geometry import Pose, Twist, distance, integrate, wrap
from swarm.messages import Sense
from swarm.robot.pose_estimate import BOUND, SURE, YAW_BOUND, Disc, PoseEstimator, intersect, smallest_cover

DT, ACCELERATION, TRACK = 0.05, 2.0, 0.4
STANDS = Twist(0.0, 0.0)
ERROR, YAW_ERROR = 0.05, 0.03  # m, rad; 95 %
places = st.floats(-3, 3)
radii = st.floats(0.01, 2)
discs = st.builds(Disc, places, places, radii)
shares = st.floats(-1, 1)


def sense(tick: int, pose: Pose, twist: Twist = STANDS, error: float = ERROR) -> Sense:
    return Sense(
        world="w", run=0, tick=tick, time=tick * DT, lockstep=True, x=pose.x, y=pose.y, yaw=pose.yaw,
        linear=twist.linear, angular=twist.angular, left=1.6, front=1.6, right=1.6, bearings=[], hears=[], rays=[],
        pose_error=error, yaw_error=YAW_ERROR * (error > 0),
    )  # fmt: skip


def off(pose: Pose, along: float, turn: float, yaw: float) -> Pose:
    """Return a fix that is off by shares of what its bounds allow."""
    far = along * BOUND * ERROR
    return Pose(
        pose.x + far * cos(turn * pi), pose.y + far * sin(turn * pi), wrap(pose.yaw + yaw * YAW_BOUND * YAW_ERROR)
    )


@given(a=discs, b=discs, x=places, y=places)
def test_what_two_discs_share_is_in_the_disc_around_it(a: Disc, b: Disc, x: float, y: float) -> None:
    shared = all(hypot(x - disc.x, y - disc.y) <= disc.radius for disc in (a, b))
    found = intersect(a, b)
    if shared:
        assert found is not None
        assert hypot(x - found.x, y - found.y) <= found.radius + 1e-9
    if found is not None:
        assert found.radius <= min(a.radius, b.radius) + 1e-9


@given(a=discs, b=discs)
def test_discs_share_nothing_exactly_when_they_are_apart(a: Disc, b: Disc) -> None:
    assert (intersect(a, b) is None) == (hypot(b.x - a.x, b.y - a.y) > a.radius + b.radius)


@given(a=discs, b=discs, turn=st.floats(0, 2 * pi))
def test_a_cover_has_both_discs_in_it_and_no_more(a: Disc, b: Disc, turn: float) -> None:
    both = smallest_cover(a, b)
    for disc in (a, b):
        assert hypot(disc.x - both.x, disc.y - both.y) + disc.radius <= both.radius + 1e-9
    assert both.radius <= max(a.radius, b.radius, (hypot(b.x - a.x, b.y - a.y) + a.radius + b.radius) / 2) + 1e-9


def test_an_exact_pose_passes_unchanged() -> None:
    estimate = PoseEstimator(DT, ACCELERATION, TRACK, Pose(5.0, 5.0, 0.0)).update(
        sense(3, Pose(1.0, 2.0, 0.3), error=0.0)
    )
    assert estimate == (Pose(1.0, 2.0, 0.3), 0.0, 0.0, 0.0)


errors = st.tuples(st.floats(0, 1), shares, shares)


@given(
    moves=st.lists(st.tuples(st.floats(-0.5, 1.0), st.floats(-2, 2), errors, shares), min_size=1, max_size=60),
    begins=st.booleans(),
)
def test_the_true_pose_is_within_what_is_said_whatever_the_errors(
    moves: list[tuple[float, float, tuple[float, float, float], float]], begins: bool
) -> None:
    """The wheels slip by up to 4 %, and each fix is anywhere within its bound."""
    true = Pose(1.0, 2.0, 0.5)
    estimator = PoseEstimator(DT, ACCELERATION, TRACK, true if begins else None)
    estimator.update(sense(0, off(true, 0.3, 0.1, 0.2)))
    for tick, (linear, angular, error, slip) in enumerate(moves, 1):
        true = integrate(true, Twist(linear * (1 + 0.04 * slip), angular * (1 + 0.04 * slip)), DT)
        found = estimator.update(sense(tick, off(true, *error), Twist(linear, angular)))
        assert distance(found.pose, true) <= found.error + 1e-6
        assert abs(wrap(found.pose.yaw - true.yaw)) <= found.yaw_error + 1e-6
        assert found.error <= BOUND * ERROR + 1e-5
        assert found.jumped == 0.0


def test_a_robot_that_knows_its_start_is_exact_there() -> None:
    start = Pose(1.0, 2.0, 0.5)
    found = PoseEstimator(DT, ACCELERATION, TRACK, start).update(sense(0, off(start, 0.9, 0.5, 0.5)))
    assert (found.pose, found.error) == (start, 0.0)


def test_standing_it_learns_more_with_each_fix() -> None:
    true, estimator = Pose(0.0, 0.0, 0.0), PoseEstimator(DT, ACCELERATION, TRACK)
    said = [estimator.update(sense(tick, off(true, 0.9, tick / 7, 0.0))).error for tick in range(14)]
    assert said == sorted(said, reverse=True)
    assert said[-1] < 0.6 * said[0]


def jump(estimator: PoseEstimator, ticks: range, pose: Pose) -> list[float]:
    return [estimator.update(sense(tick, pose)).jumped for tick in ticks]


def test_a_jump_is_open_until_the_old_pose_is_back() -> None:
    here, there = Pose(0.0, 0.0, 0.0), Pose(0.3, 0.0, 0.0)
    estimator = PoseEstimator(DT, ACCELERATION, TRACK)
    assert jump(estimator, range(10), here) == [0.0] * 10
    found = estimator.update(sense(10, there))
    assert found.jumped == pytest.approx(0.3)
    for pose in (here, there):
        assert distance(found.pose, pose) + BOUND * ERROR <= found.error + 1e-3, "both are in what it keeps"
    assert jump(estimator, range(11, 50), there)[-1] > 0.0
    assert jump(estimator, range(50, 52), here) == [0.0, 0.0]


def test_a_pose_that_stays_elsewhere_is_believed_in_the_end() -> None:
    here, there = Pose(0.0, 0.0, 0.0), Pose(0.3, 0.0, 0.0)
    estimator = PoseEstimator(DT, ACCELERATION, TRACK)
    jump(estimator, range(10), here)
    said = jump(estimator, range(10, 10 + round(SURE / DT) + 2), there)
    assert [one > 0.0 for one in said] == [True] * round(SURE / DT) + [False] * 2


@pytest.mark.parametrize("seed", range(20))
def test_a_pose_that_jumped_a_little_and_came_back_is_found_again(seed: int) -> None:
    draw, estimator, error = Random(seed), PoseEstimator(DT, ACCELERATION, TRACK), 0.0
    for tick in range(round(20.0 / DT)):
        jumped = 0.09 if 4.0 <= tick * DT < 7.0 else 0.0  # m: many fixes agree with both poses
        place = off(Pose(jumped, 0.0, 0.0), draw.random() ** 0.5, draw.uniform(-1, 1), draw.uniform(-1, 1))
        found = estimator.update(sense(tick, place))
        if tick * DT >= 7.0 + 2 * SURE:
            error = max(error, distance(found.pose, Pose(0.0, 0.0, 0.0)) - found.error)
            assert found.jumped == 0.0
    assert error < 0.01


def test_one_fix_that_speaks_against_a_pose_does_not_replace_it() -> None:
    estimator = PoseEstimator(DT, ACCELERATION, TRACK)
    said = jump(estimator, range(10), Pose(-0.05, 0.0, 0.0)) + jump(estimator, range(10, 20), Pose(0.05, 0.0, 0.0))
    assert said == [0.0] * 20
    assert jump(estimator, range(20, 21), Pose(0.1, 0.0, 0.0))[0] > 0.0
    last = 23 + round(SURE / DT)
    said = jump(estimator, range(21, last), Pose(0.03, 0.0, 0.0))  # both poses can be
    assert (said[0] > 0.0, said[-1]) == (True, 0.0)
    assert estimator.update(sense(last, Pose(0.03, 0.0, 0.0))).pose.x == pytest.approx(0.0, abs=0.01)


def test_a_turn_that_no_wheel_has_made_is_a_jump_too() -> None:
    estimator = PoseEstimator(DT, ACCELERATION, TRACK)
    jump(estimator, range(10), Pose(0.0, 0.0, 0.0))
    found = estimator.update(sense(10, Pose(0.0, 0.0, 0.5)))
    assert found.yaw_error >= 0.25


def test_after_a_sleep_only_the_fix_counts() -> None:
    estimator = PoseEstimator(DT, ACCELERATION, TRACK)
    jump(estimator, range(10), Pose(0.0, 0.0, 0.0))
    found = estimator.update(sense(100, Pose(2.0, 1.0, 1.0)))
    assert (found.jumped, found.pose) == (0.0, Pose(2.0, 1.0, 1.0))
