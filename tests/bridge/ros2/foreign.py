"""A client of ROS's actions that knows nothing of this project: plain zenoh, and messages of pycdr2 as free_fleet has."""

import json
import struct
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from queue import SimpleQueue
from typing import Any, Final, Self, TypeAlias
from uuid import uuid4

import zenoh
import zenoh.ext
from pycdr2 import IdlStruct
from pycdr2.types import array, float32, float64, int8, int16, int32, sequence, uint8, uint16, uint32

from swarm.bus import Endpoint
from tests.launch.actors import PATIENCE

UNKNOWN, ACCEPTED, EXECUTING, CANCELING, SUCCEEDED, CANCELED, ABORTED = range(7)  # action_msgs/msg/GoalStatus
NOBODY: Final = bytes(16)
Id: TypeAlias = array[uint8, 16]


@dataclass
class Time(IdlStruct):
    sec: int32 = 0
    nanosec: uint32 = 0


@dataclass
class Header(IdlStruct):
    stamp: Time
    frame_id: str


@dataclass
class Point(IdlStruct):
    x: float64
    y: float64
    z: float64 = 0.0


@dataclass
class Quaternion(IdlStruct):
    x: float64 = 0.0
    y: float64 = 0.0
    z: float64 = 0.0
    w: float64 = 1.0


@dataclass
class Pose(IdlStruct):
    position: Point
    orientation: Quaternion


@dataclass
class PoseStamped(IdlStruct):
    header: Header
    pose: Pose


@dataclass
class Goals(IdlStruct):  # nav_msgs, from Kilted on
    header: Header
    goals: sequence[PoseStamped]


@dataclass
class ToPoseRequest(IdlStruct):
    goal_id: Id
    pose: PoseStamped
    behavior_tree: str


@dataclass
class ThroughPosesRequest(IdlStruct):
    goal_id: Id
    poses: sequence[PoseStamped]
    behavior_tree: str


@dataclass
class ThroughGoalsRequest(IdlStruct):
    goal_id: Id
    poses: Goals
    behavior_tree: str


@dataclass
class Accepted(IdlStruct):
    accepted: bool
    stamp: Time


@dataclass
class ResultRequest(IdlStruct):
    goal_id: Id


@dataclass
class Result(IdlStruct):
    status: int8
    error_code: uint16
    error_msg: str


@dataclass
class GoalInfo(IdlStruct):
    goal_id: Id
    stamp: Time


@dataclass
class CancelRequest(IdlStruct):
    goal_info: GoalInfo


@dataclass
class CancelResponse(IdlStruct):
    return_code: int8
    goals_canceling: sequence[GoalInfo]


@dataclass
class Feedback(IdlStruct):
    goal_id: Id
    current_pose: PoseStamped
    navigation_time: Time
    estimated_time_remaining: Time
    number_of_recoveries: int16
    distance_remaining: float32


@dataclass
class ThroughFeedback(IdlStruct):
    goal_id: Id
    current_pose: PoseStamped
    navigation_time: Time
    estimated_time_remaining: Time
    number_of_recoveries: int16
    distance_remaining: float32
    number_of_poses_remaining: int16


@dataclass
class GoalStatus(IdlStruct):
    goal_info: GoalInfo
    status: int8


@dataclass
class GoalStatusArray(IdlStruct):
    status_list: sequence[GoalStatus]


