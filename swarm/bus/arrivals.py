"""The kinds of arrival in the inbox: a message, a request, a process that came or went, a change of the link."""

from dataclasses import dataclass, field
from functools import cache
from typing import Any

import zenoh

from swarm.bus.codec import encode
from swarm.messages import Message, Topic
from swarm.messages.topic import encoding_of


@cache
def encoding(kind: type[Message], as_json: bool = False) -> zenoh.Encoding:
    """Return what is told beside the payload of a message."""
    return zenoh.Encoding(encoding_of(kind, as_json))


@dataclass(frozen=True, slots=True)
class Arrival:
    """A message on a topic that this process listens to."""

    topic: Topic[Any]
    ids: dict[str, str]  # the key's variable parts
    message: Any  # of ``topic.message``
    sender: int | None = field(default=None, compare=False)  # the number that its sender has attached, if it has


@dataclass(frozen=True, slots=True)
class Presence:
    """A process that came or went."""

    role: str
    id: str
    session: str  # tells two processes with one name apart
    alive: bool


@dataclass(frozen=True, slots=True)
class Link:
    """A change of the connection to the router: it came up or went down."""

    up: bool


@dataclass(frozen=True, slots=True)
class Request:
    """A request from another process. Answer it once, with ``accept`` or ``refuse``."""

    topic: Topic[Any]
    message: Any
    query: zenoh.Query = field(repr=False)
    key: str
    ids: dict[str, str] = field(default_factory=dict)  # the key's variable parts

    def accept(self, reply: Message) -> None:
        """Send the reply."""
        self.query.reply(self.key, encode(reply), encoding=encoding(type(reply)))
        self.query.drop()  # type: ignore[no-untyped-call]

    def refuse(self, reason: str) -> None:
        """Send a refusal with its reason."""
        self.query.reply_err(reason.encode())
        self.query.drop()  # type: ignore[no-untyped-call]
