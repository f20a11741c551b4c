"""The actions that a robot has in ROS: goals by id, which of them a request cancels, results that are kept. Pure.

Sources: the design of actions (https://design.ros2.org/articles/actions.html), action_msgs and nav2_msgs. As Nav2's
servers do, a newer goal makes the robot's older one end as aborted.
"""

from dataclasses import dataclass, field
from enum import IntEnum
from itertools import pairwise
from math import ceil, dist
from typing import Any, Final, NamedTuple

import numpy as np

from swarm.bridge.cdr.layouts import SECOND
from swarm.bridge.errand import OrderErrand, OrderOutcome
from swarm.bridge.ros2.convert import IN_MAP, make_header, make_pose_message, make_stamp
from swarm.bridge.ros2.interfaces import CANCEL, THROUGH_POSES, TO_POSE
from swarm.bridge.ros2.topics import Qos, RosService, RosTopic
from swarm.bridge.ros2.types import Types
from swarm.geometry import Pose
from swarm.messages import Point

KEPT: Final = 900.0  # s for which a result is kept: Nav2's action_server_result_timeout
MOST: Final = 100  # goals of one action of a robot that are known, those that have ended longest ago are dropped first
ANY: Final = bytes(16)  # as an id in a request to cancel: that of no goal in particular


class GoalStatus(IntEnum):
    """The status of a goal: action_msgs/msg/GoalStatus."""

    UNKNOWN = 0
    ACCEPTED = 1
    EXECUTING = 2
    CANCELING = 3
    SUCCEEDED = 4
    CANCELED = 5
    ABORTED = 6


class CancelCode(IntEnum):
    """The answer to a request to cancel: action_msgs/srv/CancelGoal."""

    NONE = 0
    REJECTED = 1
    UNKNOWN_GOAL = 2
    TERMINATED = 3


BEGUN: Final = 5.0  # s for which a robot counts as having driven at half its top speed before a goal
OPEN: Final = (GoalStatus.ACCEPTED, GoalStatus.EXECUTING, GoalStatus.CANCELING)
ENDS: Final = {
    OrderOutcome.DONE: GoalStatus.SUCCEEDED,
    OrderOutcome.CANCELLED: GoalStatus.CANCELED,
}  # all others: aborted


class RosAction(NamedTuple):
    """An action of a robot, with its endpoints below the robot's namespace."""

    name: str
    type: str
    failed: int  # the error code of a result for what has no code of its own

    @property
    def send_goal_service(self) -> RosService:
        """The service that takes a goal."""
        return RosService(f"{self.name}/_action/send_goal", f"{self.type}_SendGoal")

    @property
    def get_result_service(self) -> RosService:
        """The service that answers when a goal has ended."""
        return RosService(f"{self.name}/_action/get_result", f"{self.type}_GetResult")

    @property
    def cancel_goal_service(self) -> RosService:
        """The service that cancels goals."""
        return RosService(f"{self.name}/_action/cancel_goal", CANCEL)

    @property
    def feedback_topic(self) -> RosTopic:
        """How far goals are."""
        return RosTopic(f"{self.name}/_action/feedback", f"{self.type}_FeedbackMessage")

    @property
    def status_topic(self) -> RosTopic:
        """The status of all goals that are known."""
        return RosTopic(f"{self.name}/_action/status", "action_msgs/msg/GoalStatusArray", Qos.LATCHED)


NAVIGATE_TO_POSE: Final = RosAction("navigate_to_pose", TO_POSE, failed=9000)  # UNKNOWN of its error codes
NAVIGATE_THROUGH_POSES: Final = RosAction("navigate_through_poses", THROUGH_POSES, failed=9100)
NAVIGATION: Final = (NAVIGATE_TO_POSE, NAVIGATE_THROUGH_POSES)


@dataclass(kw_only=True)
class Goal:
    """A goal that was accepted."""

    id: bytes  # 16 of them
    at: int  # ns, when it was accepted
    errand: OrderErrand
    targets: list[Point]  # m
    status: GoalStatus = GoalStatus.EXECUTING
    length: float | None = None  # m that were left when that was told first
    text: str = ""  # why it has ended, if it has not succeeded
    ended: float = 0.0  # s, of the clock of whoever ends it
    waiting: list[Any] = field(default_factory=list)  # requests for its result

    @property
    def is_open(self) -> bool:
        """True if it has not ended."""
        return self.status in OPEN


