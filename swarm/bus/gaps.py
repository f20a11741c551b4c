"""Counts messages that were lost on the way, from the numbers that their senders attach."""

from random import SystemRandom
from typing import Final

from msgspec import DecodeError
from msgspec.msgpack import Decoder, Encoder

from swarm.errors import PeerError
from swarm.messages.topic import Sequence

MOST: Final = 5000  # keys of one subscription that are followed; the one followed longest is dropped first
LONGEST: Final = 32  # bytes of an attachment
ENCODER: Final = Encoder()
DECODER: Final = Decoder(Sequence)


class Numbers:
    """Numbers the messages of one sender, on each key from 0."""

    def __init__(self) -> None:
        self._sender = SystemRandom().randrange(2**32)
        self._next: dict[str, int] = {}

    def attachment(self, key: str) -> bytes:
        """Return what to attach to the next message on a key."""
        number = self._next.get(key, 0)
        self._next[key] = number + 1
        return ENCODER.encode((self._sender, number))


class Gaps:
    """The last number on each key of one subscription.

    It knows nothing of what was sent before the first message that came: who listens late has lost nothing. Nor does a
    sender that has started again lose anything: it is another sender.
    """

    def __init__(self) -> None:
        self._last: dict[str, tuple[int, int]] = {}  # by key: sender and number

    def lost(self, key: str, attached: bytes | None) -> int:
        """Return how many messages were lost on a key right before the one with this attachment.

        A message without an attachment comes from software that does not number its messages: nothing is known then.

        Raises:
            PeerError: the attachment is no ``Sequence``.
        """
        if attached is None:
            return 0
        try:
            sender, number = DECODER.decode(attached[: LONGEST + 1])
        except DecodeError as fault:
            raise PeerError(f"{key}: attachment: expected (sender, number), got {attached[:16]!r} ({fault})") from None
        before = self._last.get(key)
        if before is None and len(self._last) >= MOST:
            del self._last[next(iter(self._last))]
        if before is None or before[0] != sender:
            self._last[key] = sender, number
            return 0
        if number <= before[1]:
            return 0
        self._last[key] = sender, number
        return number - before[1] - 1
