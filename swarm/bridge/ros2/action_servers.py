"""The action servers of one robot: it takes goals as orders of the fleet, and answers for them until they end."""

from collections.abc import Callable
from time import monotonic
from typing import Any, Final

from swarm.bridge.cdr.layouts import SECOND
from swarm.bridge.errand import OrderEnd, OrderErrand
from swarm.bridge.errands import Errands
from swarm.bridge.fleet_client import REPLY
from swarm.bridge.ros2.actions import (
    ENDS,
    NAVIGATION,
    CancelCode,
    Goal,
    Goals,
    GoalStatus,
    RosAction,
    make_feedback,
    make_goal_info,
    make_result_fields,
    make_status_array,
    measure_remaining_route,
)
from swarm.bridge.ros2.convert import make_stamp
from swarm.bridge.ros2.goals import build_order
from swarm.bridge.ros2.graph import LiveNode, ServiceRequest
from swarm.bridge.ros2.interfaces import THROUGH_POSES
from swarm.bridge.ros2.types import Types
from swarm.bus import Bus
from swarm.errors import PeerError
from swarm.geometry import Pose
from swarm.messages import ORDER, ROBOT_ACTION, RobotAction, RobotDo

EVERY: Final = 0.2  # s between two feedbacks of a goal
FIRST: Final = 1.0  # s from a goal's acceptance in which feedback is sent at each step: Open-RMF's adapter asks for
# the result of a goal of which it has heard nothing, and does nothing else until it has that
WAITING: Final = 100  # requests for one result that are held: free_fleet's script asks every 6.5 s, forgets the last
OFFERED: Final = tuple(topic for action in NAVIGATION for topic in (action.feedback_topic, action.status_topic))
SERVED: Final = tuple(
    service
    for action in NAVIGATION
    for service in (action.send_goal_service, action.get_result_service, action.cancel_goal_service)
)


