"""A session on a router with others who do not speak our wire, such as ROS 2: its caller has the keys and the bytes.

It is here because no other room imports zenoh.
"""

from typing import Any, Final

import zenoh
import zenoh.ext

from swarm.bus import settings
from swarm.bus.connecting import plain
from swarm.errors import ConfigError, PeerError

WAITING: Final = 8  # messages of a key that wait to be taken; a newer one takes the place of the oldest
HEARTBEAT: Final = 0.5  # s, after which a latched topic tells its last number: rmw_zenoh's


class Foreign:
    """A session that knows nothing of topics or messages. Use it in a ``with``.

    What comes waits in a channel of Zenoh's: no thread of this process takes it, and no sender waits for it.
    """

    def __init__(self, endpoint: settings.Endpoint) -> None:
        self._endpoint = endpoint
        self._tokens: dict[str, Any] = {}
        self._publishers: dict[str, Any] = {}
        self._subscribers: dict[str, tuple[Any, int]] = {}

    def __enter__(self) -> "Foreign":
        try:
            self._session = zenoh.open(settings.client(self._endpoint))
        except zenoh.ZError as fault:
            raise ConfigError(
                f"endpoint {self._endpoint}: expected a running router, got: {plain(str(fault))}; "
                "start that router first, or name another one"
            ) from None
        return self

    def __exit__(self, *fault: object) -> None:
        self._session.close()  # type: ignore[no-untyped-call]

    @property
    def id(self) -> str:
        """This session's own id."""
        return str(self._session.zid())

    def announce(self, key: str) -> None:
        """Hold a liveliness token until ``withdraw`` or the end of the session."""
        self._tokens[key] = self._session.liveliness().declare_token(key)

    def offer(self, key: str, kept: int = 0) -> None:
        """Declare a publisher. Who comes late can ask it for the last ``kept`` messages, as an advanced subscriber."""
        self._publishers[key] = zenoh.ext.declare_advanced_publisher(
            self._session,
            key,
            congestion_control=zenoh.CongestionControl.DROP,
            cache=zenoh.ext.CacheConfig(kept) if kept else None,
            publisher_detection=True if kept else None,
            sample_miss_detection=zenoh.ext.MissDetectionConfig(heartbeat=None, sporadic_heartbeat=HEARTBEAT)
            if kept
            else None,
        )

    def send(self, key: str, payload: bytes, attachment: bytes) -> None:
        """Publish bytes on a key that is offered; if the send queue is full, they are dropped."""
        self._publishers[key].put(payload, attachment=attachment)

    def listen(self, key: str, limit: int, *, late: bool = False) -> None:
        """Take what comes on a key, payloads of at most ``limit`` bytes; with ``late`` also what publishers keep."""
        waiting: Any = zenoh.handlers.RingChannel(WAITING)
        subscriber = (
            zenoh.ext.declare_advanced_subscriber(
                self._session, key, waiting, history=zenoh.ext.HistoryConfig(detect_late_publishers=True)
            )
            if late
            else self._session.declare_subscriber(key, waiting)
        )
        self._subscribers[key] = subscriber, limit

    def arrived(self, key: str) -> list[bytes | PeerError]:
        """Return the payloads that came on a key since the last call, the oldest first; the last ``WAITING`` at most.

        For one that is too long there is an error in its place.
        """
        subscriber, limit = self._subscribers[key]
        found: list[bytes | PeerError] = []
        while (sample := subscriber.try_recv()) is not None:
            length = len(sample.payload)
            wrong = PeerError(f"expected at most {limit} bytes, got {length}")
            found.append(sample.payload.to_bytes() if length <= limit else wrong)
        return found

    def newest(self, key: str) -> bytes | None:
        """Return the payload that came last on a key since the last call; None if none came.

        Raises:
            PeerError: it is too long.
        """
        last = next(reversed(self.arrived(key)), None)
        if isinstance(last, PeerError):
            raise last
        return last

    def withdraw(self, key: str) -> None:
        """End all that is announced, offered or heard under a key."""
        if (token := self._tokens.pop(key, None)) is not None:
            token.undeclare()
        if (publisher := self._publishers.pop(key, None)) is not None:
            publisher.undeclare()
        if (subscriber := self._subscribers.pop(key, None)) is not None:
            subscriber[0].undeclare()
