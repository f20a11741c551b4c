"""A session on a router with others who do not speak our wire, such as ROS 2: its caller has the keys and the bytes.

It is here because no other room imports zenoh.
"""

from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

import zenoh
import zenoh.ext

from swarm.bus import settings
from swarm.bus.connection import strip_sources
from swarm.errors import ConfigError, PeerError
from swarm.messages.topic import key_prefix_of

WAITING: Final = 8  # messages of a key that wait to be taken; a newer one takes the place of the oldest
HEARTBEAT: Final = 0.5  # s, after which a latched topic tells its last number: rmw_zenoh's
ASKING: Final = 1000  # requests on a key that wait to be taken; a newer one takes the place of the oldest


@dataclass(frozen=True, slots=True)
class ForeignRequest:
    """A request of somebody else. Answer it once, with ``answer`` or ``refuse``, at once or later.

    An answer to who has gone, or no longer waits, goes nowhere.
    """

    key: str
    limit: int  # bytes
    query: zenoh.Query = field(repr=False)

    def read(self) -> bytes:
        """Return its payload.

        Raises:
            PeerError: it is too long.
        """
        payload = self.query.payload
        if payload is not None and len(payload) > self.limit:
            raise PeerError(f"expected at most {self.limit} bytes, got {len(payload)}")
        return b"" if payload is None else payload.to_bytes()

    @property
    def attachment(self) -> bytes | None:
        """What is attached to it; None: nothing."""
        return None if self.query.attachment is None else self.query.attachment.to_bytes()

    def answer(self, payload: bytes, attachment: bytes | None) -> None:
        """Send the answer."""
        with suppress(zenoh.ZError):
            self.query.reply(self.key, payload, attachment=attachment)
        self.query.drop()  # type: ignore[no-untyped-call]

    def refuse(self, reason: str) -> None:
        """Send an error with its reason."""
        with suppress(zenoh.ZError):
            self.query.reply_err(reason.encode())
        self.query.drop()  # type: ignore[no-untyped-call]


class Waiting(NamedTuple):
    """What has come on a key and waits to be taken, and what Zenoh has declared for it."""

    declared: Any
    items: deque[Any]  # the newest; a newer one takes the place of the oldest
    limit: int  # bytes


