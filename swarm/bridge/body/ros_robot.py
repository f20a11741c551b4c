"""A robot in the graph of ROS: what it says, and twists for it."""

from collections.abc import Callable, Iterator
from itertools import count
from time import time_ns
from typing import Final, TypeVar

from swarm.bridge.body import readings
from swarm.bridge.body.body import STANDS, BodyOptions
from swarm.bridge.ros2.convert import make_header
from swarm.bridge.ros2.graph import LiveNode
from swarm.bridge.ros2.topics import RosTopic
from swarm.bridge.ros2.types import Types
from swarm.bridge.ros2.wire import RosNode
from swarm.bus.foreign import Foreign
from swarm.bus.losses import Ledger
from swarm.errors import PeerError
from swarm.geometry import Twist

T = TypeVar("T")

FAREWELLS: Final = 3  # twists of 0 at the end: one of them may be lost
BASE: Final = "base_link"
TWIST, STAMPED, VECTOR = "geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped", "geometry_msgs/msg/Vector3"


class RosRobot:
    """A robot in the graph of ROS: what it says, and a twist for it."""

    def __init__(self, session: Foreign, ros: Types, domain: int, setting: BodyOptions, ledger: Ledger) -> None:
        self._ros, self._setting, self._ledger = ros, setting, ledger
        self._command = RosTopic(setting.command.strip("/"), STAMPED if setting.stamped else TWIST)
        self.hears = readings.build_topics(setting.odometry, setting.localisation, setting.scan, setting.stop)
        name = "swarm_body_" + "".join(letter if letter.isalnum() else "_" for letter in setting.robot)
        node = RosNode(domain=domain, session=session.id, number=0, namespace="/", name=name)
        most = max(readings.LIMITS.values())
        self._node = LiveNode(
            session, node, ros, count(1), ledger.refuse, (self._command,), tuple(self.hears.values()), limit=most
        )

    def take_readings(self, kind: str, read: Callable[[Types, bytes], T]) -> Iterator[T]:
        """Yield the readings of a type that have come since the last call, the oldest first."""
        if (topic := self.hears.get(kind)) is None:
            return
        for payload in self._node.take_payloads(topic):
            try:
                if isinstance(payload, PeerError):
                    raise payload
                yield read(self._ros, payload)
            except PeerError as fault:
                self._ledger.refuse(topic.name, PeerError(f"/{topic.name}: {fault}"))

    def send_twist(self, twist: Twist) -> None:
        """Publish a twist for the robot."""
        ros = self._ros
        linear = ros.make_message(VECTOR, x=twist.linear, y=0.0, z=0.0)
        told = ros.make_message(TWIST, linear=linear, angular=ros.make_message(VECTOR, x=0.0, y=0.0, z=twist.angular))
        if self._setting.stamped:
            told = ros.make_message(STAMPED, header=make_header(ros, BASE, time_ns()), twist=told)
        self._node.publish_message(self._command, told)

    def stop_robot(self) -> None:
        """Publish the last twists: the robot stands."""
        for _ in range(FAREWELLS):
            self.send_twist(STANDS)
