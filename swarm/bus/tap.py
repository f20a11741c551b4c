"""What goes over a router, as bytes, for tools that count and show it; and the fleets that are on a router."""

import re
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass
from threading import Thread
from time import monotonic
from typing import Any, Final

import zenoh

from swarm.bus.connection import channel, connect, strip_sources
from swarm.bus.inbox_item import ID
from swarm.bus.losses import Gaps
from swarm.bus.mailbox import Mailbox
from swarm.bus.settings import Endpoint
from swarm.errors import ConfigError, PeerError
from swarm.messages import SETUP, Topic
from swarm.messages.topic import key_prefix_of
from swarm.secure.access import LAST

WAITING: Final = 50_000  # samples that wait to be taken; more are dropped and counted


@dataclass(frozen=True, slots=True)
class Sample:
    """A message as it went over the wire."""

    key: str  # below the fleet's
    payload: bytes
    at: float  # s, when it came, by the monotonic clock of this process
    lost: int = 0  # messages lost on its key since the sample before, those before dropped samples included


class Tap:
    """A session that hears every message on a key of a fleet, wildcards included. Use it in a ``with``."""

    def __init__(self, endpoint: Endpoint, fleet: str, key: str) -> None:
        try:
            self._key = zenoh.KeyExpr.autocanonize(key_prefix_of(fleet) + key)
        except zenoh.ZError as fault:
            raise ConfigError(
                f"expected a key such as robot/r1/state or robot/*/state, got {key!r}: {strip_sources(str(fault))}; "
                "`swarm topics` lists the keys in use"
            ) from None
        self._endpoint, self._prefix = endpoint, key_prefix_of(fleet)
        self._samples: Mailbox[Sample] = Mailbox()
        self.dropped = 0  # samples that came faster than they were taken

    def __enter__(self) -> "Tap":
        self._session = connect(self._endpoint)
        self._samples.open()
        self._subscriber = self._session.declare_subscriber(self._key, channel())
        self._reader = Thread(target=self._read, name="swarm-tap", daemon=True)
        self._reader.start()
        return self

    def __exit__(self, *fault: object) -> None:
        self._samples.close()
        with suppress(zenoh.ZError):
            self._subscriber.undeclare()  # type: ignore[no-untyped-call]
        self._reader.join()  # a thread that is still in Zenoh when the process ends would abort it
        self._session.close()  # type: ignore[no-untyped-call]

    def receive(self, timeout: float | None) -> Sample | None:
        """Return the next sample; None if none comes within ``timeout`` [s] (None: for ever), or when told to stop."""
        return self._samples.next(timeout)

    def last(self, key: str | None = None, timeout: float = 2.0) -> list[Sample]:
        """Return the last messages that processes of the fleet keep under a key, the tap's own by default.

        Each topic is asked for by its own key: a fleet with keys lets nobody ask for a key that stands for more.
        """
        wanted = self._key if key is None else zenoh.KeyExpr(self._prefix + key)
        found = []
        kept: tuple[Topic[Any], ...] = (*LAST, *((SETUP,) if self._endpoint.identity is None else ()))
        for topic in kept:
            every = zenoh.KeyExpr(self._prefix + re.sub(r"{\w+}", "*", topic.key))
            if not every.intersects(wanted):
                continue
            for reply in self._session.get(wanted if every.includes(wanted) else every, timeout=timeout):
                if reply.ok is not None and wanted.intersects(reply.ok.key_expr):
                    below_fleet = str(reply.ok.key_expr).removeprefix(self._prefix)
                    found.append(Sample(below_fleet, reply.ok.payload.to_bytes(), monotonic()))
        return found

    def _read(self) -> None:
        take, gaps, lost = self._subscriber.handler.recv, Gaps(), Counter[str]()  # by key, until a sample is put
        with suppress(zenoh.ZError):  # the channel is closed: the subscription or the session has ended
            while True:
                sample = take()
                key, attached = str(sample.key_expr).removeprefix(self._prefix), sample.attachment
                with suppress(PeerError):  # the number of a stranger says nothing
                    if count := gaps.count_lost(key, None if attached is None else attached.to_bytes()):
                        lost[key] += count
                if self._samples.size() >= WAITING:
                    self.dropped += 1
                    continue
                self._samples.put(Sample(key, sample.payload.to_bytes(), monotonic(), lost.pop(key, 0)))


def fleets(endpoint: Endpoint) -> list[str]:
    """Return the names of the fleets on a router, sorted.

    Raises:
        ConfigError: no router answers.
    """
    with connect(endpoint) as session:
        return names_on(session)


def find_other_wires(session: zenoh.Session, fleet: str, role: str, timeout: float) -> list[str]:
    """Return the other versions of the wire that processes of a role speak in a fleet of that name, sorted."""
    _, ours, *_ = key_prefix_of(fleet).split("/")
    replies = session.liveliness().get(f"swarm/*/{fleet}/alive/{role}/*/*", timeout=timeout)
    keys = [str(reply.ok.key_expr).split("/") for reply in replies if reply.ok is not None]
    return sorted({key[1] for key in keys if re.fullmatch(r"v\d{1,6}", key[1])} - {ours})


def names_on(session: zenoh.Session, role: str = "*", timeout: float = 2.0) -> list[str]:
    """Return the names of the fleets in which a session finds a process of a role within a time [s], sorted."""
    replies = session.liveliness().get(f"{key_prefix_of('*')}alive/{role}/*/*", timeout=timeout)
    keys = [str(reply.ok.key_expr) for reply in replies if reply.ok is not None]
    beginning = key_prefix_of("").removesuffix("/")  # of the key of every fleet
    names = {key.removeprefix(beginning).split("/")[0] for key in keys}
    return sorted(name for name in names if ID.match(name))
