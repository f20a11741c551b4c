"""The process of the bridge: it listens to the fleet, speaks in ROS, and hands goals on, until the run is over."""

from collections.abc import Callable
from itertools import count
from time import time_ns
from typing import Final
from uuid import uuid4

from swarm.bridge.cdr.layouts import SECOND
from swarm.bridge.folding import FLEET
from swarm.bridge.following import Follower
from swarm.bridge.names import namespaces
from swarm.bridge.ros2.convert import Converter, Said
from swarm.bridge.ros2.goals import ordered
from swarm.bridge.ros2.graph import LiveNode
from swarm.bridge.ros2.topics import CLOCK, GOAL, HEARD, OF_FLEET, OF_ROBOT, RosTopic
from swarm.bridge.ros2.types import Types
from swarm.bridge.ros2.wire import Node
from swarm.bus import Bus, Endpoint
from swarm.bus.foreign import Foreign
from swarm.bus.losses import Ledger
from swarm.errors import PeerError
from swarm.messages import ORDER
from swarm.stopping import told_to_stop

ANSWER: Final = 2.0  # s to wait for the world's answer to an order; meanwhile nothing goes out


def run(
    endpoint: Endpoint,
    fleet: str,
    router: Endpoint,
    domain: int,
    distro: str,
    *,
    wall_time: bool = False,
    log: Callable[[str], None] = print,
) -> int:
    """Show a fleet to ROS, on another router or the same, until its run is over or we are told to stop.

    Stamps are those of the run, which ``/clock`` tells; with ``wall_time`` those of this machine, without ``/clock``.

    Raises:
        ConfigError: one of the routers does not answer.
    """
    with told_to_stop() as stop, Bus(endpoint, fleet, log) as bus, Foreign(router) as session:
        bridge = Bridge(bus, session, Types(distro), domain, wall_time=wall_time, log=log)
        log(f"fleet {fleet} is in ROS domain {domain} ({distro}) on {router}")
        bridge.follow(stop.is_set)
    return 0


class Bridge:
    """A fleet in the graph of ROS: a node for the fleet, and one for each robot."""

    def __init__(
        self, bus: Bus, session: Foreign, ros: Types, domain: int, *, wall_time: bool, log: Callable[[str], None]
    ) -> None:
        self._bus, self._session, self._ros, self._domain = bus, session, ros, domain
        self._wall_time, self._log = wall_time, log
        self._converter = Converter(wants=self._wants)
        self._ledger = Ledger(log)
        self._fleet = Follower(bus, log)
        self._fold = self._fleet.fold
        self._numbers = count()  # of nodes, publishers and subscribers in this session
        self._robots: tuple[str, ...] = ()  # that ROS sees, or was to see
        self._spaces: dict[str, str] = {}  # by robot
        self._refused: dict[str, str] = {}  # robots without a namespace
        self._nodes: dict[str, LiveNode] = {FLEET: self._node("/", tuple(
            topic for topic in OF_FLEET if topic is not CLOCK or not wall_time
        ), ())}  # fmt: skip

    def follow(self, stopped: Callable[[], bool]) -> None:
        """Hand on all that comes, in both directions, until the run is over."""
        while not stopped() and not self._fold.over:
            self._fleet.take_in()
            self._show_robots()
            self._speak()
            for robot in self._spaces:
                self._heed(robot)
            self._ledger.flush()
        if self._fold.over:
            self._log("the run is over")

    def _show_robots(self) -> None:
        """Announce robots that have come, and withdraw those that the run does not have any more."""
        if self._robots == self._fold.robots:
            return
        self._robots = self._fold.robots
        spaces, refused = namespaces(self._fold.robots)
        for robot in refused.keys() - self._refused.keys():
            self._log(f"{robot} is not in ROS: its name there would be that of {refused[robot]}; rename one of them")
        for robot in self._spaces.keys() - spaces.keys():
            self._nodes.pop(robot).close()
        for robot, space in spaces.items():
            if robot not in self._spaces:
                self._nodes[robot] = self._node(space, OF_ROBOT, HEARD)
        self._spaces, self._refused = spaces, refused
        self._converter.show(spaces)
        for said in self._converter.still(self._at(self._fold.time)):
            self._send(said)

    def _speak(self) -> None:
        for message, robot, time in self._fold.said():
            assert self._fold.settings is not None, "nothing is said without them"
            try:
                for said in self._converter.converted(message, robot, self._fold.settings, self._at(time)):
                    self._send(said)
            except PeerError as fault:
                self._ledger.refuse(type(message).__name__, fault)

    def _at(self, time: float) -> int:
        """Return the stamp [ns] of what was so at a time of the run [s]."""
        return time_ns() if self._wall_time else round(time * SECOND)

    def _wants(self, robot: str, topic: RosTopic) -> bool:
        return (topic is not CLOCK or not self._wall_time) and self._nodes[robot].is_heard(topic)

    def _send(self, said: Said) -> None:
        self._nodes[said.robot].put(said.topic, said.payload)

    def _heed(self, robot: str) -> None:
        """Send the last goal of a robot to the world as an order, and log the answer."""
        try:
            if (payload := self._nodes[robot].newest(GOAL)) is None:
                return
            order = ordered(self._ros, payload, uuid4().hex)
        except PeerError as fault:
            self._ledger.refuse(GOAL.name, PeerError(f"{self._spaces[robot]}/{GOAL.name}: {fault}"))
            return
        try:
            self._log(self._bus.ask(ORDER, order, timeout=ANSWER, robot=robot).text)
        except PeerError as fault:
            self._log(str(fault))

    def _node(self, namespace: str, offers: tuple[RosTopic, ...], hears: tuple[RosTopic, ...]) -> LiveNode:
        node = Node(domain=self._domain, session=self._session.id, number=next(self._numbers), namespace=namespace)
        return LiveNode(self._session, node, self._ros, self._numbers, offers, hears)
