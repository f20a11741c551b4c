"""A row of the table of topics, which is in the package's ``__init__``, and what travels beside a payload."""

from dataclasses import dataclass
from typing import Annotated, Generic, NamedTuple, TypeVar

from msgspec import Meta

from swarm.messages.fields import VERSION, Count, Message, doc
from swarm.messages.short_ids import shorten_ids

M = TypeVar("M", bound=Message)


def key_prefix_of(fleet: str) -> str:
    """Return the beginning of every key of a fleet."""
    return f"swarm/v{VERSION}/{fleet}/"


def encoding_of(kind: type[Message], as_json: bool = False) -> str:
    """Return the encoding that Zenoh tells beside a payload: for tools; a receiver goes by the key."""
    return "application/json" if as_json else f"application/msgpack;swarm.v{VERSION}.{kind.__name__}"


class Sequence(NamedTuple):
    """What is attached to each message, packed by MessagePack: so a receiver tells a lost message from silence."""

    sender: Annotated[
        int,
        Meta(
            ge=0,
            lt=2**32,
            description="random; drawn when the sender starts; if it changes, the count starts at 0 again",
        ),
    ]
    number: Annotated[Count, doc("of this message: each sender counts its messages on each key, from 0")]


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

    @property
    def encoding(self) -> str:
        """The encoding of its messages."""
        return encoding_of(self.message, self.json)

    @property
    def answerer(self) -> str:
        """The process that answers requests on it."""
        return "launcher" if self.key.startswith("fleet/") else "world"

    def format_refusal(self, reason: str, **ids: str) -> str:
        """Return the sentence about a request that was refused, or not answered, as whoever asked understands it.

        It names no key, and nothing twice.
        """
        what, named = self.key.rsplit("/", 1)[1], [one for one in ids.values() if one]
        for known in (*named, self.message.__name__.lower()):
            reason = reason.removeprefix(f"{known}: ")
        if not named and reason.startswith((f"{what} ", f"{what}: ")):
            return shorten_ids(reason)
        return shorten_ids(f"{what}{''.join(f' of {one}' for one in named)}: {reason}")
