"""Poses, twists, angles and arcs, as REP-103 has them: metres, radians, x forward, y left, turning left is positive."""

from math import atan2, cos, hypot, pi, sin
from typing import NamedTuple


class Pose(NamedTuple):
    """Where a frame stands in another: by default ``base_link`` in ``map``."""

    x: float
    y: float
    yaw: float  # (-pi, pi]


class Twist(NamedTuple):
    """How ``base_link`` moves, in ``base_link``; a differential drive has no sideways part."""

    linear: float  # m/s, forward
    angular: float  # rad/s, to the left


def wrap(angle: float) -> float:
    """Bring an angle into (-pi, pi].

    >>> wrap(3 * pi) == pi, wrap(-pi) == pi
    (True, True)
    """
    angle = (angle + pi) % (2 * pi) - pi
    return pi if angle <= -pi else angle


def integrate(pose: Pose, twist: Twist, dt: float) -> Pose:
    """Follow a constant twist for ``dt``: the exact arc about the ICC (paper section 2.3), or a straight line."""
    x, y, yaw = pose
    dx, dy = chord(yaw, twist, dt)
    return Pose(x + dx, y + dy, wrap(yaw + 2 * (twist.angular * dt / 2)))


def chord(yaw: float, twist: Twist, dt: float) -> tuple[float, float]:
    """Compute how far [m] a constant twist for ``dt`` leads from where it begins, in the parent frame.

    The chord of an arc of half-angle a is sin(a)/a times its length and points along yaw + a; this form has no
    division by the yaw rate, so that the straight line is its limit and not a case of its own.
    """
    linear, angular = twist
    half = angular * dt / 2
    length = linear * dt * (sin(half) / half if abs(half) > 1e-8 else 1.0)
    heading = yaw + half
    return length * cos(heading), length * sin(heading)


def distance(a: tuple[float, ...], b: tuple[float, ...]) -> float:
    """Measure between the first two coordinates of each [m]."""
    return hypot(a[0] - b[0], a[1] - b[1])


def bearing(pose: Pose, point: tuple[float, ...]) -> float:
    """Take the direction of a point as seen from a pose [rad], positive to the left."""
    return wrap(atan2(point[1] - pose.y, point[0] - pose.x) - pose.yaw)


def to_frame(frame: Pose, x: float, y: float) -> tuple[float, float]:
    """Express a point of the parent frame in ``frame``."""
    x0, y0, yaw = frame
    dx, dy, c, s = x - x0, y - y0, cos(yaw), sin(yaw)
    return c * dx + s * dy, c * dy - s * dx


def from_frame(frame: Pose, x: float, y: float) -> tuple[float, float]:
    """Express a point of ``frame`` in the parent frame."""
    x0, y0, yaw = frame
    c, s = cos(yaw), sin(yaw)
    return x0 + c * x - s * y, y0 + s * x + c * y
