"""The process of the bridge to Foxglove: it follows a fleet, shows it to viewers, records it, and hands goals on."""

from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from time import time_ns
from typing import Final
from uuid import uuid4

from swarm.bridge.cdr.layouts import SECOND
from swarm.bridge.fleet_client import REPLY, FleetClient
from swarm.bridge.fleet_view import FLEET
from swarm.bridge.foxglove.bag import Bag
from swarm.bridge.foxglove.clicks import parse_click
from swarm.bridge.foxglove.viewer_server import WAITING, ViewerMessage, ViewerServer
from swarm.bridge.names import assign_namespaces
from swarm.bridge.ros2.convert import Converter, RosMessage
from swarm.bridge.ros2.goals import GOAL_LIMIT
from swarm.bridge.ros2.topics import CLOCK, GOAL, OF_FLEET, OF_ROBOT, TF, TF_STATIC, RosTopic
from swarm.bridge.ros2.types import Types
from swarm.bus import Bus, Endpoint
from swarm.bus.losses import Ledger
from swarm.errors import PeerError
from swarm.heartbeat import Heartbeat
from swarm.messages import ORDER, Truth
from swarm.stop_signal import stop_flag

DISTRO: Final = "jazzy"  # whose types are said: Kilted's are the same
SHOWN: Final = tuple(topic for topic in OF_ROBOT if topic not in {TF, TF_STATIC})  # all robots are in the fleet's tree


def run(
    endpoint: Endpoint,
    fleet: str,
    *,
    serve: Endpoint | None,
    record: Path | None = None,
    read_only: bool = False,
    wall_time: bool = False,
    announced: bool = False,
    log: Callable[[str], None] = print,
) -> int:
    """Show a fleet at an endpoint, and record it, until its run is over or we are told to stop.

    Viewers send robots somewhere, unless they may ``read_only``. Stamps are those of the run; with ``wall_time`` those
    of this machine, without ``/clock``. If it is to be ``announced``, the fleet sees it as a dashboard, which a
    launcher's world waits for.

    Raises:
        ConfigError: the router does not answer, the port is in use, or the file cannot be written.
    """
    ros = Types(DISTRO)
    place = None if serve is None else serve.claim()
    with stop_flag() as stop, ExitStack() as closing:
        bag = None if record is None else closing.enter_context(Bag(record, ros))
        bus = closing.enter_context(Bus(endpoint, fleet, log, Heartbeat()))
        live = (
            None
            if place is None
            else closing.enter_context(ViewerServer(place, fleet, ros, GOAL_LIMIT, read_only=read_only))
        )
        if live is not None:
            log(f"fleet {fleet} is at {live.url} for Foxglove")
        if record is not None:
            log(f"fleet {fleet} is recorded in {record}")
        bridge = FoxgloveBridge(bus, live, bag, ros, wall_time=wall_time, log=log)
        bridge.follow_fleet(stop.is_set, lambda: bus.announce("dashboard", "recorder") if announced else None)
    return 0


def record(endpoint: Endpoint, fleet: str, record: Path) -> int:
    """Record a fleet in a file, as a launcher's process.

    Raises:
        ConfigError: the file cannot be written.
    """
    return run(endpoint, fleet, serve=None, record=record, announced=True)


