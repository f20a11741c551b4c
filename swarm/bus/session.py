"""One Zenoh session for the rest of the project: send, listen, ask, answer, and one inbox for everything that arrives.

What arrives waits in a channel of Zenoh's until ``receive`` decodes it. Zenoh's threads run no code of ours: it would
wait for Python's lock, and a process that computes for longer than the lease would be called gone.
"""

import re
from collections import Counter, deque
from collections.abc import Callable
from contextlib import suppress
from threading import Thread
from time import monotonic, sleep
from typing import Any, Final, TypeVar

import zenoh

from swarm.bus import settings
from swarm.bus.arrivals import Arrival, Link, Presence, Request, encoding
from swarm.bus.codec import decode, encode
from swarm.bus.connection import channel, connect
from swarm.bus.inbox_item import ID, Item, count_lost_before, decode_item, inbox_item, is_browsing, parse_presence
from swarm.bus.losses import Gaps, Ledger, Numbers
from swarm.bus.mailbox import Mailbox
from swarm.bus.tap import find_other_wires
from swarm.errors import ConfigError, PeerError
from swarm.heartbeat import Heartbeat
from swarm.messages import REPLIES, Accepted, Message, Topic
from swarm.messages.topic import key_prefix_of

AGAIN: Final = (0.005, 0.01, 0.02, 0.04, 0.08, 0.16)  # s between two questions who is there, if the answer is nobody
INBOX_LIMIT: Final = 50_000  # arrivals that wait in the inbox; more are dropped and counted

M = TypeVar("M", bound=Message)
D = TypeVar("D", bound=Any)  # a subscriber, a queryable or a listener


