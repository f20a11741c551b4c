"""A row of the table of topics, which is in the package's ``__init__``."""

from dataclasses import dataclass
from typing import Generic, TypeVar

from swarm.messages.fields import Message

M = TypeVar("M", bound=Message)


def below(fleet: str) -> str:
    """Return the beginning of every key of a fleet."""
    return f"swarm/v1/{fleet}/"


@dataclass(frozen=True, slots=True)
class Topic(Generic[M]):
    """One row of the table."""

    key: str  # below swarm/v1/<fleet>/
    message: type[M]
    rate: float  # Hz, usual rate; 0: on change or on request
    timeout: float  # s; an older message is stale; 0: never stale
    reliable: bool = False  # a full queue makes the sender wait; otherwise it drops the message
    limit: int = 16_384  # bytes; a longer payload is refused without decoding
    json: bool = False  # the payload is JSON text, for programs without MessagePack