class FoxgloveBridge:
    """A fleet in viewers and in a bag: topics have the names that ROS has for them."""

    def __init__(
        self,
        bus: Bus,
        live: ViewerServer | None,
        bag: Bag | None,
        ros: Types,
        *,
        wall_time: bool,
        log: Callable[[str], None],
    ) -> None:
        self._bus, self._live, self._ros = bus, live, ros
        self._sinks: tuple[ViewerServer | Bag, ...] = tuple(sink for sink in (live, bag) if sink is not None)
        self._wall_time, self._log = wall_time, log
        self._ledger = Ledger(log)
        self._follower = FleetClient(bus, log)
        self._fold = self._follower.fold
        self._converter = Converter(joined=True, wants=self._is_topic_wanted)
        self._robots: tuple[str, ...] = ()
        self._refused: dict[str, str] = {}  # robots without a namespace
        self._goals: dict[str, str] = {}  # by topic: the robot
        self._run = -1
        self._offer_topics(FLEET, *(topic for topic in OF_FLEET if topic is not CLOCK or not wall_time))

    def follow_fleet(self, stopped: Callable[[], bool], ready: Callable[[], None] = lambda: None) -> None:
        """Hand on all that comes, in both directions, until the run is over; call ``ready`` when the map has come."""
        while self._fold.settings is None and not stopped():
            self._follower.receive_messages()
        ready()
        while not stopped() and not self._fold.over:
            self._follower.receive_messages()
            self._begin_new_run()
            self._update_robots()
            self._send_messages()
            self._forward_goals()
            self._ledger.flush()
        if self._fold.over:
            self._log("the run is over")

    def _begin_new_run(self) -> None:
        """If another run has begun, begin another file, and let viewers forget what they have drawn."""
        if self._run not in {-1, self._fold.run}:
            for sink in self._sinks:
                sink.begin_run()
            self._send_static_frames()
        self._run = self._fold.run

    def _update_robots(self) -> None:
        """Offer topics of robots that have come, and withdraw those of robots that the run does not have any more."""
        if self._robots == self._fold.robots:
            return
        self._robots = self._fold.robots
        before, (spaces, refused) = self._converter.names, assign_namespaces(self._robots)
        for robot in refused.keys() - self._refused.keys():
            self._log(f"{robot} is not shown: its name there would be that of {refused[robot]}; rename one of them")
        for robot in before.keys() - spaces.keys():
            for sink in self._sinks:
                for topic in SHOWN:
                    sink.withdraw_topic(self._topic_name(robot, topic))
        self._converter.set_namespaces(spaces)
        self._refused = refused
        for robot in spaces.keys() - before.keys():
            self._offer_topics(robot, *SHOWN)
        self._goals = {self._topic_name(robot, GOAL): robot for robot in spaces}
        self._send_static_frames()

    def _send_static_frames(self) -> None:
        for said in self._converter.make_static_frames(self._to_stamp(self._fold.time)):
            self._send_to_sinks(said, self._to_stamp(self._fold.time))

    def _send_messages(self) -> None:
        for message, robot, time in self._fold.take_messages():
            assert self._fold.settings is not None, "nothing is said without them"
            at = self._to_stamp(time)
            try:
                for said in self._converter.convert_message(message, robot, self._fold.settings, at):
                    self._send_to_sinks(said, at)
            except PeerError as fault:
                self._ledger.refuse(type(message).__name__, fault)
            if self._live is not None and isinstance(message, Truth):
                self._live.send_time(at)

    def _send_to_sinks(self, said: RosMessage, at: int) -> None:
        name = self._topic_name(said.robot, said.topic)
        for sink in self._sinks:
            sink.send_payload(name, said.payload, at)

    def _is_topic_wanted(self, robot: str, topic: RosTopic) -> bool:
        if topic is CLOCK and self._wall_time:
            return False
        name = self._topic_name(robot, topic)
        return any(sink.is_topic_wanted(name) for sink in self._sinks)

    def _offer_topics(self, robot: str, *topics: RosTopic) -> None:
        for topic in topics:
            for sink in self._sinks:
                sink.offer_topic(self._topic_name(robot, topic), topic)

    def _topic_name(self, robot: str, topic: RosTopic) -> str:
        return f"{self._converter.names[robot] if robot else ''}/{topic.name}"

    def _to_stamp(self, time: float) -> int:
        """Return the stamp [ns] of what was so at a time of the run [s]."""
        return time_ns() if self._wall_time else round(time * SECOND)

    def _forward_goals(self) -> None:
        """Send what viewers have published to the world as orders, and tell the answers."""
        if self._live is None:
            return
        for published in self._live.take_published():
            self._forward_goal(self._live, published)
        if dropped := self._live.count_dropped():
            fault = PeerError(
                f"{dropped} messages of viewers: expected at most {GOAL_LIMIT} bytes, on a channel that is announced, "
                f"and at most {WAITING} that wait"
            )
            self._ledger.refuse("published", fault)
            self._live.send_status(str(fault), trouble=True)

    def _forward_goal(self, live: ViewerServer, published: ViewerMessage) -> None:
        try:
            if (robot := self._goals.get(published.topic)) is None:
                raise PeerError(f"expected one of {', '.join(self._goals)}")
            order = parse_click(self._ros, published.encoding, published.payload, uuid4().hex)
        except PeerError as fault:
            said = PeerError(f"{published.topic[:80]}: {fault}")
            self._ledger.refuse("published", said)
            live.send_status(str(said), trouble=True)
            return
        try:
            text, trouble = self._bus.ask(ORDER, order, timeout=REPLY, robot=robot).text, False
        except PeerError as fault:
            text, trouble = str(fault), True
        self._log(text)
        live.send_status(text, trouble=trouble)