# fmt: off
CANCEL: Final = "action_msgs::srv::dds_::CancelGoal_/RIHS01_573d8b0a534451d7bc2ac8c5ffde8ac14b8593b7001175d0cd6516dcbeb8689a"
STATUS: Final = "action_msgs::msg::dds_::GoalStatusArray_/RIHS01_6c1684b00f177d37438febe6e709fc4e2b0d4248dca4854946f9ed8b30cda83e"
KINDS: Final = {  # the ends of keys; the hashes of NavigateToPose are also those of another implementation
    "navigate_to_pose": {
        "send_goal":   "nav2_msgs::action::dds_::NavigateToPose_SendGoal_/RIHS01_a4fcb3bee1bf32e21a0e541a943b221aa0826996e2c98f079b47022b256f48b5",
        "get_result":  "nav2_msgs::action::dds_::NavigateToPose_GetResult_/RIHS01_c407920357d566771e8882b4ef4d1f1a84ee922d609920ccd57faa6d6e391dc5",
        "feedback":    "nav2_msgs::action::dds_::NavigateToPose_FeedbackMessage_/RIHS01_9d1f6fa2eb975ce733b419ac2e97b134d8ff92b6478b6559feed9a50bdfd82b3",
        "cancel_goal": CANCEL,
        "status":      STATUS,
    },
    "navigate_through_poses": {
        "send_goal":   "nav2_msgs::action::dds_::NavigateThroughPoses_SendGoal_/RIHS01_5a590fa8e9a32b7b9c838fdf5939a2fb8858d6cfd25bdf2f2e5f0f7bbb25f52b",
        "get_result":  "nav2_msgs::action::dds_::NavigateThroughPoses_GetResult_/RIHS01_fdc12773de81ce69f7eeb4366702ea757d792ab5068bc461ee3b1438e66c7b36",
        "feedback":    "nav2_msgs::action::dds_::NavigateThroughPoses_FeedbackMessage_/RIHS01_073962415ad2a226b3de7245b142aeb414268a4d35ef1321ff2a484e2130e2b1",
        "cancel_goal": CANCEL,
        "status":      STATUS,
    },
}
# fmt: on


def placed(x: float, y: float, frame: str = "map") -> PoseStamped:
    return PoseStamped(Header(Time(), frame), Pose(Point(x, y), Quaternion()))


def uuid() -> bytes:
    return uuid4().bytes


class RefusedError(Exception):
    """The server has answered with an error, which a client of ROS logs."""


class Pending:
    """An answer that may come later."""

    def __init__(self, replies: "SimpleQueue[zenoh.Reply | None]", number: int | None) -> None:
        self._replies, self._number = replies, number

    def get(self, kind: Any) -> Any:  # noqa: ANN401
        """Wait for the only answer.

        Raises:
            RefusedError: it is an error.
        """
        reply = self._replies.get(timeout=PATIENCE)
        assert reply is not None, "the query has ended without an answer"
        assert self._replies.get(timeout=PATIENCE) is None, "one answer"
        if reply.ok is None:
            assert reply.err is not None
            raise RefusedError(reply.err.payload.to_string())
        attached = reply.ok.attachment
        if self._number is not None:
            assert attached is not None
            number, sent, size, gid = struct.unpack("<qqB16s", attached.to_bytes())
            assert (number, size, gid) == (self._number, 16, GID), "of the request"
            assert sent > 0
        return kind.deserialize(reply.ok.payload.to_bytes())

    @property
    def is_there(self) -> bool:
        """True if it has come."""
        return not self._replies.empty()


GID: Final = bytes(range(16))


