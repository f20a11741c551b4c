"""Goals of ROS: what becomes an order, and what is refused in a sentence."""

from math import inf, nan, pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm.bridge.ros2.convert import make_header, make_pose_message
from swarm.bridge.ros2.goals import GOAL_LIMIT, build_order, parse_goal
from swarm.bridge.ros2.topics import GOAL
from swarm.bridge.ros2.types import Types
from swarm.errors import PeerError
from swarm.geometry import Pose, wrap
from swarm.messages import Order

ROS = Types("jazzy")


def goal(frame: str = "map", x: float = 4.0, y: float = 3.0, yaw: float = 1.0) -> bytes:
    message = ROS.make_message(
        GOAL.type, header=make_header(ROS, frame, 0), pose=make_pose_message(ROS, Pose(x, y, yaw))
    )
    return ROS.serialize(GOAL.type, message)


def test_a_goal_on_the_map_is_an_order_to_one_target() -> None:
    payload = goal()
    assert parse_goal(ROS, payload, "a") == Order(id="a", targets=[(4.0, 3.0)])
    assert len(payload) <= GOAL_LIMIT


def test_the_yaw_of_a_goal_is_heeded_if_that_is_asked_for() -> None:
    (yaw,) = parse_goal(ROS, goal(), "a", turns=True).headings
    assert yaw == pytest.approx(1.0)


@given(st.floats(-pi, pi))
def test_any_yaw_comes_back(yaw: float) -> None:
    (found,) = build_order([ROS.deserialize(GOAL.type, goal(yaw=yaw))], "a", turns=True).headings
    assert found is not None
    assert abs(wrap(found - yaw)) < 1e-9


@pytest.mark.parametrize(
    "turn", [(0.0, 0.0, 0.0, 0.0), (0.7, 0.0, 0.0, 0.7), (0.0, 0.0, nan, 1.0), (0.0, 0.0, 1.0, 1.0)]
)
def test_an_orientation_off_the_floor_is_refused(turn: tuple[float, float, float, float]) -> None:
    message = ROS.deserialize(GOAL.type, goal())
    message.pose.orientation.x, message.pose.orientation.y, message.pose.orientation.z, message.pose.orientation.w = (
        turn
    )
    assert build_order([message], "a").headings == [], "nobody asked for it"
    with pytest.raises(PeerError, match=r"pose\.orientation: expected a turn about the vertical axis"):
        build_order([message], "a", turns=True)


@pytest.mark.parametrize(
    ("payload", "said"),
    [
        (goal(frame="odom"), "header.frame_id: expected 'map', got 'odom'; give the goal in the map's frame"),
        (goal(frame=""), "header.frame_id: expected 'map', got ''; give the goal in the map's frame"),
        (goal(x=nan), "pose.position: expected x and y within 1e6 m, got (nan, 3.0)"),
        (goal(y=-inf), "pose.position: expected x and y within 1e6 m, got (4.0, -inf)"),
        (goal(x=2e6), "pose.position: expected x and y within 1e6 m, got (2000000.0, 3.0)"),
    ],
)
def test_a_goal_elsewhere_is_refused(payload: bytes, said: str) -> None:
    with pytest.raises(PeerError) as refused:
        parse_goal(ROS, payload, "a")
    assert str(refused.value) == said
