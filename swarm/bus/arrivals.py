"""What may lie in the inbox: a message, a question, a process that came or went, the link to the router."""

from dataclasses import dataclass, field
from typing import Any

import zenoh

from swarm.bus.codec import encode
from swarm.messages import Message, Topic


@dataclass(frozen=True, slots=True)
class Arrival:
    """A message on a topic listened to."""

    topic: Topic[Any]
    ids: dict[str, str]  # the key's variable parts
    message: Any  # of ``topic.message``


@dataclass(frozen=True, slots=True)
class Presence:
    """A process came or went."""

    role: str
    id: str
    session: str  # so that two processes under one name are told apart
    alive: bool


@dataclass(frozen=True, slots=True)
class Link:
    """The connection to the router came up or went down."""

    up: bool


@dataclass(frozen=True, slots=True)
class Request:
    """Somebody asks; answer it once, with ``accept`` or ``refuse``."""

    topic: Topic[Any]
    message: Any
    query: zenoh.Query = field(repr=False)
    key: str

    def accept(self, reply: Message) -> None:
        """Answer."""
        self.query.reply(self.key, encode(reply))
        self.query.drop()  # type: ignore[no-untyped-call]

    def refuse(self, reason: str) -> None:
        """Refuse, and say why."""
        self.query.reply_err(reason.encode())
        self.query.drop()  # type: ignore[no-untyped-call]
