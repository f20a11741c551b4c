"""The process of the bridge: it listens to the fleet, speaks in ROS, and hands goals on, until the run is over."""

from collections.abc import Callable, Collection
from itertools import count
from time import time_ns
from typing import Any
from uuid import uuid4

from swarm.bridge.cdr.layouts import SECOND
from swarm.bridge.fleet_client import LISTEN, ORDERED, REPLY, FleetClient
from swarm.bridge.fleet_view import FLEET
from swarm.bridge.names import assign_namespaces
from swarm.bridge.ros2 import action_servers
from swarm.bridge.ros2.action_servers import ActionServers
from swarm.bridge.ros2.convert import Converter, RosMessage
from swarm.bridge.ros2.goals import parse_goal
from swarm.bridge.ros2.graph import LiveNode
from swarm.bridge.ros2.node_services import WITH_STATE, list_services, make_answer_fields
from swarm.bridge.ros2.topics import CLOCK, GOAL, HEARD, INITIAL_POSE, OF_FLEET, OF_ROBOT, RosService, RosTopic
from swarm.bridge.ros2.types import Types
from swarm.bridge.ros2.wire import NODE, Dialect, RosNode
from swarm.bus import Bus, Endpoint
from swarm.bus.foreign import Foreign
from swarm.bus.losses import Ledger
from swarm.errors import PeerError
from swarm.geometry import Pose
from swarm.heartbeat import Heartbeat
from swarm.messages import ORDER, Truth
from swarm.stop_signal import stop_flag


def run(
    endpoint: Endpoint,
    fleet: str,
    router: Endpoint | None = None,
    domain: int = 0,
    distro: str = "jazzy",
    *,
    dialect: Dialect = Dialect.RMW_ZENOH,
    wall_time: bool = False,
    final_turn: bool = False,
    without: Collection[str] = (),
    log: Callable[[str], None] = print,
) -> int:
    """Show a fleet to ROS, on another router or, with None, the same, until its run is over or we are told to stop.

    Stamps are those of the run, which ``/clock`` tells; with ``wall_time`` those of this machine, without ``/clock``.
    With ``final_turn`` a robot turns to the yaw of a goal. Robots ``without`` are not shown: they are in ROS already.

    Raises:
        ConfigError: one of the routers does not answer.
    """
    router = endpoint if router is None else router
    with stop_flag() as stop, Bus(endpoint, fleet, log, Heartbeat()) as bus, Foreign(router, bus.wake) as session:
        bridge = RosBridge(
            bus,
            session,
            Types(distro),
            domain,
            dialect=dialect,
            wall_time=wall_time,
            turns=final_turn,
            without=without,
            log=log,
        )
        how = f"in ROS domain {domain} ({distro})" if dialect is Dialect.RMW_ZENOH else f"as {dialect} has robots"
        log(f"fleet {fleet} is {how} on {router}")
        bridge.follow_fleet(stop.is_set)
    return 0


