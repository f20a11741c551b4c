"""Goals of an action: which a request cancels, which are forgotten, and how far one is; and the bytes of an answer."""

import numpy as np
import pytest
from msgspec.structs import replace

from swarm.bridge.errand import OrderErrand
from swarm.bridge.ros2.actions import (
    KEPT,
    MOST,
    NAVIGATE_TO_POSE,
    NAVIGATION,
    CancelCode,
    Goal,
    Goals,
    GoalStatus,
    RosAction,
    estimate_time_left,
    make_feedback,
    make_result_fields,
    measure_remaining_route,
)
from swarm.bridge.ros2.types import DISTROS, Types
from swarm.geometry import Pose
from swarm.messages import Activity, Order, Point
from tests.messages.made import state

HERE = Pose(0.0, 0.0, 0.0)


def goal(number: int, at: int = 0, status: GoalStatus = GoalStatus.EXECUTING, *targets: Point) -> Goal:
    places = list(targets) or [(3.0, 4.0)]
    errand = OrderErrand("a", Order(id=str(number), targets=places), number, run=1)
    return Goal(id=bytes([number] * 16), at=at, errand=errand, targets=places, status=status)


def known() -> Goals:
    """Return goals 1 to 3, of which 1 has ended; 3 was accepted last."""
    goals = Goals()
    for one in (goal(1, 10, GoalStatus.SUCCEEDED), goal(2, 20), goal(3, 30)):
        goals.add_goal(one, now=0.0)
    return goals


@pytest.mark.parametrize(
    ("number", "at", "code", "chosen"),
    [
        (0, 0, CancelCode.NONE, [2, 3]),
        (2, 0, CancelCode.NONE, [2]),
        (1, 0, CancelCode.TERMINATED, []),
        (9, 0, CancelCode.UNKNOWN_GOAL, []),
        (0, 20, CancelCode.NONE, [2]),
        (0, 19, CancelCode.NONE, []),
        (3, 20, CancelCode.NONE, [2, 3]),
        (9, 20, CancelCode.NONE, [2]),
    ],
)
def test_a_request_cancels_by_id_by_time_or_all(number: int, at: int, code: CancelCode, chosen: list[int]) -> None:
    found, goals = known().find_goals_to_cancel(bytes([number] * 16), at)
    assert (found, [one.errand.number for one in goals]) == (code, chosen)


def test_a_result_is_kept_for_a_while_and_not_more_than_some() -> None:
    goals = Goals()
    goals.add_goal(goal(1), now=0.0)
    goals.end_goal(goals.all_goals[0], GoalStatus.ABORTED, "why", now=1.0)
    goals.add_goal(goal(2), now=1.0 + KEPT)
    assert [one.errand.number for one in goals.all_goals] == [1, 2]
    goals.add_goal(goal(3), now=1.1 + KEPT)
    assert [one.errand.number for one in goals.all_goals] == [2, 3], "2 has not ended"
    for number in range(4, 4 + MOST):
        goals.add_goal(goal(number), now=0.0)
        goals.end_goal(goals.all_goals[-1], GoalStatus.SUCCEEDED, "", now=0.0)
    assert len(goals.all_goals) == MOST
    assert [one.errand.number for one in goals.open_goals] == [2, 3]


def test_what_is_left_is_the_robots_own_path_and_then_lines() -> None:
    one = goal(1, 0, GoalStatus.EXECUTING, (3.0, 4.0), (3.0, 6.0), (3.0, 7.0))
    assert measure_remaining_route(one, HERE) == (5.0 + 3.0, 3), "not taken up yet"
    moving = state(20, assignment=1, reached=[False] * 3, distance=6.5, activity=Activity.DRIVE)
    one.errand.apply_message(moving)
    assert measure_remaining_route(one, HERE) == (6.5 + 3.0, 3)
    one.errand.apply_message(replace(moving, target=2, reached=[True, True, False], distance=0.5))
    assert measure_remaining_route(one, HERE) == (0.5, 1)
    one.errand.apply_message(replace(moving, target=3, reached=[True] * 3, distance=0.0))
    assert measure_remaining_route(one, HERE) == (0.0, 0)


