"""The bridge's nodes in the graph of ROS: who is announced, and the messages that go out and come in."""

from collections.abc import Iterable, Iterator
from itertools import count
from time import time_ns

from swarm.bridge.ros2.goals import GOAL_LIMIT
from swarm.bridge.ros2.types import Types
from swarm.bridge.ros2.wire import EndpointKind, Node, RosEndpoint, RosTopic, attachment
from swarm.bus.foreign import Foreign
from swarm.errors import PeerError


class LiveNode:
    """A node in one namespace, present in ROS until ``close``, with what it offers and hears.

    What is longer than ``limit`` [bytes] is refused.
    """

    def __init__(
        self,
        session: Foreign,
        node: Node,
        ros: Types,
        numbers: Iterator[int],
        offers: Iterable[RosTopic],
        hears: Iterable[RosTopic],
        limit: int = GOAL_LIMIT,
    ) -> None:
        self._session, self._node, self._ros = session, node, ros
        self._offered: dict[str, tuple[RosEndpoint, Iterator[int]]] = {}
        self._heard: dict[str, RosEndpoint] = {}
        session.announce(node.token)
        for topic in offers:
            endpoint = node.endpoint(next(numbers), EndpointKind.PUBLISHER, topic, ros.hash(topic.type))
            session.offer(endpoint.key, kept=1 if topic.qos.is_latched else 0)
            session.announce(endpoint.token)
            self._offered[topic.name] = endpoint, count(1)
        for topic in hears:
            endpoint = node.endpoint(next(numbers), EndpointKind.SUBSCRIBER, topic, ros.hash(topic.type))
            session.listen(endpoint.key, limit, late=topic.qos.is_latched)
            session.announce(endpoint.token)
            self._heard[topic.name] = endpoint

    def send(self, topic: RosTopic, message: object) -> None:
        """Publish a message of a topic that the node offers."""
        endpoint, numbers = self._offered[topic.name]
        attached = attachment(next(numbers), time_ns(), endpoint.gid)
        self._session.send(endpoint.key, self._ros.serialize(topic.type, message), attached)

    def newest(self, topic: RosTopic) -> bytes | None:
        """Return the payload that came last on a topic since the last call; None if none came.

        Raises:
            PeerError: it is too long.
        """
        return self._session.newest(self._heard[topic.name].key)

    def arrived(self, topic: RosTopic) -> list[bytes | PeerError]:
        """Return the payloads that came on a topic since the last call, or an error for one that is too long."""
        return self._session.arrived(self._heard[topic.name].key)

    def close(self) -> None:
        """Withdraw the node and all that it has announced."""
        for endpoint in (*(one for one, _ in self._offered.values()), *self._heard.values()):
            self._session.withdraw(endpoint.token)
            self._session.withdraw(endpoint.key)
        self._session.withdraw(self._node.token)