class Foreign:
    """A session that knows nothing of topics or messages. Use it in a ``with``.

    What comes waits here until it is taken, of each key so much at most; no sender waits for it.
    """

    def __init__(self, endpoint: settings.Endpoint, wake: Callable[[], None] = lambda: None) -> None:
        """Call ``wake`` whenever something has come; any thread may call it."""
        self._endpoint, self._wake = endpoint, wake
        self._news: deque[bool] = deque(maxlen=1)  # something has come
        self._tokens: dict[str, Any] = {}
        self._publishers: dict[str, Any] = {}
        self._heard: dict[str, bool] = {}  # by key of a publisher: whether anybody listens
        self._hearers: dict[str, Any] = {}  # by such a key: a listener that tells when that changes
        self._subscribers: dict[str, Waiting] = {}
        self._queryables: dict[str, Waiting] = {}

    def __enter__(self) -> "Foreign":
        try:
            self._session = zenoh.open(settings.client(self._endpoint))
        except zenoh.ZError as fault:
            raise ConfigError(
                f"endpoint {self._endpoint}: expected a running router, got: {strip_sources(str(fault))}; "
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
        drop = zenoh.CongestionControl.DROP
        if not kept:
            publisher = self._publishers[key] = self._session.declare_publisher(key, congestion_control=drop)
            self._hearers[key] = publisher.declare_matching_listener(zenoh.handlers.RingChannel(1))
            status: Any = publisher.matching_status  # it is no bool, whatever zenoh's types say
            self._heard[key] = status.matching
            return
        self._publishers[key] = zenoh.ext.declare_advanced_publisher(
            self._session,
            key,
            congestion_control=drop,
            cache=zenoh.ext.CacheConfig(kept),
            publisher_detection=True,
            sample_miss_detection=zenoh.ext.MissDetectionConfig(heartbeat=None, sporadic_heartbeat=HEARTBEAT),
        )

    def send(self, key: str, payload: bytes, attachment: bytes | None) -> None:
        """Publish bytes on a key that is offered; if the send queue is full, they are dropped."""
        self._publishers[key].put(payload, attachment=attachment)

    def is_heard(self, key: str) -> bool:
        """Return True if anybody listens to a key that is offered without messages that are kept."""
        if (status := self._hearers[key].try_recv()) is not None:
            self._heard[key] = status.matching
        return self._heard[key]

    def listen(self, key: str, limit: int, *, late: bool = False) -> None:
        """Take what comes on a key, payloads of at most ``limit`` bytes; with ``late`` also what publishers keep."""
        samples, put = self._waiting(WAITING)
        subscriber = (
            zenoh.ext.declare_advanced_subscriber(
                self._session, key, put, history=zenoh.ext.HistoryConfig(detect_late_publishers=True)
            )
            if late
            else self._session.declare_subscriber(key, put)
        )
        self._subscribers[key] = Waiting(subscriber, samples, limit)

    def has_arrivals(self) -> bool:
        """Return True if something has come on any key since the last call."""
        try:
            return self._news.pop()
        except IndexError:
            return False

    def take_payloads(self, key: str) -> list[bytes | PeerError]:
        """Return the payloads that came on a key since the last call, the oldest first; the last ``WAITING`` at most.

        For one that is too long there is an error in its place.
        """
        _, samples, limit = self._subscribers[key]
        found: list[bytes | PeerError] = []
        while samples:
            sample = samples.popleft()
            length = len(sample.payload)
            wrong = PeerError(f"expected at most {limit} bytes, got {length}")
            found.append(sample.payload.to_bytes() if length <= limit else wrong)
        return found

    def newest(self, key: str) -> bytes | None:
        """Return the payload that came last on a key since the last call; None if none came.

        Raises:
            PeerError: it is too long.
        """
        last = next(reversed(self.take_payloads(key)), None)
        if isinstance(last, PeerError):
            raise last
        return last

    def serve(self, key: str, limit: int) -> None:
        """Take requests on a key, payloads of at most ``limit`` bytes.

        It is declared complete: a client of ROS asks only those that are (rmw_zenoh's docs/design.md, Services).
        """
        queries, put = self._waiting(ASKING)
        queryable = self._session.declare_queryable(key, put, complete=True)
        self._queryables[key] = Waiting(queryable, queries, limit)

    def take_queries(self, key: str) -> list[ForeignRequest]:
        """Return the requests on a key since the last call."""
        _, queries, limit = self._queryables[key]
        found = []
        while queries:
            found.append(ForeignRequest(key, limit, queries.popleft()))
        return found

    def withdraw(self, key: str) -> None:
        """End all that is announced, offered, heard or served under a key."""
        if (token := self._tokens.pop(key, None)) is not None:
            token.undeclare()
        if (publisher := self._publishers.pop(key, None)) is not None:
            self._hearers.pop(key, None)
            publisher.undeclare()
        if (subscriber := self._subscribers.pop(key, None)) is not None:
            subscriber.declared.undeclare()
        if (queryable := self._queryables.pop(key, None)) is not None:
            queryable.declared.undeclare()

    def _waiting(self, most: int) -> tuple[deque[Any], Any]:
        """Return where what comes waits, and a handler that puts it there, in Zenoh's own thread."""
        waiting: deque[Any] = deque(maxlen=most)

        def put(item: object) -> None:
            waiting.append(item)
            if not self._news:  # whoever was woken, and has not looked yet, will see this too
                self._news.append(True)
                self._wake()

        return waiting, zenoh.handlers.Callback(put, indirect=False)


class Stranger:
    """A session that keeps to no table of topics; use it in a ``with``. Keys are below the fleet's."""

    def __init__(self, endpoint: settings.Endpoint, fleet: str) -> None:
        self._endpoint, self._prefix = endpoint, key_prefix_of(fleet)
        self._declared: list[Any] = []

    def __enter__(self) -> "Stranger":
        self._session = zenoh.open(settings.client(self._endpoint))
        return self

    def __exit__(self, *fault: object) -> None:
        self._session.close()  # type: ignore[no-untyped-call]

    def send_bytes(self, key: str, payload: bytes) -> None:
        """Send bytes; the key may have wildcards."""
        self._session.put(self._prefix + key, payload)

    def announce_absent(self, key: str) -> None:
        """Announce somebody who is not there."""
        self._declared.append(self._session.liveliness().declare_token(f"{self._prefix}alive/{key}"))

    def answer(self, key: str, reply: Callable[[bytes], bytes]) -> None:
        """Answer every request on a key with what ``reply`` makes of it."""
        full = self._prefix + key

        def on_query(query: zenoh.Query) -> None:
            query.reply(full, reply(query.payload.to_bytes() if query.payload is not None else b""))
            query.drop()  # type: ignore[no-untyped-call]

        self._declared.append(self._session.declare_queryable(full, zenoh.handlers.Callback(on_query, indirect=False)))
