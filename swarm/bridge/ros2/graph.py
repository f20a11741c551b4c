"""The bridge's nodes in the graph of ROS: who is announced, the messages that go out and come in, and requests."""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import count
from time import time_ns
from typing import Any, Final

from swarm.bridge.ros2.goals import GOAL_LIMIT
from swarm.bridge.ros2.topics import RosService, RosTopic
from swarm.bridge.ros2.types import Types
from swarm.bridge.ros2.wire import EndpointKind, RosEndpoint, RosNode
from swarm.bus.foreign import Foreign, ForeignRequest
from swarm.errors import PeerError

REQUEST_LIMIT: Final = 65_536  # bytes; a goal of 100 poses takes 9,000


@dataclass(frozen=True, slots=True)
class ServiceRequest:
    """A request of a client, to be answered once, at once or later."""

    message: Any
    _ros: Types
    _type: str  # of the answer
    _asked: ForeignRequest
    _endpoint: RosEndpoint

    def answer(self, **fields: Any) -> None:  # noqa: ANN401
        """Send the answer with these fields, all that its type has."""
        payload = self._ros.serialize(self._type, self._ros.make_message(self._type, **fields))
        self._asked.answer(payload, self._endpoint.make_answer_attachment(self._asked.attachment, time_ns()))

    def refuse(self, reason: str) -> None:
        """Send an error with its reason."""
        self._asked.refuse(reason)


class LiveNode:
    """A node in one namespace, present in ROS until ``close``, with what it offers, hears and serves.

    What is longer than ``limit`` [bytes] on a topic is refused.
    """

    def __init__(
        self,
        session: Foreign,
        node: RosNode,
        ros: Types,
        numbers: Iterator[int],
        refused: Callable[[str, PeerError], None],
        offers: Iterable[RosTopic] = (),
        hears: Iterable[RosTopic] = (),
        serves: Iterable[RosService] = (),
        limit: int = GOAL_LIMIT,
    ) -> None:
        """Announce it; ``refused`` is told of what comes and is bad."""
        self._session, self._node, self._ros, self._refused = session, node, ros, refused
        self._offered: dict[str, tuple[RosEndpoint, Iterator[int]]] = {}
        self._heard: dict[str, RosEndpoint] = {}
        self._served: dict[str, RosEndpoint] = {}
        self._announce_token(node.token)
        for topic in offers:
            endpoint = node.make_endpoint(next(numbers), EndpointKind.PUBLISHER, topic, ros.type_hash(topic.type))
            session.offer(endpoint.key, kept=1 if topic.qos.is_latched else 0)
            self._announce_token(endpoint.token)
            self._offered[topic.name] = endpoint, count(1)
        for topic in hears:
            endpoint = node.make_endpoint(next(numbers), EndpointKind.SUBSCRIBER, topic, ros.type_hash(topic.type))
            session.listen(endpoint.key, limit, late=topic.qos.is_latched)
            self._announce_token(endpoint.token)
            self._heard[topic.name] = endpoint
        for service in serves:
            endpoint = node.make_endpoint(next(numbers), EndpointKind.SERVICE, service, ros.type_hash(service.type))
            session.serve(endpoint.key, limit=REQUEST_LIMIT)
            self._announce_token(endpoint.token)
            self._served[service.name] = endpoint

    def publish_message(self, topic: RosTopic, message: object) -> None:
        """Publish a message of a topic that the node offers."""
        self.publish_payload(topic, self._ros.serialize(topic.type, message))

    def publish_payload(self, topic: RosTopic, payload: bytes) -> None:
        """Publish a message as CDR."""
        endpoint, numbers = self._offered[topic.name]
        attached = endpoint.make_attachment(next(numbers), time_ns())
        self._session.send(endpoint.key, payload, attached)

    def has_subscribers(self, topic: RosTopic) -> bool:
        """Return True if anybody subscribes to a topic that the node offers."""
        return self._session.is_heard(self._offered[topic.name][0].key)

    def take_newest_payload(self, topic: RosTopic) -> bytes | None:
        """Return the payload that came last on a topic since the last call; None if none came, or it is too long."""
        try:
            return self._session.newest(self._heard[topic.name].key)
        except PeerError as fault:
            self.refuse_input(topic, fault)
            return None

    def refuse_input(self, what: RosTopic | RosService, fault: PeerError) -> str:
        """Count what came on a topic or for a service as bad; return the sentence about it."""
        text = f"{self._node.namespace.rstrip('/')}/{what.name}: {fault}"
        self._refused(what.name, PeerError(text))
        return text

    def take_requests(self, service: RosService) -> Iterator[ServiceRequest]:
        """Yield the requests to a service since the last call; a bad one is refused."""
        endpoint = self._served[service.name]
        for asked in self._session.take_queries(endpoint.key):
            try:
                endpoint.make_answer_attachment(asked.attachment, 0)
                message = self._ros.deserialize(f"{service.type}_Request", asked.read())
            except PeerError as fault:
                asked.refuse(self.refuse_input(service, fault))
                continue
            yield ServiceRequest(message, self._ros, f"{service.type}_Response", asked, endpoint)

    def take_payloads(self, topic: RosTopic) -> list[bytes | PeerError]:
        """Return the payloads that came on a topic since the last call, or an error for one that is too long."""
        return self._session.take_payloads(self._heard[topic.name].key)

    def close(self) -> None:
        """Withdraw the node and all that it has announced."""
        for endpoint in (*(one for one, _ in self._offered.values()), *self._heard.values(), *self._served.values()):
            if endpoint.token is not None:
                self._session.withdraw(endpoint.token)
            self._session.withdraw(endpoint.key)
        if self._node.token is not None:
            self._session.withdraw(self._node.token)

    def _announce_token(self, token: str | None) -> None:
        if token is not None:
            self._session.announce(token)
