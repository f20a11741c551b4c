"""What ROS asks of a robot: a goal's payload, which may be anything, becomes an order or a refusal. Pure."""

from collections.abc import Sequence
from math import atan2, hypot, isfinite
from typing import Any, Final

from swarm.bridge.ros2.convert import IN_MAP
from swarm.bridge.ros2.topics import GOAL
from swarm.bridge.ros2.types import Types
from swarm.errors import PeerError
from swarm.geometry import wrap
from swarm.messages import Order, Point

GOAL_LIMIT: Final = 4096  # bytes; a pose takes 84 and the name of its frame
FLAT: Final = 0.01  # parts of a quaternion that a robot on a floor does not have, at most; NaN is refused
FAR: Final = 1e6  # m; no message of the fleet names a place beyond


def parse_goal(ros: Types, payload: bytes, name: str, *, turns: bool = False) -> Order:
    """Return the order to drive to a goal, and with ``turns`` to its yaw; it gets a name.

    Raises:
        PeerError: the payload is no pose, or one that is not on the floor of the map.
    """
    return build_order([ros.deserialize(GOAL.type, payload)], name, turns=turns)


def build_order(poses: Sequence[Any], name: str, *, turns: bool = False) -> Order:
    """Return the order to drive to poses with headers, one after the other, and with ``turns`` to their yaws.

    Raises:
        PeerError: there is none, or one is not on the floor of the map.
    """
    if not poses:
        raise PeerError("poses: expected at least one, got none")
    headings: list[float | None] = [parse_yaw(pose) for pose in poses] if turns else []
    return Order(id=name, targets=[parse_target(pose) for pose in poses], headings=headings)


def parse_yaw(goal: Any) -> float:  # noqa: ANN401
    """Return the yaw [rad] of a pose with a header: 0 along x, left is positive.

    Raises:
        PeerError: its orientation is no turn about the vertical axis.
    """
    turn = goal.pose.orientation
    if not (abs(turn.x) <= FLAT and abs(turn.y) <= FLAT and abs(hypot(turn.z, turn.w) - 1.0) <= FLAT):
        text = f"({turn.x}, {turn.y}, {turn.z}, {turn.w})"
        raise PeerError(f"pose.orientation: expected a turn about the vertical axis, a unit quaternion, got {text}")
    return wrap(2.0 * atan2(turn.z, turn.w))


def parse_target(goal: Any) -> Point:  # noqa: ANN401
    """Return the place [m] of a pose with a header.

    Raises:
        PeerError: it is not on the floor of the map.
    """
    frame, at = goal.header.frame_id, goal.pose.position
    if frame != IN_MAP:
        raise PeerError(f"header.frame_id: expected {IN_MAP!r}, got {frame[:40]!r}; give the goal in the map's frame")
    if not all(isfinite(value) and abs(value) <= FAR for value in (at.x, at.y)):
        raise PeerError(f"pose.position: expected x and y within 1e6 m, got ({at.x}, {at.y})")
    return at.x, at.y