@pytest.mark.parametrize(
    ("length", "distance", "seconds", "expected"),
    [
        (None, 8.0, 0.0, 8),  # at half of 2 m/s
        (10.0, 10.0, 5.0, 20),  # it has not moved
        (10.0, 5.0, 5.0, 5),
        (10.0, 0.01, 5.0, 1),  # on its last centimetre
        (10.0, 0.0, 5.0, 0),
        (10.0, 12.0, 5.0, 24),  # its way has become longer
    ],
)
def test_the_time_that_is_left_is_at_the_robots_mean_speed(
    length: float | None, distance: float, seconds: float, expected: int
) -> None:
    one = goal(1, 7_000_000_000)
    one.length = length
    assert estimate_time_left(one, distance, 2.0, one.at + round(seconds * 1e9)) == expected


@pytest.mark.parametrize("distro", DISTROS)
@pytest.mark.parametrize("action", NAVIGATION, ids=[action.name for action in NAVIGATION])
def test_a_result_is_an_answer_in_every_distribution(distro: str, action: RosAction) -> None:
    ros, name = Types(distro), f"{action.get_result_service.type}_Response"
    aborted = goal(1, 0, GoalStatus.ABORTED)
    aborted.text = "no"
    for one, expected in ((aborted, (6, action.failed, "no")), (goal(2), (2, 0, ""))):
        read = ros.deserialize(
            name, ros.serialize(name, ros.make_message(name, **make_result_fields(ros, action, one)))
        )
        assert (read.status, read.result.error_code, read.result.error_msg) == expected


@pytest.mark.parametrize("distro", DISTROS)
@pytest.mark.parametrize("action", NAVIGATION, ids=[action.name for action in NAVIGATION])
def test_feedback_is_a_message_in_every_distribution(distro: str, action: RosAction) -> None:
    ros, name = Types(distro), action.feedback_topic.type
    made = make_feedback(ros, action, goal(1, 1_000_000_000), Pose(1.0, 2.0, 0.5), 2.0, 3_500_000_000)
    read = ros.deserialize(name, ros.serialize(name, made))
    assert read.goal_id.uuid.tobytes() == bytes([1] * 16)
    said = read.feedback
    assert (said.navigation_time.sec, said.navigation_time.nanosec) == (2, 500_000_000)
    assert said.distance_remaining == pytest.approx(8.0**0.5)
    assert said.estimated_time_remaining.sec == 5, "2.83 m at (1 m/s for 5 s, then nothing for 2.5 s)"
    assert (said.current_pose.header.frame_id, said.current_pose.pose.position.y) == ("map", 2.0)


def test_the_bytes_of_a_goal_and_of_an_answer() -> None:
    """Written by hand from the rules of XCDR1: each value is aligned to its size, counted after the first 4 bytes."""
    ros = Types("jazzy")
    taken = ros.make_message("builtin_interfaces/msg/Time", sec=2, nanosec=3)
    name = NAVIGATE_TO_POSE.send_goal_service.type
    answer = ros.make_message(f"{name}_Response", accepted=True, stamp=taken)
    assert ros.serialize(f"{name}_Response", answer).hex(" ", 4) == "00010000 01000000 02000000 03000000"
    payload = (
        b"\x00\x01\x00\x00" + bytes(range(16))  # goal_id
        + b"\x02\x00\x00\x00\x03\x00\x00\x00" + b"\x04\x00\x00\x00map\x00"  # header
        + np.array([4.0, 3.0, 0.0, 0.0, 0.0, 0.0, 1.0], "<f8").tobytes()
        + b"\x01\x00\x00\x00\x00"  # behavior_tree
    )  # fmt: skip
    request = ros.deserialize(f"{name}_Request", payload)
    assert request.goal_id.uuid.tobytes() == bytes(range(16))
    assert (request.goal.pose.header.frame_id, request.goal.behavior_tree) == ("map", "")
    assert (request.goal.pose.pose.position.x, request.goal.pose.pose.orientation.w) == (4.0, 1.0)
    assert ros.serialize(f"{name}_Request", request) == payload
