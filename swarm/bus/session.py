"""One Zenoh session for the rest of the project: send, listen, ask, answer, and one inbox for everything that arrives.

Zenoh runs callbacks on its own threads, prints their exceptions and goes on. So a callback here only puts what came
into the inbox; ``receive`` decodes it in the thread of its caller.
"""

import re
from collections import Counter, deque
from collections.abc import Callable
from queue import Empty, SimpleQueue
from time import monotonic
from types import TracebackType
from typing import Any, Final, TypeVar

import zenoh

from swarm.bus import settings
from swarm.bus.arrivals import Arrival, Link, Presence, Request
from swarm.bus.codec import decode, encode
from swarm.errors import ConfigError, PeerError, SwarmError
from swarm.messages import REPLIES, Accepted, Message, Topic

INBOX_LIMIT: Final = 50_000  # arrivals that wait in the inbox; more are dropped and counted
ID: Final = re.compile(r"^[A-Za-z0-9_.:-]{1,64}\Z")

M = TypeVar("M", bound=Message)


class Bus:
    """The connection to a fleet. Use it in a ``with``: an open session keeps a process, and its presence, alive."""

    def __init__(self, endpoint: settings.Endpoint, fleet: str, log: Callable[[str], None] = print) -> None:
        if not ID.match(fleet):
            raise ConfigError(f"fleet: expected letters, digits and _ . : - (at most 64), got {fleet!r}")
        self._prefix = f"swarm/v1/{fleet}/"
        self._endpoint = endpoint
        self._log = log
        self._inbox: SimpleQueue[tuple[Any, ...]] = SimpleQueue()
        self._quiet: deque[tuple[Any, ...]] = deque()  # arrivals that do not wake a waiting ``receive``
        self._declared: dict[str, Any] = {}
        self._listeners: list[Any] = []
        self._publishers: dict[str, Any] = {}
        self._refused_since_log: Counter[str] = Counter()
        self._last_refusal = ""
        self._logged_at = float("-inf")
        self.refused: Counter[str] = Counter()  # messages dropped, by topic key
        self.overflowed = 0  # arrivals dropped because the inbox was full

    def __enter__(self) -> "Bus":
        try:
            self._session = zenoh.open(settings.client(self._endpoint))
        except zenoh.ZError as fault:
            raise ConfigError(
                f"endpoint {self._endpoint}: expected a running router, got {fault}; start one with `swarm router`"
            ) from None
        self._session.__enter__()
        self._listeners.append(
            self._session.info.declare_transport_events_listener(
                zenoh.handlers.Callback(self._on_transport, indirect=False), history=False
            )
        )
        return self

    def __exit__(
        self, kind: type[BaseException] | None, fault: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._flush_refusals()
        self._session.__exit__(kind, fault, trace)  # type: ignore[no-untyped-call]

    @property
    def id(self) -> str:
        """This session's own id."""
        return str(self._session.zid())

    # --- out ---

    def send(self, topic: Topic[M], message: M, *, sure: bool = False, **ids: str | int) -> None:
        """Publish a message. While the router is away, every message is lost.

        If the send queue is full, a reliable topic waits and any other topic drops the message; with ``sure`` every
        topic waits. Messages keep their order and may share a packet: Zenoh's "express" mode would cost a packet, and
        a wake-up of the receiver, for each message.
        """
        wait = sure or topic.reliable
        self._session.put(
            self._prefix + topic.key.format(**ids),
            encode(message),
            congestion_control=zenoh.CongestionControl.BLOCK if wait else zenoh.CongestionControl.DROP,
        )

    def wanted(self, topic: Topic[Any], **ids: str | int) -> bool:
        """Return True if anybody listens to a topic; if nobody does, a large message need not be made."""
        key = self._prefix + topic.key.format(**ids)
        if key not in self._publishers:
            self._publishers[key] = self._session.declare_publisher(key)
        return bool(self._publishers[key].matching_status)

    def ask(self, topic: Topic[M], message: M, timeout: float = 5.0) -> Any:  # noqa: ANN401, of REPLIES
        """Send a request and return the answer, a message of the type ``REPLIES[topic.key]``.

        Raises:
            PeerError: the request is refused (with the reason), or no answer comes within ``timeout`` [s].
        """
        for reply in self._session.get(self._prefix + topic.key, payload=encode(message), timeout=timeout):
            if reply.ok is not None:
                return decode(reply.ok.payload.to_bytes(), REPLIES.get(topic.key, Accepted), topic.limit)
            reason = reply.err.payload.to_bytes().decode(errors="replace") if reply.err is not None else "no reason"
            raise PeerError(f"{topic.key}: {reason}")
        raise PeerError(f"{topic.key}: expected an answer, got none; is that process running?")

    def fetch(self, topic: Topic[M], timeout: float = 5.0, **ids: str | int) -> list[M]:
        """Return the last messages of a topic from processes that keep them; key parts left out match everything."""
        found = []
        for reply in self._session.get(self._key(topic, ids), timeout=timeout):
            if reply.ok is not None:
                try:
                    found.append(decode(reply.ok.payload.to_bytes(), topic.message, topic.limit))
                except PeerError as fault:
                    self._refuse(topic.key, fault)
        return found

    def announce(self, role: str, name: str) -> None:
        """Announce this process under a name until ``withdraw`` or the end of the session."""
        key = f"{self._prefix}alive/{role}/{name}/{self.id}"
        if key not in self._declared:
            self._declared[key] = self._session.liveliness().declare_token(key)

    def withdraw(self, role: str, name: str) -> None:
        """End the announcement of a name."""
        self._declared.pop(f"{self._prefix}alive/{role}/{name}/{self.id}").undeclare()

    # --- in ---

    def listen(self, topic: Topic[Any], *, quiet: bool = False, **ids: str | int) -> None:
        """Put a topic's messages into the inbox; key parts left out match everything. A second call changes nothing.

        With ``quiet`` the messages do not wake a waiting ``receive``; the next call returns them before all others.
        """
        key = self._key(topic, ids)
        if key in self._declared:
            return
        limit = topic.limit
        waiting, put = (self._quiet.__len__, self._quiet.append) if quiet else (self._inbox.qsize, self._inbox.put)

        def on_sample(sample: zenoh.Sample) -> None:
            if waiting() >= INBOX_LIMIT:
                self.overflowed += 1
            else:
                payload = sample.payload
                size = len(payload)
                put(("sample", topic, str(sample.key_expr), payload.to_bytes() if size <= limit else size))

        self._declared[key] = self._session.declare_subscriber(key, zenoh.handlers.Callback(on_sample, indirect=False))

    def unlisten(self, topic: Topic[Any], **ids: str | int) -> None:
        """Stop listening to a topic; the arguments are those of ``listen``."""
        self._declared.pop(self._key(topic, ids)).undeclare()

    def serve(self, topic: Topic[Any], **ids: str | int) -> None:
        """Put requests on a topic into the inbox, as ``Request``."""
        key = self._key(topic, ids)
        inbox = self._inbox

        def on_query(query: zenoh.Query) -> None:
            inbox.put(("query", topic, query))

        self._listeners.append(self._session.declare_queryable(key, zenoh.handlers.Callback(on_query, indirect=False)))

    def keep(self, topic: Topic[M], last: Callable[[], dict[str, M]], **ids: str | int) -> None:
        """Answer ``fetch`` with the messages that ``last()`` returns, each under its full key below the fleet."""
        key, prefix = self._key(topic, ids), self._prefix

        def on_query(query: zenoh.Query) -> None:
            for name, message in last().items():
                if query.key_expr.intersects(zenoh.KeyExpr(prefix + name)):
                    query.reply(prefix + name, encode(message))
            query.drop()  # type: ignore[no-untyped-call]

        self._listeners.append(self._session.declare_queryable(key, zenoh.handlers.Callback(on_query, indirect=False)))

    def watch_presence(self, role: str = "*") -> None:
        """Put ``Presence`` of one role, or of all, into the inbox, also of processes that are already present."""
        inbox = self._inbox

        def on_token(sample: zenoh.Sample) -> None:
            inbox.put(("token", str(sample.key_expr), sample.kind == zenoh.SampleKind.PUT))

        self._listeners.append(
            self._session.liveliness().declare_subscriber(
                f"{self._prefix}alive/{role}/*/*", zenoh.handlers.Callback(on_token, indirect=False), history=True
            )
        )

    def receive(self, timeout: float | None = None) -> Arrival | Presence | Link | Request | None:
        """Return the next arrival, or None if nothing arrives within ``timeout`` [s] (None: wait for ever).

        A message that is malformed, too large, or of a wrong type or version is counted in ``refused``, logged at most
        once a second, and skipped.
        """
        deadline = None if timeout is None else monotonic() + timeout
        while True:
            try:
                if self._quiet:
                    item = self._quiet.popleft()
                else:
                    wait = None if deadline is None else max(0.0, deadline - monotonic())
                    item = self._inbox.get(timeout=wait) if wait is None or wait > 0 else self._inbox.get_nowait()
            except Empty:
                self._flush_refusals()
                return None
            try:
                return self._open(item)
            except PeerError as fault:
                self._refuse(item[1].key if item[0] != "token" else "alive", fault)

    # --- inside ---

    def _key(self, topic: Topic[Any], ids: dict[str, str | int]) -> str:
        names = re.findall(r"{(\w+)}", topic.key)
        return self._prefix + topic.key.format(**{name: ids.get(name, "*") for name in names})

    def _on_transport(self, event: zenoh.TransportEvent) -> None:
        self._inbox.put(("link", event.kind == zenoh.SampleKind.PUT))

    def _open(self, item: tuple[Any, ...]) -> Arrival | Presence | Link | Request:
        match item:
            case ("sample", topic, key, payload):
                ids = self._ids(topic, key)
                if isinstance(payload, int):
                    raise PeerError(f"{key}: expected at most {topic.limit} bytes, got {payload}")
                message = decode(payload, topic.message, topic.limit)
                claimed = getattr(message, "robot", None)
                if "robot" in ids and claimed is not None and claimed != ids["robot"]:
                    raise PeerError(f"{key}: expected a message of {ids['robot']!r}, got one of {claimed!r}")
                return Arrival(topic, ids, message)
            case ("query", topic, query):
                key = str(query.key_expr)
                try:
                    if query.payload is None:
                        raise PeerError(f"{key}: expected a payload, got none")
                    message = decode(query.payload.to_bytes(), topic.message, topic.limit)
                except PeerError as fault:
                    query.reply_err(str(fault).encode())
                    query.drop()
                    raise
                return Request(topic, message, query, self._prefix + topic.key)
            case ("token", key, alive):
                parts = key.removeprefix(self._prefix).split("/")
                if len(parts) != 4 or not all(ID.match(part) for part in parts):
                    raise PeerError(f"{key}: expected alive/<role>/<id>/<session>")
                return Presence(parts[1], parts[2], parts[3], alive)
            case ("link", up):
                return Link(up)
        raise SwarmError(f"inbox: unknown item {item!r}")

    def _ids(self, topic: Topic[Any], key: str) -> dict[str, str]:
        names, chunks = topic.key.split("/"), key.removeprefix(self._prefix).split("/")
        if len(names) != len(chunks):
            raise PeerError(f"{key}: expected the key {self._prefix}{topic.key}")
        ids = {}
        for name, chunk in zip(names, chunks, strict=True):
            if not name.startswith("{"):
                if name != chunk:
                    raise PeerError(f"{key}: expected the key {self._prefix}{topic.key}")
            elif not ID.match(chunk):
                raise PeerError(f"{key}: expected an id of letters, digits and _ . : -, got {chunk!r}")
            else:
                ids[name[1:-1]] = chunk
        return ids

    def _refuse(self, where: str, fault: PeerError) -> None:
        self.refused[where] += 1
        self._refused_since_log[where] += 1
        self._last_refusal = str(fault)
        self._flush_refusals()

    def _flush_refusals(self) -> None:
        if self._refused_since_log and monotonic() - self._logged_at >= 1.0:
            count = sum(self._refused_since_log.values())
            self._log(f"dropped {count} bad message{'s' * (count > 1)}; the last one: {self._last_refusal}")
            self._logged_at = monotonic()
            self._refused_since_log.clear()