class Client:
    """A client of one action of one robot; ``domain`` None: in the way of zenoh-bridge-ros2dds."""

    def __init__(
        self, session: zenoh.Session, domain: int | None, robot: str, action: str = "navigate_to_pose"
    ) -> None:
        self._session, self._domain, self._name, self._action = session, domain, f"{robot}/{action}", action
        self._asked = 0
        self.feedback: SimpleQueue[zenoh.Sample] = SimpleQueue()
        self.status: SimpleQueue[zenoh.Sample] = SimpleQueue()
        late = zenoh.ext.HistoryConfig(detect_late_publishers=True)
        self._declared: list[Any] = [
            session.declare_subscriber(self.key("feedback"), self.feedback.put),
            zenoh.ext.declare_advanced_subscriber(session, self.key("status"), self.status.put, history=late),
        ]

        for part in ("send_goal", "get_result", "cancel_goal"):
            self._await_server(self.key(part))

    def _await_server(self, key: str) -> None:
        """Wait until somebody serves a key."""
        seen: SimpleQueue[bool] = SimpleQueue()
        querier: Any = self._session.declare_querier(key, target=zenoh.QueryTarget.ALL_COMPLETE)
        self._declared += [querier.declare_matching_listener(lambda status: seen.put(status.matching)), querier]
        while not querier.matching_status.matching and not seen.get(timeout=PATIENCE):
            pass

    def key(self, part: str) -> str:
        name = f"{self._name}/_action/{part}"
        return name if self._domain is None else f"{self._domain}/{name}/{KINDS[self._action][part]}"

    def ask(self, part: str, payload: bytes, attached: bool = True) -> Pending:
        """Ask as rmw_zenoh does."""
        self._asked += 1
        replies: SimpleQueue[zenoh.Reply | None] = SimpleQueue()
        attachment = struct.pack("<qqB16s", self._asked, 1, 16, GID)
        with_it = attached and self._domain is not None
        self._session.get(
            self.key(part), zenoh.handlers.Callback(replies.put, lambda: replies.put(None)),
            payload=payload, timeout=2 * PATIENCE,
            attachment=attachment if with_it else None, target=zenoh.QueryTarget.ALL_COMPLETE,
            consolidation=zenoh.ConsolidationMode.NONE,
        )  # fmt: skip
        return Pending(replies, self._asked if with_it else None)

    def send(self, id_: bytes, pose: PoseStamped, tree: str = "") -> bool:
        """Send a goal; return whether it was accepted."""
        request = ToPoseRequest(list(id_), pose, tree)
        accepted: bool = self.ask("send_goal", request.serialize()).get(Accepted).accepted
        return accepted

    def send_through(self, id_: bytes, *poses: PoseStamped) -> bool:
        """Send a goal of several poses; return whether it was accepted."""
        request = ThroughPosesRequest(list(id_), list(poses), "")
        accepted: bool = self.ask("send_goal", request.serialize()).get(Accepted).accepted
        return accepted

    def result(self, id_: bytes) -> Pending:
        return self.ask("get_result", ResultRequest(list(id_)).serialize())

    def cancel(self, id_: bytes = NOBODY, at: Time | None = None) -> tuple[int, list[bytes]]:
        """Cancel goals; return the code, and those that are."""
        request = CancelRequest(GoalInfo(list(id_), Time() if at is None else at))
        answer = self.ask("cancel_goal", request.serialize()).get(CancelResponse)
        return answer.return_code, [bytes(one.goal_id) for one in answer.goals_canceling]

    def await_status(self, id_: bytes, status: int) -> list[int]:
        """Wait for a status of a goal; return all that it had on the way."""
        had: list[int] = []
        while not had or had[-1] != status:
            told = GoalStatusArray.deserialize(self.status.get(timeout=PATIENCE).payload.to_bytes())
            had += [one.status for one in told.status_list if bytes(one.goal_info.goal_id) == id_]
        return had

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *fault: object) -> None:
        for one in self._declared:
            one.undeclare()


@contextmanager
def client_session(router: Endpoint) -> Iterator[zenoh.Session]:
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", f'["{router}"]')
    with zenoh.open(config) as session:
        yield session


# in what rmw_zenohd's configuration differs from Zenoh's (rmw_zenoh's DEFAULT_RMW_ZENOH_ROUTER_CONFIG.json5)
OF_ROUTER: Final = {
    "scouting/multicast/enabled": False,
    "scouting/gossip/target": {"router": ["router", "peer"], "peer": ["router"]},
    "scouting/gossip/autoconnect": {"router": [], "peer": ["router", "peer"]},
    "timestamping/enabled": {"router": True, "peer": True, "client": True},
    "queries_default_timeout": 60_000,
    "routing/router/peers_failover_brokering": False,
}


@contextmanager
def router_of_ros(place: Endpoint) -> Iterator[None]:
    """Run a router with the settings of ROS's own."""
    config = zenoh.Config()
    for key, value in {"mode": "router", "listen/endpoints": [str(place)], **OF_ROUTER}.items():
        config.insert_json5(key, json.dumps(value))
    with zenoh.open(config):
        yield


def await_tokens(heard: "SimpleQueue[zenoh.Sample]", parts: Iterable[str], kind: zenoh.SampleKind) -> None:
    """Wait until tokens with these parts in their keys have come, or gone: what has no token yet cannot be asked."""
    missing = set(parts)
    while missing:
        sample = heard.get(timeout=PATIENCE)
        if sample.kind == kind:
            missing = {part for part in missing if part not in str(sample.key_expr)}


def tokens(session: zenoh.Session, domain: int) -> tuple["SimpleQueue[zenoh.Sample]", Any]:
    """Watch the graph of ROS; hold the second one as long as it is to last."""
    heard: SimpleQueue[zenoh.Sample] = SimpleQueue()
    watching = session.liveliness().declare_subscriber(f"@ros2_lv/{domain}/**", heard.put, history=True)
    return heard, watching
