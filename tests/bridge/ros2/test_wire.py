"""The names that rmw_zenoh has: what it writes itself, and what two other programs compute."""

from dataclasses import replace
from typing import Final

import pytest
from hypothesis import given
from hypothesis import strategies as st
from xxhash import xxh3_128_digest

from swarm.bridge.names import assign_namespaces
from swarm.bridge.ros2.interfaces import ActionText, ServiceText
from swarm.bridge.ros2.topics import HEARD, MAP, ODOMETRY, OF_FLEET, OF_ROBOT, RosService
from swarm.bridge.ros2.types import DISTROS, Types
from swarm.bridge.ros2.wire import Dialect, EndpointKind, RosEndpoint, RosNode, pack_attachment
from swarm.cli.bridge import ros2
from swarm.errors import PeerError

# fmt: off
HASHES: Final = {
    # rmw_zenoh's docs/design.md
    "std_msgs/msg/String":            "df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18",
    # the tests of hiroz, verified there against rmw_zenoh_cpp
    "action_msgs/msg/GoalStatusArray": "6c1684b00f177d37438febe6e709fc4e2b0d4248dca4854946f9ed8b30cda83e",
    "rcl_interfaces/srv/GetParameters": "bf9803d5c74cf989a5de3e0c2e99444599a627c7ff75f97b8c05b01003675cbc",
    # what zenoh-ros2-sdk 0.1.8 computes from the definitions of Jazzy
    "nav_msgs/msg/OccupancyGrid":     "8d348150c12913a31ee0ec170fbf25089e4745d17035792a1ba94d6f0bc0cfc7",
    "rosgraph_msgs/msg/Clock":        "692f7a66e93a3c83e71765d033b60349ba68023a8c689a79e48078bcb5c58564",
    "tf2_msgs/msg/TFMessage":         "e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087",
    "nav_msgs/msg/Odometry":          "3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0",
    "sensor_msgs/msg/LaserScan":      "64c191398013af96509d518dac71d5164f9382553fce5c1f8cca5be7924bd828",
    "nav_msgs/msg/Path":              "1957a5bb3cee5da65c4e52e52b65a93df227efce4c20f8458b36e73066ca334b",
    "geometry_msgs/msg/PoseStamped":  "10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8",
    "geometry_msgs/msg/PoseWithCovarianceStamped":
                                      "26432f9803e43727d3c8f668d1fdb3c630f548af631e2f4e31382371bfea3b6e",
    # `ros2 topic info -v` of others, in public notes
    "sensor_msgs/msg/BatteryState":   "4bee5dfce981c98faa6828b868307a0a73f992ed0789f374ee96c8f840e69741",
    # other programs that speak with ROS 2 on this wire
    "diagnostic_msgs/msg/DiagnosticArray": "5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e",
    "visualization_msgs/msg/MarkerArray":  "86cb8800b6fb05b5eff1abd7a56f62a5641d3ae9a1c29e78e67e704f1d067dcf",
}
# fmt: on
FLEET: Final = RosNode(domain=0, session="abc", number=0, namespace="/")
R1: Final = RosNode(domain=7, session="abc", number=4, namespace="/r1")


@pytest.mark.parametrize("distro", DISTROS)
@pytest.mark.parametrize("name", HASHES)
def test_the_hash_of_a_type_is_that_of_others(distro: str, name: str) -> None:
    assert Types(distro).type_hash(name) == f"RIHS01_{HASHES[name]}"


def test_the_hash_of_a_service_or_an_action_is_that_of_others() -> None:
    """AddTwoInts is in rmw_zenoh's docs/design.md, Fibonacci in the tests of hiroz."""
    made = Types("jazzy")
    made.add_service("example_interfaces/srv/AddTwoInts", ServiceText("int64 a\nint64 b", "int64 sum"))
    found = made.type_hash("example_interfaces/srv/AddTwoInts")
    assert found == "RIHS01_e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a"
    parts = ActionText("int32 order", "int32[] sequence", "int32[] partial_sequence")
    made.add_action("action_tutorials_interfaces/action/Fibonacci", parts)
    found = made.type_hash("action_tutorials_interfaces/action/Fibonacci_GetResult")
    assert found == "RIHS01_8b47e383f1e31f6d8df6417ab54957e7d5ea24dad315646ad711ac3fdea81d58"


FEEDBACK: Final = {  # of NavigateToPose's feedback message, the first digits as another implementation has them
    "jazzy": "9d1f6fa2eb975", "kilted": "9d1f6fa2eb975", "lyrical": "2c1b4ec1a0e3a"
}  # fmt: skip


@pytest.mark.parametrize("distro", DISTROS)
def test_feedback_differs_between_distributions(distro: str) -> None:
    found = Types(distro).type_hash("nav2_msgs/action/NavigateToPose_FeedbackMessage")
    assert found.startswith(f"RIHS01_{FEEDBACK[distro]}")


def test_the_hash_of_every_topic_is_known() -> None:
    assert {topic.type for topic in (*OF_FLEET, *OF_ROBOT, *HEARD)} <= HASHES.keys()


