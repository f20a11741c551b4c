"""Goals that are clicked: what becomes an order, and what is refused in a sentence."""

import pytest

from swarm.bridge.foxglove.clicks import parse_click
from swarm.bridge.ros2.types import Types
from swarm.errors import PeerError
from swarm.messages import Order
from tests.bridge.foxglove.read import pose

ROS = Types("jazzy")


def test_a_click_on_the_map_is_an_order_to_one_target() -> None:
    assert parse_click(ROS, "json", pose(4, 3.5), "a") == Order(id="a", targets=[(4.0, 3.5)])


@pytest.mark.parametrize(
    ("encoding", "payload", "said"),
    [
        ("json", pose(4, 3, frame="r1/odom"), "header.frame_id: expected 'map', got 'r1/odom'; give the goal in the map's frame"),
        ("json", pose(2e6, 3),   "pose.position: expected x and y within 1e6 m, got (2000000.0, 3.0)"),
        ("json", b"",            "expected geometry_msgs/msg/PoseStamped as JSON, got 0 bytes: Input data was truncated"),
        ("json", b"\xff\xfe",    "expected geometry_msgs/msg/PoseStamped as JSON, got 2 bytes: JSON is malformed: invalid character (byte 0)"),
        ("json", b"[1]",         "expected geometry_msgs/msg/PoseStamped as JSON, got 3 bytes: Expected `object`, got `array`"),
        ("json", b'{"header": NaN}', "expected geometry_msgs/msg/PoseStamped as JSON, got 15 bytes: JSON is malformed: invalid character (byte 11)"),
        ("json", b'{"header": {"frame_id": "map"}, "pose": {"position": {"x": "4", "y": 3}, "orientation": {}}}',
                                 "expected geometry_msgs/msg/PoseStamped as JSON, got 92 bytes: Expected `float`, got `str` - at `$.pose.position.x`"),
        ("cdr",  b"none",        "expected CDR of geometry_msgs/msg/PoseStamped, which begins with 00 01 00 00, got '6e 6f 6e 65'"),
        ("protobuf", b"",        "expected geometry_msgs/msg/PoseStamped as json or cdr, got encoding 'protobuf'"),
    ],
)  # fmt: skip
def test_anything_else_is_refused(encoding: str, payload: bytes, said: str) -> None:
    with pytest.raises(PeerError) as refused:
        parse_click(ROS, encoding, payload, "a")
    assert str(refused.value) == said