class Goals:
    """The goals of one action of one robot, oldest first."""

    def __init__(self) -> None:
        self._known: dict[bytes, Goal] = {}

    @property
    def all_goals(self) -> list[Goal]:
        """All that are known: those that have ended, too, until they are forgotten."""
        return list(self._known.values())

    @property
    def open_goals(self) -> list[Goal]:
        """Those that have not ended."""
        return [goal for goal in self._known.values() if goal.is_open]

    def find_goal(self, id_: bytes) -> Goal | None:
        """Return the goal with an id; None if it is not known."""
        return self._known.get(id_)

    def add_goal(self, goal: Goal, now: float) -> None:
        """Take in a goal at a time [s]; forget those that ended long before it, or are too many."""
        ended = sorted((one for one in self._known.values() if not one.is_open), key=lambda one: one.ended)
        late = [one for one in ended if now - one.ended > KEPT] or ended[: max(0, len(self._known) + 1 - MOST)]
        for one in late:
            del self._known[one.id]
        self._known[goal.id] = goal

    def end_goal(self, goal: Goal, status: GoalStatus, text: str, now: float) -> None:
        """End a goal at a time [s]."""
        goal.status, goal.text, goal.ended = status, text, now

    def find_goals_to_cancel(self, id_: bytes, at: int) -> tuple[CancelCode, list[Goal]]:
        """Return the goals that a request is about, and the code if it is about none: action_msgs/srv/CancelGoal.

        An id: that goal; a time ``at`` [ns]: all that were accepted until then; both: both; neither: all.
        """
        named = self._known.get(id_)
        if id_ != ANY and at == 0 and named is None:
            return CancelCode.UNKNOWN_GOAL, []
        if id_ != ANY and at == 0 and named is not None and not named.is_open:
            return CancelCode.TERMINATED, []
        return CancelCode.NONE, [
            goal for goal in self.open_goals
            if goal.id == id_ or (id_ == ANY and at == 0) or (at != 0 and goal.at <= at)
        ]  # fmt: skip


# --- as messages of ROS ---


def make_goal_info(ros: Types, goal: Goal) -> Any:  # noqa: ANN401
    """Return the id of a goal and when it was accepted."""
    named = ros.make_message("unique_identifier_msgs/msg/UUID", uuid=np.frombuffer(goal.id, np.uint8))
    return ros.make_message("action_msgs/msg/GoalInfo", goal_id=named, stamp=make_stamp(ros, goal.at))


def make_status_array(ros: Types, goals: Goals) -> Any:  # noqa: ANN401
    """Return the status of all goals that are known."""
    listed = [
        ros.make_message("action_msgs/msg/GoalStatus", goal_info=make_goal_info(ros, goal), status=goal.status)
        for goal in goals.all_goals
    ]
    return ros.make_message("action_msgs/msg/GoalStatusArray", status_list=listed)


def make_result_fields(ros: Types, action: RosAction, goal: Goal | None) -> dict[str, Any]:
    """Return the fields of the answer to who waits for a result; one that is not known has the status 0."""
    status = GoalStatus.UNKNOWN if goal is None else goal.status
    text = "expected the id of a goal that this server has accepted, and not long ago" if goal is None else goal.text
    code = action.failed if status in {GoalStatus.ABORTED, GoalStatus.UNKNOWN} else 0
    fields = {"error_code": code, "error_msg": text, "waypoint_statuses": []}
    return {"status": status, "result": ros.make_message_from_known(f"{action.type}_Result", fields)}


def make_feedback(ros: Types, action: RosAction, goal: Goal, pose: Pose, speed: float, at: int) -> Any:  # noqa: ANN401
    """Return how far a goal is, with its robot's pose, at a time [ns]; ``speed`` [m/s] is the robot's top speed."""
    distance, left = measure_remaining_route(goal, pose)
    fields = {
        "current_pose": ros.make_message(
            "geometry_msgs/msg/PoseStamped", header=make_header(ros, IN_MAP, at), pose=make_pose_message(ros, pose)
        ),
        "navigation_time": make_duration(ros, max(0, at - goal.at)),
        "estimated_time_remaining": make_duration(ros, estimate_time_left(goal, distance, speed, at) * SECOND),
        "number_of_recoveries": 0,
        "distance_remaining": distance,
        "position_tracking_error": 0.0,  # from Lyrical on
        "heading_tracking_error": 0.0,
        "number_of_poses_remaining": left,
        "waypoint_statuses": [],
    }
    return ros.make_message(
        action.feedback_topic.type, goal_id=make_goal_info(ros, goal).goal_id,
        feedback=ros.make_message_from_known(f"{action.type}_Feedback", fields),
    )  # fmt: skip


def measure_remaining_route(goal: Goal, pose: Pose) -> tuple[float, int]:
    """Return the distance [m] that is left of a goal, and how many of its poses.

    To the next pose it is the robot's own, along its path; from there on, and before the robot has taken the goal up,
    it is that of straight lines.
    """
    state = goal.errand.state_under_way
    first = 0 if state is None else min(state.target, len(goal.targets))
    begun = dist((pose.x, pose.y), goal.targets[0]) if state is None else state.distance
    later = goal.targets[first:]
    return begun + sum(dist(a, b) for a, b in pairwise(later)), len(later)


def estimate_time_left(goal: Goal, distance: float, speed: float, at: int) -> int:
    """Return the time [s] that a goal's robot needs for a distance [m] at the mean speed that it has had until now.

    A goal that has ended needs none. The mean begins as if the robot had driven at half its top speed for some
    seconds. The time is rounded up, since clients read its whole seconds only.
    """
    if not goal.is_open:
        return 0
    driven = 0.0 if goal.length is None else max(0.0, goal.length - distance)
    mean = (driven + speed / 2 * BEGUN) / (max(0, at - goal.at) / SECOND + BEGUN)
    return ceil(distance / mean)


def make_duration(ros: Types, length: int) -> Any:  # noqa: ANN401
    """Return a length of time [ns] as ROS's."""
    seconds, rest = divmod(length, SECOND)
    return ros.make_message("builtin_interfaces/msg/Duration", sec=seconds, nanosec=rest)
