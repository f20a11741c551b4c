"""Poses, twists, angles and arcs as in REP-103: metres, radians, x forward, y left, left turns are positive."""

from math import atan2, cos, hypot, pi, sin
from typing import NamedTuple


class Pose(NamedTuple):
    """Pose of one frame in another: by default ``base_link`` in ``map``."""

    x: float  # m
    y: float  # m
    yaw: float  # rad, (-pi, pi]


class Twist(NamedTuple):
    """Velocity of ``base_link``, in ``base_link``; a differential drive has no sideways part."""

    linear: float  # m/s, forward
    angular: float  # rad/s, to the left


def wrap(angle: float) -> float:
    """Return the same angle [rad] within (-pi, pi].

    >>> wrap(3 * pi) == pi, wrap(-pi) == pi
    (True, True)
    """
    angle = (angle + pi) % (2 * pi) - pi
    return pi if angle <= -pi else angle


def integrate(pose: Pose, twist: Twist, dt: float) -> Pose:
    """Return the pose after ``dt`` [s] of a constant twist: the exact arc about the ICC (paper section 2.3)."""
    x, y, yaw = pose
    dx, dy = displacement_of_twist(yaw, twist, dt)
    return Pose(x + dx, y + dy, wrap(yaw + 2 * (twist.angular * dt / 2)))


def displacement_of_twist(yaw: float, twist: Twist, dt: float) -> tuple[float, float]:
    """Return the displacement (dx, dy) [m] after ``dt`` [s] of a constant twist, in the parent frame.

    The chord of an arc of half-angle a is sin(a)/a times the arc's length and points along yaw + a. This form does
    not divide by the yaw rate, so a straight line needs no separate formula.
    """
    linear, angular = twist
    half = angular * dt / 2
    length = linear * dt * (sin(half) / half if abs(half) > 1e-8 else 1.0)
    heading = yaw + half
    return length * cos(heading), length * sin(heading)


def poses_on_circle(x: float, y: float, diameter: float, count: int) -> list[Pose]:
    """Return ``count`` poses evenly spaced on a circle around (x, y) [m], each facing the centre."""
    turns = [2 * pi * number / count for number in range(count)]
    return [Pose(x + diameter / 2 * cos(turn), y + diameter / 2 * sin(turn), wrap(turn + pi)) for turn in turns]


def distance(a: tuple[float, ...], b: tuple[float, ...]) -> float:
    """Return the distance [m] between two points; only their first two coordinates count."""
    return hypot(a[0] - b[0], a[1] - b[1])


def bearing(pose: Pose, point: tuple[float, ...]) -> float:
    """Return the bearing [rad] of a point seen from a pose; left is positive."""
    return wrap(atan2(point[1] - pose.y, point[0] - pose.x) - pose.yaw)


def to_frame(frame: Pose, x: float, y: float) -> tuple[float, float]:
    """Transform a point [m] of the parent frame into ``frame``."""
    x0, y0, yaw = frame
    dx, dy, c, s = x - x0, y - y0, cos(yaw), sin(yaw)
    return c * dx + s * dy, c * dy - s * dx


def from_frame(frame: Pose, x: float, y: float) -> tuple[float, float]:
    """Transform a point [m] of ``frame`` into the parent frame."""
    x0, y0, yaw = frame
    c, s = cos(yaw), sin(yaw)
    return x0 + c * x - s * y, y0 + s * x + c * y