def test_the_command_offers_what_the_bridge_knows() -> None:
    assert tuple(DISTROS) == ros2.DISTROS
    assert tuple(Dialect) == ros2.DIALECTS


def test_a_node_has_a_token() -> None:
    assert FLEET.token == "@ros2_lv/0/abc/0/0/NN/%/%/swarm_bridge"
    assert R1.token == "@ros2_lv/7/abc/4/4/NN/%/%r1/swarm_bridge"


def test_a_publisher_and_a_subscriber_have_a_key_and_a_token() -> None:
    assert R1.make_endpoint(5, EndpointKind.PUBLISHER, ODOMETRY, "RIHS01_12") == RosEndpoint(
        key="7/r1/odom/nav_msgs::msg::dds_::Odometry_/RIHS01_12",
        token="@ros2_lv/7/abc/4/5/MP/%/%r1/swarm_bridge/%r1%odom/nav_msgs::msg::dds_::Odometry_/RIHS01_12/::,10:,:,:,,",
    )
    assert FLEET.make_endpoint(1, EndpointKind.SUBSCRIBER, MAP, "RIHS01_34") == RosEndpoint(
        key="0/map/nav_msgs::msg::dds_::OccupancyGrid_/RIHS01_34",
        token="@ros2_lv/0/abc/0/1/MS/%/%/swarm_bridge/%map/nav_msgs::msg::dds_::OccupancyGrid_/RIHS01_34/:1:,1:,:,:,,",
    )


def test_a_service_has_a_key_and_a_token() -> None:
    service = RosService("navigate_to_pose/_action/cancel_goal", "action_msgs/srv/CancelGoal")
    assert R1.make_endpoint(6, EndpointKind.SERVICE, service, "RIHS01_56") == RosEndpoint(
        key="7/r1/navigate_to_pose/_action/cancel_goal/action_msgs::srv::dds_::CancelGoal_/RIHS01_56",
        token="@ros2_lv/7/abc/4/6/SS/%/%r1/swarm_bridge/%r1%navigate_to_pose%_action%cancel_goal/"
        "action_msgs::srv::dds_::CancelGoal_/RIHS01_56/::,10:,:,:,,",
    )


def test_an_answer_has_the_number_and_the_gid_of_its_request() -> None:
    endpoint = R1.make_endpoint(6, EndpointKind.SERVICE, RosService("ask", "a/srv/B"), "RIHS01_56")
    request = pack_attachment(9, 1, bytes(range(16)))
    assert endpoint.make_answer_attachment(request, 7) == pack_attachment(9, 7, bytes(range(16)))
    for bad in (None, b"", request[:-1], request[:16] + b"\x0f" + request[17:]):
        with pytest.raises(PeerError, match="expected an attachment of 33 bytes"):
            endpoint.make_answer_attachment(bad, 7)


def test_in_the_dialect_of_ros2dds_a_key_is_the_name_and_nothing_is_attached() -> None:
    node = replace(R1, dialect=Dialect.ROS2DDS)
    assert node.token is None
    endpoint = node.make_endpoint(5, EndpointKind.PUBLISHER, ODOMETRY, "RIHS01_12")
    assert endpoint == RosEndpoint(key="r1/odom", token=None)
    assert (endpoint.make_attachment(1, 2), endpoint.make_answer_attachment(None, 2)) == (None, None)
    assert replace(FLEET, dialect=Dialect.ROS2DDS).make_endpoint(1, EndpointKind.PUBLISHER, MAP, "").key == "map"


def test_a_gid_is_the_digest_of_the_token_from_its_low_end() -> None:
    """The canonical form of XXH3-128 is big-endian; rmw_zenoh copies the two halves of the number as they are."""
    endpoint = R1.make_endpoint(5, EndpointKind.PUBLISHER, ODOMETRY, "RIHS01_12")
    assert endpoint.token is not None
    assert endpoint.gid == xxh3_128_digest(endpoint.token.encode())[::-1]


def test_an_attachment_is_33_bytes() -> None:
    attached = pack_attachment(1, 0x0102030405060708, bytes(range(16)))
    assert attached.hex(" ", 8) == "01 0000000000000008 0706050403020110 0001020304050607 08090a0b0c0d0e0f"


NAMES: Final = st.text("abR09_.:-", min_size=1, max_size=8)


@given(st.lists(NAMES, unique=True, max_size=8))
def test_each_robot_has_a_namespace_of_its_own_that_ros_takes_or_is_told_why_not(robots: list[str]) -> None:
    """Names of ROS: https://design.ros2.org/articles/topic_and_service_names.html."""
    given_to, refused = assign_namespaces(robots)
    assert sorted([*given_to, *refused]) == sorted(robots)
    assert len(set(given_to.values())) == len(given_to)
    assert set(refused.values()) <= given_to.keys()
    for space in given_to.values():
        assert space.startswith("/")
        assert space[1].isalpha()
        assert space[1:].replace("_", "a").isalnum()
        assert "__" not in space
