"""CDR: bytes that are known, and any bytes from outside."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm.bridge.cdr.layouts import CDR_HEADER
from swarm.bridge.ros2.topics import GOAL, HEARD
from swarm.bridge.ros2.types import Types
from swarm.errors import PeerError

ROS = Types("jazzy")
TIME = "builtin_interfaces/msg/Time"


def test_a_message_is_serialized_as_ros_does_it() -> None:
    moment = ROS.make_message(TIME, sec=2, nanosec=500)
    assert ROS.serialize(TIME, moment).hex(" ", 4) == "00010000 02000000 f4010000"
    text = ROS.make_message("std_msgs/msg/String", data="Hi")
    assert ROS.serialize("std_msgs/msg/String", text) == CDR_HEADER + b"\x03\x00\x00\x00Hi\x00"


@pytest.mark.parametrize(
    ("payload", "said"),
    [
        (b"", "begins with 00 01 00 00, got ''"),
        (b"\x00\x00\x00\x00" + bytes(80), "begins with 00 01 00 00, got '00 00 00 00'"),
        (CDR_HEADER, "got 4 bytes that are none"),
        (CDR_HEADER + b"\xff" * 80, "got 84 bytes that are none"),
    ],
)
def test_what_is_no_cdr_is_refused_in_a_sentence(payload: bytes, said: str) -> None:
    with pytest.raises(PeerError, match=r"expected CDR of geometry_msgs/msg/PoseStamped") as refused:
        ROS.deserialize(GOAL.type, payload)
    assert said in str(refused.value)


@given(st.binary(max_size=120), st.sampled_from([topic.type for topic in HEARD]))
def test_any_bytes_are_a_message_or_refused(payload: bytes, name: str) -> None:
    try:
        message = ROS.deserialize(name, CDR_HEADER + payload)
    except PeerError:
        return
    ROS.serialize(name, message)