class Bus:
    """The connection to a fleet. Use it in a ``with``: an open session keeps a process, and its presence, alive."""

    def __init__(
        self,
        endpoint: settings.Endpoint,
        fleet: str,
        log: Callable[[str], None] = print,
        heart: Heartbeat | None = None,
    ) -> None:
        if not ID.match(fleet):
            raise ConfigError(f"fleet: expected letters, digits and _ . : - (at most 64), got {fleet!r}")
        self._fleet, self._prefix = fleet, key_prefix_of(fleet)
        self._endpoint = endpoint
        self._inbox: Mailbox[Item] = Mailbox()
        self._quiet: dict[str, tuple[Topic[Any], Gaps, Callable[[], zenoh.Sample | None]]] = {}  # by key; how to poll
        self._kept: set[str] = set()  # keys of topics whose last messages this process answers with
        self._taken: deque[Item] = deque()  # quiet arrivals, for the next calls of ``receive``
        self._declared: dict[str, Any] = {}
        self._readers: list[tuple[Any, Thread]] = []
        self._publishers: dict[str, Any] = {}
        self._watching = False  # who is present
        self._ledger = Ledger(log)
        self._numbers = Numbers()
        self._heart = heart  # beats whenever the caller's loop asks for what has arrived
        self.overflowed = 0  # arrivals dropped because the inbox was full

    def __enter__(self) -> "Bus":
        self._session = connect(self._endpoint)
        self._session.__enter__()
        self._inbox.open()
        self._reading(
            self._session.info.declare_transport_events_listener(channel(), history=False),
            lambda event: self._inbox.put(("link", event.kind == zenoh.SampleKind.PUT)),
        )
        return self

    def __exit__(self, *fault: object) -> None:
        self._ledger.flush()
        self._inbox.close()
        for declared, reader in self._readers:
            with suppress(zenoh.ZError):
                declared.undeclare()  # it closes the channel, and so ends the thread
            reader.join()  # a thread that is still in Zenoh when the process ends would abort it
        self._session.__exit__(*fault)  # type: ignore[no-untyped-call]

    @property
    def id(self) -> str:
        """This session's own id."""
        return str(self._session.zid())

    @property
    def sender(self) -> int:
        """The number that this session attaches to all its messages."""
        return self._numbers.sender

    @property
    def refused_counts(self) -> Counter[str]:
        """Messages dropped because they are bad, by topic key."""
        return self._ledger.refused.counts

    @property
    def lost_counts(self) -> Counter[str]:
        """Messages lost on the way or in a full inbox, by topic key; those of the radio model are not among them."""
        return self._ledger.lost.counts

    # --- out ---

    def send(self, topic: Topic[M], message: M, *, sure: bool = False, **ids: str | int) -> None:
        """Publish a message. While the router is away, every message is lost.

        If the send queue is full, a reliable topic waits and any other topic drops the message; with ``sure`` every
        topic waits. Messages keep their order and may share a packet: Zenoh's "express" mode would cost a packet, and
        a wake-up of the receiver, for each message.
        """
        wait, key = sure or topic.reliable, self._prefix + topic.key.format(**ids)
        self._session.put(
            key,
            encode(message, topic.json),
            encoding=encoding(type(message), topic.json),
            congestion_control=zenoh.CongestionControl.BLOCK if wait else zenoh.CongestionControl.DROP,
            attachment=self._numbers.attachment(key),
        )

    def has_listener(self, topic: Topic[Any], **ids: str | int) -> bool:
        """Return True if anybody listens to a topic; if nobody does, a large message need not be made."""
        key = self._prefix + topic.key.format(**ids)
        if key not in self._publishers:
            self._publishers[key] = self._session.declare_publisher(key)
        return bool(self._publishers[key].matching_status.matching)

    def ask(
        self,
        topic: Topic[M],
        message: M,
        timeout: float = 5.0,
        fits: Callable[[Any], bool] = lambda reply: True,
        **ids: str,
    ) -> Any:  # noqa: ANN401, of REPLIES
        """Send a request and return the first answer that ``fits``, a message of the type ``REPLIES[topic.key]``.

        Raises:
            PeerError: the request is refused (with the reason), or no answer comes within ``timeout`` [s].
        """
        reason = f"expected an answer, got none; is the fleet's {topic.answerer} running?"
        every = zenoh.ConsolidationMode.NONE  # by default only the last of several answers would come
        key, payload = self._prefix + topic.key.format(**ids), encode(message)
        for reply in self._session.get(
            key, payload=payload, encoding=encoding(type(message)), timeout=timeout, consolidation=every
        ):
            if reply.ok is not None:
                try:
                    answer = decode(reply.ok.payload.to_bytes(), REPLIES.get(topic.key, Accepted), topic.limit)
                except PeerError as fault:
                    reason = str(fault)
                    continue
                if fits(answer):
                    return answer
                reason = "expected an answer of the process that was asked, got one of another"
            elif reply.err is not None:
                reason = reply.err.payload.to_bytes().decode(errors="replace")[:2000]
        raise PeerError(topic.format_refusal(reason, **ids))

    def fetch(self, topic: Topic[M], timeout: float = 5.0, **ids: str | int) -> list[M]:
        """Return the last messages of a topic from processes that keep them; key parts left out match everything."""
        found = []
        for reply in self._session.get(self._key(topic, ids), timeout=timeout):
            if reply.ok is not None:
                try:
                    found.append(decode(reply.ok.payload.to_bytes(), topic.message, topic.limit, topic.json))
                except PeerError as fault:
                    self._ledger.refuse(topic.key, fault)
        return found

    def query_announced(self, role: str, timeout: float = 2.0) -> list[Presence]:
        """Ask who announces a role now; wait for each answer for ``timeout`` [s] at most.

        Zenoh 1.10 sometimes answers nobody at once, and goes on so for some milliseconds, if this session watches
        presence and another one asks too. Then it is asked again, a little later each time. None answers in part.
        """
        for pause in (*AGAIN, None):
            found = self._collect_announced(role, timeout)
            if found or pause is None or not self._watching:
                break
            sleep(pause)
        return found

    def _collect_announced(self, role: str, timeout: float) -> list[Presence]:
        found = []
        for reply in self._session.liveliness().get(f"{self._prefix}alive/{role}/*/*", timeout=timeout):
            if reply.ok is not None:
                try:
                    found.append(parse_presence(self._prefix, str(reply.ok.key_expr), alive=True))
                except PeerError as fault:
                    self._ledger.refuse("alive", fault)
        return found

    def sessions(self, role: str, timeout: float = 2.0) -> set[str]:
        """Ask which sessions announce a role now."""
        return {one.session for one in self.query_announced(role, timeout)}

    def other_wires(self, role: str) -> list[str]:
        """Ask which other versions of the wire processes of a role speak in a fleet of this name."""
        return find_other_wires(self._session, self._fleet, role, timeout=0.5)  # s; meanwhile nothing is received

    def announce(self, role: str, name: str) -> None:
        """Announce this process under a name until ``withdraw`` or the end of the session."""
        key = f"{self._prefix}alive/{role}/{name}/{self.id}"
        if key not in self._declared:
            self._declared[key] = self._session.liveliness().declare_token(key)

    def withdraw(self, role: str, name: str) -> None:
        """End the announcement of a name, if there is one."""
        if (token := self._declared.pop(f"{self._prefix}alive/{role}/{name}/{self.id}", None)) is not None:
            token.undeclare()

    # --- in ---

    def listen(self, topic: Topic[Any], *, quiet: bool = False, **ids: str | int) -> None:
        """Put a topic's messages into the inbox; key parts left out match everything. A second call changes nothing.

        With ``quiet`` the messages do not wake a waiting ``receive``; the next call returns them before all others.
        """
        key = self._key(topic, ids)
        if key in self._declared:
            return
        subscriber, gaps = self._session.declare_subscriber(key, channel()), Gaps()
        if quiet:
            self._declared[key], self._quiet[key] = subscriber, (topic, gaps, subscriber.handler.try_recv)
        else:
            self._declared[key] = self._reading(
                subscriber, lambda sample: self._put_into_inbox(inbox_item(topic, gaps, sample))
            )

    def unlisten(self, topic: Topic[Any], **ids: str | int) -> None:
        """Stop listening to a topic; the arguments are those of ``listen``. What has arrived is kept."""
        key = self._key(topic, ids)
        self._declared.pop(key).undeclare()
        if key in self._quiet:
            self._take_quiet(*self._quiet.pop(key))

    def serve(self, topic: Topic[Any], **ids: str | int) -> None:
        """Put requests on a topic into the inbox, as ``Request``; while the inbox is full they are refused.

        One on a key with wildcards is refused too; without a payload it only looks for what is kept, and has no answer.
        """

        def ask(query: zenoh.Query) -> None:
            if not is_browsing(query, kept=topic.key in self._kept) and not self._put_into_inbox(
                ("query", topic, query)
            ):
                query.reply_err(b"expected room in the inbox of this process, found it full; ask again later")
                query.drop()  # type: ignore[no-untyped-call]

        self._reading(self._session.declare_queryable(self._key(topic, ids), channel()), ask)

    def keep(self, topic: Topic[M], last: Callable[[], dict[str, M]], **ids: str | int) -> None:
        """Answer ``fetch`` with the messages that ``last()`` returns, each under its full key below the fleet."""
        prefix = self._prefix

        def answer(query: zenoh.Query) -> None:
            for name, message in ({} if topic.key in REPLIES and query.payload is not None else last()).items():
                if query.key_expr.intersects(zenoh.KeyExpr(prefix + name)):
                    query.reply(
                        prefix + name, encode(message, topic.json), encoding=encoding(type(message), topic.json)
                    )
            query.drop()  # type: ignore[no-untyped-call]

        self._kept.add(topic.key)
        self._reading(self._session.declare_queryable(self._key(topic, ids), channel()), answer)

    def watch_presence(self, role: str = "*") -> None:
        """Put ``Presence`` of one role, or of all, into the inbox, also of processes that are already present."""
        self._watching = True
        tokens = self._session.liveliness().declare_subscriber(
            f"{self._prefix}alive/{role}/*/*", channel(), history=True
        )
        put = self._inbox.put
        self._reading(tokens, lambda token: put(("token", str(token.key_expr), token.kind == zenoh.SampleKind.PUT)))

    def receive(self, timeout: float | None = None) -> Arrival | Presence | Link | Request | None:
        """Return the next arrival; None if none comes within ``timeout`` [s] (None: for ever), or when told to stop.

        A message that is malformed, too large, or of a wrong type or version is counted in ``refused_counts``, logged
        at most once a second, and skipped. A gap in the numbers of a sender's messages is counted in ``lost_counts``,
        and logged so.
        """
        deadline = None if timeout is None else monotonic() + timeout
        if self._heart is not None:
            self._heart.beat()
        while True:
            if not self._taken:
                self._take(deadline)
            if not self._taken:
                self._ledger.flush()
                return None
            item = self._taken.popleft()
            try:
                if item[0] == "sample" and (lost := count_lost_before(item)):
                    self._ledger.miss(item[1].key, item[2], lost)
                return decode_item(self._prefix, item)
            except PeerError as fault:
                self._ledger.refuse(item[1].key if item[0] != "token" else "alive", fault)

    def wake(self) -> None:
        """Let ``receive`` return at once, with None if nothing has come; any thread may call it."""
        self._inbox.wake()

    # --- inside ---

    def _key(self, topic: Topic[Any], ids: dict[str, str | int]) -> str:
        names = re.findall(r"{(\w+)}", topic.key)
        return self._prefix + topic.key.format(**{name: ids.get(name, "*") for name in names})

    def _take(self, deadline: float | None) -> None:
        """Take the next arrival of the inbox if one comes before the deadline [s], and before it all quiet ones."""
        wait = None if deadline is None else max(0.0, deadline - monotonic())
        first = self._inbox.next(wait)
        for quiet in self._quiet.values():
            self._take_quiet(*quiet)
        if first is not None:
            self._taken.append(first)

    def _take_quiet(self, topic: Topic[Any], gaps: Gaps, poll: Callable[[], zenoh.Sample | None]) -> None:
        try:
            while (sample := poll()) is not None:
                self._taken.append(inbox_item(topic, gaps, sample))
        except zenoh.ZError:
            pass  # the subscription has ended, and its last message is taken

    def _put_into_inbox(self, item: Item) -> bool:
        """Put an item into the inbox and return True, or count it if the inbox is full."""
        if room := self._inbox.size() < INBOX_LIMIT:
            self._inbox.put(item)
        else:
            self.overflowed += 1
        return room

    def _reading(self, declared: D, use: Callable[[Any], object]) -> D:
        """Call ``use`` with all that comes through the channel of a declaration, in a thread of its own."""
        next_one = declared.handler.recv  # taken once: the declaration itself must be free to end meanwhile

        def read() -> None:
            with suppress(zenoh.ZError):  # the channel is closed: the declaration or the session has ended
                while True:
                    use(next_one())

        (reader := Thread(target=read, name="swarm-bus", daemon=True)).start()
        self._readers = [*(one for one in self._readers if one[1].is_alive()), (declared, reader)]
        return declared
