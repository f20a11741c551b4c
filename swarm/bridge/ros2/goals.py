"""What ROS asks of a robot: a goal's payload, which may be anything, becomes an order or a refusal. Pure."""

from math import isfinite
from typing import Any, Final

from swarm.bridge.ros2.convert import IN_MAP
from swarm.bridge.ros2.topics import GOAL
from swarm.bridge.ros2.types import Types
from swarm.errors import PeerError
from swarm.messages import Order

GOAL_LIMIT: Final = 4096  # bytes; a pose takes 84 and the name of its frame
FAR: Final = 1e6  # m; no message of the fleet names a place beyond


def ordered(ros: Types, payload: bytes, name: str) -> Order:
    """Return the order to drive to a goal; it gets a name. The goal's yaw is not heeded: robots do not turn at a stop.

    Raises:
        PeerError: the payload is no pose, or one that is not on the floor of the map.
    """
    return order_to(ros.deserialize(GOAL.type, payload), name)


def order_to(goal: Any, name: str) -> Order:  # noqa: ANN401, a geometry_msgs/msg/PoseStamped or what has its fields
    """Return the order to drive to a goal, which is not trusted yet.

    Raises:
        PeerError: it is not on the floor of the map.
    """
    frame, at = goal.header.frame_id, goal.pose.position
    if frame != IN_MAP:
        raise PeerError(f"header.frame_id: expected {IN_MAP!r}, got {frame[:40]!r}; give the goal in the map's frame")
    if not all(isfinite(value) and abs(value) <= FAR for value in (at.x, at.y)):
        raise PeerError(f"pose.position: expected x and y within 1e6 m, got ({at.x}, {at.y})")
    return Order(id=name, targets=[(at.x, at.y)])