class RosBridge:
    """A fleet in the graph of ROS: a node for the fleet, and one for each robot."""

    def __init__(
        self,
        bus: Bus,
        session: Foreign,
        ros: Types,
        domain: int,
        *,
        dialect: Dialect,
        wall_time: bool,
        turns: bool,
        without: Collection[str],
        log: Callable[[str], None],
    ) -> None:
        self._bus, self._session, self._ros, self._domain, self._dialect = bus, session, ros, domain, dialect
        self._wall_time, self._turns, self._without, self._log = wall_time, turns, without, log
        self._converter = Converter(wants=self._is_topic_wanted)
        self._ledger = Ledger(log)
        self._fleet = FleetClient(bus, log, (*LISTEN, *ORDERED))
        self._fold = self._fleet.fold
        self._numbers = count()  # of nodes, publishers, subscribers and services in this session
        self._robots: tuple[str, ...] = ()  # that ROS sees, or was to see
        self._spaces: dict[str, str] = {}  # by robot
        self._refused: dict[str, str] = {}  # robots without a namespace
        self._poses: dict[str, Pose] = {}  # of the last truth
        offered = tuple(topic for topic in OF_FLEET if topic is not CLOCK or not wall_time)
        self._attended: dict[str, dict[str, LiveNode]] = {}  # by robot and name: what tools ask of nodes
        self._nodes: dict[str, LiveNode] = {FLEET: self._open_main_node(FLEET, "/", offers=offered)}
        self._servers: dict[str, ActionServers] = {}  # by robot

    def follow_fleet(self, stopped: Callable[[], bool]) -> None:
        """Hand on all that comes, in both directions, until the run is over."""
        while not stopped() and not self._fold.over:
            for errand, end in self._fleet.receive_messages():
                if errand.robot in self._servers:
                    self._servers[errand.robot].end_errand(errand, end)
            self._update_robots()
            self._send_messages()
            if self._session.has_arrivals():
                self._take_ros_requests()
                self._answer_node_services()
            self._send_feedback()
            self._ledger.flush()
        for one in self._servers.values():
            one.abort_goals("the run is over" if self._fold.over else "the bridge ends")
        if self._fold.over:
            self._log("the run is over")

    def _update_robots(self) -> None:
        """Announce robots that have come, and withdraw those that the run does not have any more."""
        if self._robots == self._fold.robots:
            return
        self._robots = self._fold.robots
        spaces, refused = assign_namespaces(robot for robot in self._robots if robot not in self._without)
        for robot in refused.keys() - self._refused.keys():
            self._log(f"{robot} is not in ROS: its name there would be that of {refused[robot]}; rename one of them")
        for robot in self._spaces.keys() - spaces.keys():
            self._servers.pop(robot).abort_goals("the run has that robot no more")
            del self._nodes[robot]
            for node in self._attended.pop(robot).values():
                node.close()
        for robot, space in spaces.items():
            if robot not in self._spaces:
                node = self._open_main_node(
                    robot, space, offers=(*OF_ROBOT, *action_servers.OFFERED), hears=HEARD, serves=action_servers.SERVED
                )
                self._nodes[robot] = node
                for name in WITH_STATE:
                    self._attended[robot][name] = self._open_node(space, name, serves=list_services(name))
                self._servers[robot] = ActionServers(
                    robot, node, self._ros, self._bus, self._fleet.errands, self._log, turns=self._turns
                )  # fmt: skip
        self._spaces, self._refused = spaces, refused
        self._converter.set_namespaces(spaces)
        for said in self._converter.make_static_frames(self._to_stamp(self._fold.time)):
            self._publish_message(said)

    def _send_messages(self) -> None:
        for message, robot, time in self._fold.take_messages():
            assert self._fold.settings is not None, "nothing is said without them"
            if isinstance(message, Truth):
                self._poses = {body.robot: Pose(body.x, body.y, body.yaw) for body in message.bodies}
            try:
                for said in self._converter.convert_message(message, robot, self._fold.settings, self._to_stamp(time)):
                    self._publish_message(said)
            except PeerError as fault:
                self._ledger.refuse(type(message).__name__, fault)

    def _to_stamp(self, time: float) -> int:
        """Return the stamp [ns] of what was so at a time of the run [s]."""
        return time_ns() if self._wall_time else round(time * SECOND)

    def _is_topic_wanted(self, robot: str, topic: RosTopic) -> bool:
        return (topic is not CLOCK or not self._wall_time) and self._nodes[robot].has_subscribers(topic)

    def _publish_message(self, said: RosMessage) -> None:
        self._nodes[said.robot].publish_payload(said.topic, said.payload)

    def _take_ros_requests(self) -> None:
        """Take what ROS asks of the robots."""
        for robot, one in self._servers.items():
            self._forward_goal(robot)
            one.answer_requests(self._to_stamp(self._fold.time))

    def _send_feedback(self) -> None:
        """Publish feedback of the goals under way."""
        if (settings := self._fold.settings) is not None:
            for robot, one in self._servers.items():
                if robot in self._poses:
                    speed = settings.of_robot(robot).robot.top_speed
                    one.send_feedback(self._poses[robot], speed, self._to_stamp(self._fold.time))

    def _forward_goal(self, robot: str) -> None:
        """Send the last goal of a robot to the world as an order, and log the answer."""
        node = self._nodes[robot]
        if node.take_newest_payload(INITIAL_POSE) is not None:
            node.refuse_input(
                INITIAL_POSE, PeerError("the world knows where robots are: no pose is taken from outside")
            )
        if (payload := node.take_newest_payload(GOAL)) is None:
            return
        try:
            order = parse_goal(self._ros, payload, uuid4().hex, turns=self._turns)
        except PeerError as fault:
            node.refuse_input(GOAL, fault)
            return
        try:
            reply = self._bus.ask(ORDER, order, timeout=REPLY, robot=robot)
        except PeerError as fault:
            self._log(str(fault))
            return
        self._servers[robot].newest = reply.number
        self._log(reply.text)

    def _answer_node_services(self) -> None:
        """Answer what tools ask of nodes."""
        known = {"use_sim_time": not self._wall_time}
        for nodes in self._attended.values():
            for name, node in nodes.items():
                for service in list_services(name):
                    for request in node.take_requests(service):
                        request.answer(**make_answer_fields(self._ros, service, request.message, known))

    def _open_main_node(
        self, robot: str, namespace: str, offers: tuple[RosTopic, ...], hears: tuple[RosTopic, ...] = (),
        serves: tuple[RosService, ...] = (),
    ) -> LiveNode:  # fmt: skip
        node = self._open_node(namespace, NODE, offers=offers, hears=hears, serves=(*serves, *list_services(NODE)))
        self._attended[robot] = {NODE: node}
        return node

    def _open_node(self, namespace: str, name: str, **what: Any) -> LiveNode:  # noqa: ANN401
        node = RosNode(
            domain=self._domain, session=self._session.id, number=next(self._numbers), namespace=namespace, name=name,
            dialect=self._dialect,
        )  # fmt: skip
        return LiveNode(self._session, node, self._ros, self._numbers, self._ledger.refuse, **what)
