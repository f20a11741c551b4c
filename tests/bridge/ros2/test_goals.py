"""Goals of ROS: what becomes an order, and what is refused in a sentence."""

from math import inf, nan

import pytest

from swarm.bridge.ros2.convert import header, posed
from swarm.bridge.ros2.goals import GOAL_LIMIT, ordered
from swarm.bridge.ros2.topics import GOAL
from swarm.bridge.ros2.types import Types
from swarm.errors import PeerError
from swarm.geometry import Pose
from swarm.messages import Order

ROS = Types("jazzy")


def goal(frame: str = "map", x: float = 4.0, y: float = 3.0) -> bytes:
    message = ROS.make(GOAL.type, header=header(ROS, frame, 0), pose=posed(ROS, Pose(x, y, 1.0)))
    return ROS.serialize(GOAL.type, message)


def test_a_goal_on_the_map_is_an_order_to_one_target() -> None:
    payload = goal()
    assert ordered(ROS, payload, "a") == Order(id="a", targets=[(4.0, 3.0)])
    assert len(payload) <= GOAL_LIMIT


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
        ordered(ROS, payload, "a")
    assert str(refused.value) == said
