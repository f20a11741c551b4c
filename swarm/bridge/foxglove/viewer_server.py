"""A server for viewers of Foxglove's protocol, such as Foxglove and Lichtblick: they see topics, and publish goals.

The SDK runs it on threads of its own. What they call here only puts what came into a queue that has an end.
"""

from collections import deque
from collections.abc import Iterator
from typing import Any, Final, NamedTuple

import foxglove
from foxglove.websocket import Capability, ServerListener, StatusLevel

from swarm.bridge.foxglove.channels import Channels
from swarm.bridge.ros2.topics import RosTopic
from swarm.bridge.ros2.types import Types
from swarm.bus import Endpoint
from swarm.errors import ConfigError

WAITING: Final = 1000  # things that viewers have done, until they are looked at; newer ones are dropped, and counted
BACKLOG: Final = 1024  # messages that wait for a viewer; the SDK drops the oldest then
ENCODINGS: Final = ("json", "cdr")  # in which viewers may publish
MOST: Final = 100  # topics that a viewer may announce


class ViewerMessage(NamedTuple):
    """What a viewer has published."""

    topic: str
    encoding: str
    payload: bytes


class ViewerListener(ServerListener):
    """What viewers do, until ``Live`` takes it."""

    def __init__(self, limit: int) -> None:
        """Take payloads of at most ``limit`` bytes."""
        self._limit = limit
        self._announced: dict[tuple[int, int], tuple[str, str]] = {}  # by viewer and its channel: topic, encoding
        self.published: deque[ViewerMessage] = deque()
        self.subscribed: deque[str] = deque()  # topics
        self.dropped = 0  # of what was published: too much waits, or it is too long

    def on_subscribe(self, client: Any, channel: Any) -> None:  # noqa: ANN401
        """Note that a viewer wants a topic: what is kept for those who come late is said again."""
        if len(self.subscribed) < WAITING:
            self.subscribed.append(channel.topic)

    def on_client_advertise(self, client: Any, channel: Any) -> None:  # noqa: ANN401
        """Note what a viewer is going to publish."""
        mine = sum(viewer == client.id for viewer, _ in self._announced)
        if mine < MOST:
            self._announced[client.id, channel.id] = channel.topic, channel.encoding

    def on_client_unadvertise(self, client: Any, client_channel_id: int) -> None:  # noqa: ANN401
        """Forget that."""
        self._announced.pop((client.id, client_channel_id), None)

    def on_message_data(self, client: Any, client_channel_id: int, data: bytes) -> None:  # noqa: ANN401
        """Keep what a viewer has published."""
        about = self._announced.get((client.id, client_channel_id))
        if about is None or len(self.published) >= WAITING or len(data) > self._limit:
            self.dropped += 1
        else:
            self.published.append(ViewerMessage(*about, data))


class ViewerServer:
    """The server. Use it in a ``with``."""

    def __init__(self, endpoint: Endpoint, name: str, ros: Types, limit: int, *, read_only: bool = False) -> None:
        """Offer a fleet's ``name`` at an endpoint; take payloads of at most ``limit`` bytes, none if ``read_only``."""
        self._endpoint, self._name = endpoint, name
        self._capabilities = [Capability.Time] if read_only else [Capability.Time, Capability.ClientPublish]
        self._context = foxglove.Context()
        self._channels = Channels(ros, self._context)
        self._listener = ViewerListener(limit)
        self._latched: dict[str, tuple[bytes, int] | None] = {}

    def __enter__(self) -> "ViewerServer":
        foxglove.set_log_level("CRITICAL")  # it logs to standard error; what viewers do wrong is theirs
        try:
            self._server = foxglove.start_server(
                name=self._name, host=self._endpoint.host, port=self._endpoint.port, context=self._context,
                capabilities=self._capabilities, server_listener=self._listener,
                supported_encodings=list(ENCODINGS), message_backlog_size=BACKLOG,
            )  # fmt: skip
        except RuntimeError as fault:
            raise ConfigError(
                f"port {self._endpoint.port} on {self._endpoint.host}: expected to serve there, got: {fault}; "
                "give another port with --port (0 picks a free one)"
            ) from None
        return self

    def __exit__(self, *fault: object) -> None:
        self._server.stop()

    @property
    def url(self) -> str:
        """The address that a viewer is given."""
        return f"ws://{self._endpoint.host}:{self._server.port}"

    def begin_run(self) -> None:
        """Announce another run: viewers clear what they have drawn, and nothing is kept of the run before."""
        self._latched = dict.fromkeys(self._latched)
        self._channels.reset_time()
        self._server.clear_session()

    def offer_topic(self, name: str, topic: RosTopic) -> None:
        """Add a topic; a name begins with a slash."""
        self._channels.offer_topic(name, topic)
        if topic.qos.is_latched:
            self._latched[name] = None

    def withdraw_topic(self, name: str) -> None:
        """Take a topic away."""
        self._channels.withdraw_topic(name)
        self._latched.pop(name, None)

    def is_topic_wanted(self, name: str) -> bool:
        """Return True if a viewer wants a topic now."""
        return self._channels.is_topic_wanted(name)

    def send_payload(self, name: str, payload: bytes, at: int) -> None:
        """Say a message that was sent at a time [ns]."""
        if name in self._latched:
            self._latched[name] = payload, at
        self._channels.log_message(name, payload, at)  # nothing, if no viewer wants it

    def send_time(self, at: int) -> None:
        """Send viewers the time [ns]."""
        self._server.broadcast_time(at)

    def send_status(self, text: str, *, trouble: bool) -> None:
        """Show viewers a sentence."""
        self._server.publish_status(text, StatusLevel.Warning if trouble else StatusLevel.Info)

    def take_published(self) -> Iterator[ViewerMessage]:
        """Yield what viewers have published last on each topic since the last call.

        Who has subscribed since then gets what is kept.
        """
        again = set()
        while self._listener.subscribed:
            again.add(self._listener.subscribed.popleft())
        for name in again & self._latched.keys():
            if (kept := self._latched[name]) is not None:
                self._channels.log_message(name, *kept)
        waiting = [self._listener.published.popleft() for _ in range(len(self._listener.published))]
        yield from {one.topic: one for one in waiting}.values()

    def count_dropped(self) -> int:
        """Return how many messages of viewers were dropped since the last call."""
        count, self._listener.dropped = self._listener.dropped, 0
        return count
