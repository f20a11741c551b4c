"""What a robot of ROS tells, out of payloads that may be anything: numbers that can be, or a refusal. Pure."""

from collections.abc import Sequence
from math import atan2, hypot, isfinite, pi, sqrt
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm.bridge.ros2.convert import IN_MAP, IN_ODOM
from swarm.bridge.ros2.topics import Qos, RosTopic
from swarm.bridge.ros2.types import Types
from swarm.errors import PeerError
from swarm.geometry import Pose, Twist
from swarm.robot.pose_estimate import WITHIN_95, YAW_WITHIN_95

ODOMETRY: Final = "nav_msgs/msg/Odometry"
LOCALISATION: Final = "geometry_msgs/msg/PoseWithCovarianceStamped"
SCAN: Final = "sensor_msgs/msg/LaserScan"
STOP: Final = "std_msgs/msg/Bool"
LIMITS: Final = {ODOMETRY: 4096, LOCALISATION: 4096, SCAN: 262_144, STOP: 64}  # bytes of a payload
FAR: Final = 1e5  # m; the fleet's messages have no place beyond
FAST: Final = 100.0  # m/s or rad/s; no wheeled robot is faster
TINY: Final = 1e-9  # m4, rounding
SHORTEST: Final = 0.5  # of a quaternion: a rotation's is 1, that of a message which nobody has filled in is 0


class Odometry(NamedTuple):
    """Where a robot is in ``odom``, and its twist."""

    stamp: float  # s, of the robot's clock
    pose: Pose
    twist: Twist


class Localisation(NamedTuple):
    """Where a robot is in ``map``, and how good that is: the errors hold in 95 % of all cases, and 0 is exact."""

    stamp: float  # s, of the robot's clock
    pose: Pose
    error: float = 0.0  # m
    yaw_error: float = 0.0  # rad


class Beams(NamedTuple):
    """A scan: beam k points to ``first + k * step``, in the frame of the scanner."""

    first: float  # rad
    step: float  # rad; negative where a scanner turns clockwise
    nearest: float  # m; what is nearer is not measured
    farthest: float  # m
    ranges: NDArray[np.float32]  # m, from the scanner


def build_topics(odom: str | None, pose: str | None, scan: str | None, stop: str | None) -> dict[str, RosTopic]:
    """Return the topics to hear by their types; None: there is none of that type. Names begin with a slash."""
    # fmt: off
    rows = (
        (odom, ODOMETRY,     Qos.DEFAULT),
        (pose, LOCALISATION, Qos.LATCHED),  # as AMCL's: it says its pose only after the robot has moved
        (scan, SCAN,         Qos.SENSOR),
        (stop, STOP,         Qos.LATCHED),
    )
    # fmt: on
    return {kind: RosTopic(name.strip("/"), kind, qos) for name, kind, qos in rows if name is not None}


def parse_odometry(ros: Types, payload: bytes) -> Odometry:
    """Return the odometry in a payload; its frame may have a prefix, as in ``r2/odom``.

    Raises:
        PeerError: it is none, or of another frame.
    """
    message = ros.deserialize(ODOMETRY, payload)
    expect_frame(message.header.frame_id, IN_ODOM)
    linear, angular = message.twist.twist.linear.x, message.twist.twist.angular.z
    if not all(isfinite(speed) and abs(speed) <= FAST for speed in (linear, angular)):
        raise PeerError(f"twist: expected speeds within {FAST:g} m/s and rad/s, got ({linear}, {angular})")
    return Odometry(parse_stamp(message.header), parse_pose(message.pose.pose), Twist(linear, angular))


def parse_localisation(ros: Types, payload: bytes) -> Localisation:
    """Return the localisation in a payload.

    Raises:
        PeerError: it is none, or not in the map.
    """
    message = ros.deserialize(LOCALISATION, payload)
    expect_frame(message.header.frame_id, IN_MAP)
    return Localisation(
        parse_stamp(message.header), parse_pose(message.pose.pose), *compute_pose_errors(message.pose.covariance)
    )


def compute_pose_errors(covariance: Sequence[float]) -> tuple[float, float]:
    """Return within which radius [m] and angle [rad] a pose is in 95 % of all cases, by a covariance of ROS (36).

    The radius is that of the longer axis of its ellipse, so the disc has the ellipse in it.

    Raises:
        PeerError: it is no covariance.
    """
    xx, xy, yy, turn = (float(covariance[index]) for index in (0, 1, 7, 35))
    if not all(map(isfinite, (xx, xy, yy, turn))) or min(xx, yy, turn) < 0.0 or xy * xy > xx * yy + TINY:
        raise PeerError(f"pose.covariance: expected that of x, y and yaw, got ({xx}, {xy}, {yy}, {turn})")
    longest = (xx + yy) / 2 + hypot((xx - yy) / 2, xy)  # m2, the larger eigenvalue
    return min(FAR, WITHIN_95 * sqrt(longest)), min(pi, YAW_WITHIN_95 * sqrt(turn))


def parse_scan(ros: Types, payload: bytes) -> Beams:
    """Return the scan in a payload.

    Raises:
        PeerError: it is none.
    """
    message = ros.deserialize(SCAN, payload)
    first, step = message.angle_min, message.angle_increment
    if not (isfinite(first) and isfinite(step) and step != 0.0 and len(message.ranges)):
        raise PeerError(f"expected beams at angles, got {len(message.ranges)} from {first} rad on, {step} rad apart")
    nearest, farthest = message.range_min, message.range_max
    if not 0.0 <= nearest < farthest:
        raise PeerError(f"expected 0 <= range_min < range_max, got {nearest} and {farthest}")
    return Beams(first, step, nearest, farthest, message.ranges)


def parse_stop(ros: Types, payload: bytes) -> bool:
    """Return True if an emergency stop is pressed.

    Raises:
        PeerError: the payload is no ``std_msgs/Bool``.
    """
    return bool(ros.deserialize(STOP, payload).data)


def expect_frame(found: str, expected: str) -> None:
    """Check the frame of a message; it may have the robot's name before it.

    Raises:
        PeerError: it is another one.
    """
    if found.rpartition("/")[2] != expected:
        raise PeerError(f"header.frame_id: expected {expected!r}, got {found[:40]!r}")


def parse_pose(message: Any) -> Pose:  # noqa: ANN401, rosbags makes the classes when it starts
    """Return a pose of ROS on the floor.

    Raises:
        PeerError: it is no place or no rotation.
    """
    at, turn = message.position, message.orientation
    if not all(isfinite(value) and abs(value) <= FAR for value in (at.x, at.y)):
        raise PeerError(f"pose.position: expected x and y within 1e5 m, got ({at.x}, {at.y})")
    quaternion: Sequence[float] = (turn.x, turn.y, turn.z, turn.w)
    if not (all(map(isfinite, quaternion)) and hypot(*quaternion) >= SHORTEST):
        raise PeerError(f"pose.orientation: expected a rotation, got {quaternion}")
    x, y, z, w = quaternion
    return Pose(at.x, at.y, atan2(2 * (w * z + x * y), w * w + x * x - y * y - z * z))


def parse_stamp(header: Any) -> float:  # noqa: ANN401
    """Return the time of a message [s]; 0 if nobody has stamped it."""
    return float(header.stamp.sec + header.stamp.nanosec / 1e9)