class ActionServers:
    """Nav2's actions of one robot, at its node."""

    def __init__(
        self,
        robot: str,
        node: LiveNode,
        ros: Types,
        bus: Bus,
        errands: Errands,
        log: Callable[[str], None],
        *,
        turns: bool,
    ) -> None:
        """``turns`` says that the yaw of a goal is heeded."""
        self._robot, self._node, self._ros = robot, node, ros
        self._bus, self._errands, self._log, self._turns = bus, errands, log, turns
        self._goals = {action: Goals() for action in NAVIGATION}
        self.newest = 0  # number of the last order that the world has taken from ROS
        self._begun = self._told = 0.0  # s, when a goal was accepted last, and when feedback was sent
        # of the last feedback: the robot's pose, its top speed [m/s] and the stamp [ns]
        self._seen: tuple[Pose, float, int] | None = None
        self._trees = False  # it was said that behaviour trees are ignored

    def answer_requests(self, at: int) -> None:
        """Answer all that was asked since the last call; ``at`` [ns] is now, in the stamps of ROS."""
        for action in NAVIGATION:
            for request in self._node.take_requests(action.send_goal_service):
                self._accept_goal(action, request, at)
            for request in self._node.take_requests(action.cancel_goal_service):
                self._cancel_goals(action, request)
            for request in self._node.take_requests(action.get_result_service):
                self._answer_result_request(action, request)

    def end_errand(self, errand: OrderErrand, end: OrderEnd) -> None:
        """End the goal of an errand that has ended, if it has one."""
        for action, goals in self._goals.items():
            for goal in goals.open_goals:
                if goal.errand is errand:
                    self._end_goal(action, goal, ENDS.get(end.how, GoalStatus.ABORTED), end.text)

    def abort_goals(self, why: str) -> None:
        """End all goals and answer all requests: the bridge shows the robot no more. The fleet keeps its orders."""
        for action, goals in self._goals.items():
            for goal in goals.open_goals:
                self._end_goal(action, goal, GoalStatus.ABORTED, f"{goal.errand.name} is out of sight: {why}")
            for service in (action.send_goal_service, action.cancel_goal_service):
                for request in self._node.take_requests(service):
                    request.refuse(why)
            for request in self._node.take_requests(action.get_result_service):
                self._answer_result_request(action, request)

    def send_feedback(self, pose: Pose, speed: float, at: int) -> None:
        """Send feedback if it is time for it; the robot's pose, its top speed [m/s] and now [ns] are given."""
        under_way = [(action, goal) for action, goals in self._goals.items() for goal in goals.open_goals]
        if not under_way:
            self._seen = None
            return
        now = monotonic()
        if now - self._told < EVERY and now - self._begun > FIRST:
            return
        self._told, self._seen = now, (pose, speed, at)
        for action, goal in under_way:
            if goal.length is None:
                goal.length, _ = measure_remaining_route(goal, pose)
            self._node.publish_message(action.feedback_topic, make_feedback(self._ros, action, goal, *self._seen))

    def _accept_goal(self, action: RosAction, request: ServiceRequest, at: int) -> None:
        """Send the world an order for a goal, and answer whether it was accepted."""
        asked = request.message
        id_ = asked.goal_id.uuid.tobytes()
        try:
            if self._goals[action].find_goal(id_) is not None:
                raise PeerError(f"goal {id_.hex()[:8]}: expected a new id, got one that is known")
            poses = goal_poses(action, asked.goal)
            order = build_order(poses, id_.hex(), turns=self._turns)
            reply = self._bus.ask(ORDER, order, timeout=REPLY, robot=self._robot)
            errand = OrderErrand.from_answer(self._robot, order, reply)
        except PeerError as fault:
            self._log(f"{self._robot}: {action.name}: goal refused: {fault}")
            request.answer(accepted=False, stamp=make_stamp(self._ros, at))
            return
        self._log(reply.text)
        self.newest = errand.number
        if asked.goal.behavior_tree and not self._trees:
            self._log(f"{self._robot}: {action.name}: behavior_tree is ignored: robots plan by themselves")
            self._trees = True
        self._errands.add(errand)
        self._begun = monotonic()
        self._goals[action].add_goal(Goal(id=id_, at=at, errand=errand, targets=order.targets), self._begun)
        request.answer(accepted=True, stamp=make_stamp(self._ros, at))
        self._send_status(action)

    def _cancel_goals(self, action: RosAction, request: ServiceRequest) -> None:
        """Cancel the order of goals; they end when the fleet says that it has."""
        info = request.message.goal_info
        at = info.stamp.sec * SECOND + info.stamp.nanosec
        code, goals = self._goals[action].find_goals_to_cancel(info.goal_id.uuid.tobytes(), at)
        # the robot may have another order by now, which nobody wants to cancel here: the goal's end is on its way
        goals = [goal for goal in goals if not goal.errand.is_replaced and goal.errand.number >= self.newest]
        if goals:
            try:
                self._log(self._bus.ask(ROBOT_ACTION, RobotAction(do=RobotDo.CANCEL), REPLY, robot=self._robot).text)
            except PeerError as fault:
                self._log(f"{self._robot}: {action.name}: not cancelled: {fault}")
                code, goals = CancelCode.REJECTED, []
        for goal in goals:
            goal.status = GoalStatus.CANCELING
        request.answer(return_code=code, goals_canceling=[make_goal_info(self._ros, goal) for goal in goals])
        if goals:
            self._send_status(action)

    def _answer_result_request(self, action: RosAction, request: ServiceRequest) -> None:
        goal = self._goals[action].find_goal(request.message.goal_id.uuid.tobytes())
        if goal is None or not goal.is_open:
            request.answer(**make_result_fields(self._ros, action, goal))
            return
        goal.waiting.append(request)
        if len(goal.waiting) > WAITING:
            goal.waiting.pop(0).answer(
                **make_result_fields(self._ros, action, goal)
            )  # with the status of a goal under way

    def _end_goal(self, action: RosAction, goal: Goal, status: GoalStatus, text: str) -> None:
        self._log(text)
        self._goals[action].end_goal(goal, status, "" if status is GoalStatus.SUCCEEDED else text, monotonic())
        if self._seen is not None:  # no time is left: Open-RMF's adapter asks for no result before that time is over
            self._node.publish_message(action.feedback_topic, make_feedback(self._ros, action, goal, *self._seen))
        self._send_status(action)
        for request in goal.waiting:
            request.answer(**make_result_fields(self._ros, action, goal))
        goal.waiting.clear()

    def _send_status(self, action: RosAction) -> None:
        self._node.publish_message(action.status_topic, make_status_array(self._ros, self._goals[action]))


def goal_poses(action: RosAction, goal: Any) -> list[Any]:  # noqa: ANN401
    """Return the poses with headers of a goal; Kilted has a message around them (nav_msgs/Goals)."""
    if action.type != THROUGH_POSES:
        return [goal.pose]
    poses: list[Any] = getattr(goal.poses, "goals", goal.poses)
    return poses
