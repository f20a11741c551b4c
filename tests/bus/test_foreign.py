"""A session with others on a router: bytes on keys, tokens, messages for who comes late."""

from queue import SimpleQueue
from threading import Event
from typing import Any

import pytest
import zenoh
import zenoh.ext

from swarm.bus import Endpoint, connect
from swarm.bus.foreign import WAITING, Foreign, ForeignRequest
from swarm.errors import PeerError
from tests.launch.actors import PATIENCE

pytestmark = pytest.mark.processes


def test_the_newest_of_what_came_is_taken_once_unless_it_is_too_long(endpoint: Endpoint) -> None:
    with Foreign(endpoint) as session, connect(endpoint) as other:
        session.listen("goal", limit=4)
        session.listen("echo", limit=4)
        assert session.newest("goal") is None

        def said(number: int, *payloads: bytes) -> None:
            """Send goals, and wait until they have come: what is sent after them has."""
            for payload in payloads:
                other.put("goal", payload)
            while session.newest("echo") != bytes([number]):
                other.put("echo", bytes([number]))
                list(other.liveliness().get("@nobody/*", timeout=PATIENCE))  # the router has answered

        said(0)  # the subscriptions are known to the other
        said(1, *(bytes([number]) for number in range(3 * WAITING)))
        assert session.newest("goal") == bytes([3 * WAITING - 1])
        assert session.newest("goal") is None
        said(2, b"ok", b"12345")
        with pytest.raises(PeerError, match="expected at most 4 bytes, got 5"):
            session.newest("goal")
        assert session.newest("goal") is None


def test_who_comes_late_gets_what_is_kept_and_no_more_after_it_is_withdrawn(endpoint: Endpoint) -> None:
    with Foreign(endpoint) as session, connect(endpoint) as other:
        tokens: SimpleQueue[zenoh.Sample] = SimpleQueue()
        watching = other.liveliness().declare_subscriber("@there/**", tokens.put, history=True)
        session.announce(f"@there/{session.id}")
        session.offer("kept", kept=1)
        session.offer("after")
        after: SimpleQueue[zenoh.Sample] = SimpleQueue()
        first = other.declare_subscriber("after", after.put)
        while not session.is_heard("after"):
            list(other.liveliness().get("@nobody/*", timeout=PATIENCE))  # the router has answered
        for number in range(3):
            session.send("kept", bytes([number]), b"attached")
        session.send("after", b"", None)
        after.get(timeout=PATIENCE)  # so those before it are not on their way any more

        heard: SimpleQueue[zenoh.Sample] = SimpleQueue()
        late = zenoh.ext.HistoryConfig(detect_late_publishers=True)
        listening = zenoh.ext.declare_advanced_subscriber(other, "kept", heard.put, history=late)
        sample = heard.get(timeout=PATIENCE)
        assert sample.attachment is not None
        assert (sample.payload.to_bytes(), sample.attachment.to_bytes()) == (b"\x02", b"attached")

        session.withdraw("kept")
        session.withdraw(f"@there/{session.id}")
        assert [tokens.get(timeout=PATIENCE).kind for _ in range(2)] == [zenoh.SampleKind.PUT, zenoh.SampleKind.DELETE]
        assert heard.empty()
        first.undeclare()  # type: ignore[no-untyped-call]
        watching.undeclare()  # type: ignore[no-untyped-call]
        listening.undeclare()  # type: ignore[no-untyped-call]


def test_a_request_is_answered_at_once_or_later_or_refused(endpoint: Endpoint) -> None:
    with Foreign(endpoint) as session, connect(endpoint) as other:
        session.serve("asked", limit=4)
        replies: SimpleQueue[zenoh.Reply] = SimpleQueue()

        def asked(*payloads: bytes) -> list[ForeignRequest]:
            """Ask as ROS does, until the requests have come."""
            for payload in payloads:
                other.get(
                    "asked", replies.put, payload=payload, attachment=b"mine",
                    target=zenoh.QueryTarget.ALL_COMPLETE, timeout=PATIENCE,
                )  # fmt: skip
            found: list[ForeignRequest] = []
            while len(found) < len(payloads):
                found += session.take_queries("asked")
            return found

        querier: Any = other.declare_querier("asked", target=zenoh.QueryTarget.ALL_COMPLETE)
        while not querier.matching_status.matching:
            list(other.liveliness().get("@nobody/*", timeout=PATIENCE))  # the router has answered
        late, long = asked(b"late", b"long!")
        assert (late.read(), late.attachment) == (b"late", b"mine")
        with pytest.raises(PeerError, match="expected at most 4 bytes, got 5"):
            long.read()
        long.refuse("no")
        reply = replies.get(timeout=PATIENCE)
        assert reply.err is not None
        assert reply.err.payload.to_bytes() == b"no"
        late.answer(b"yes", b"yours")
        reply = replies.get(timeout=PATIENCE)
        assert reply.ok is not None
        assert reply.ok.attachment is not None
        assert (reply.ok.payload.to_bytes(), reply.ok.attachment.to_bytes()) == (b"yes", b"yours")


def test_it_is_known_whether_anybody_listens(endpoint: Endpoint) -> None:
    with Foreign(endpoint) as session, connect(endpoint) as other:
        session.offer("odom")
        assert not session.is_heard("odom")

        def until(heard: bool) -> None:
            while session.is_heard("odom") != heard:
                list(other.liveliness().get("@nobody/*", timeout=PATIENCE))  # the router has answered

        listening = other.declare_subscriber("odom", zenoh.handlers.RingChannel(1))
        until(heard=True)
        listening.undeclare()  # type: ignore[no-untyped-call]
        until(heard=False)
        session.withdraw("odom")


def test_what_comes_wakes_whoever_waits_and_is_news_once(endpoint: Endpoint) -> None:
    woken = Event()
    with Foreign(endpoint, woken.set) as session, connect(endpoint) as other:
        session.listen("goal", limit=10)
        assert not session.has_arrivals()
        while not woken.is_set():
            other.put("goal", b"there")
            woken.wait(0.1)
        assert (session.has_arrivals(), session.newest("goal")) == (True, b"there")
