"""What a click in a viewer asks of a robot: a pose as JSON or as CDR becomes an order or a refusal. Pure."""

import msgspec
from msgspec import Struct

from swarm.bridge.ros2.goals import build_order, parse_goal
from swarm.bridge.ros2.topics import GOAL
from swarm.bridge.ros2.types import Types
from swarm.errors import PeerError
from swarm.messages import Order


class Header(Struct):
    """A std_msgs/msg/Header; its stamp is not heeded."""

    frame_id: str


class ClickPoint(Struct):
    """A geometry_msgs/msg/Point."""

    x: float
    y: float
    z: float = 0.0


class Quaternion(Struct):
    """A geometry_msgs/msg/Quaternion."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    w: float = 1.0


class Pose(Struct):
    """A geometry_msgs/msg/Pose."""

    position: ClickPoint
    orientation: Quaternion


class PoseStamped(Struct):
    """A geometry_msgs/msg/PoseStamped, as the viewer's 3D panel publishes it."""

    header: Header
    pose: Pose


DECODER = msgspec.json.Decoder(PoseStamped)


def parse_click(ros: Types, encoding: str, payload: bytes, name: str) -> Order:
    """Return the order to drive to a goal; it gets a name.

    Raises:
        PeerError: the payload is no pose, or one that is not on the floor of the map.
    """
    match encoding:
        case "cdr":
            return parse_goal(ros, payload, name)
        case "json":
            try:
                goal = DECODER.decode(payload)
            except (msgspec.DecodeError, UnicodeDecodeError) as fault:
                raise PeerError(f"expected {GOAL.type} as JSON, got {len(payload)} bytes: {fault}") from None
            return build_order([goal], name)
    raise PeerError(f"expected {GOAL.type} as json or cdr, got encoding {encoding[:40]!r}")
