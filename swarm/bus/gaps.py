"""Counts messages that were lost on the way, from the numbers that their senders attach."""

from random import SystemRandom
from typing import Final

from msgspec import DecodeError
from msgspec.msgpack import Decoder, Encoder

from swarm.errors import PeerError
from swarm.messages.topic import Sequence

MOST: Final = 5000  # keys of one subscription that are followed; the one silent longest is dropped first
FARTHEST: Final = 100_000  # messages; a longer step, up or down, is no gap: the count begins again with it
LONGEST: Final = 32  # bytes of an attachment
ENCODER: Final = Encoder()
DECODER: Final = Decoder(Sequence)


class Numbers:
    """Numbers the messages of one sender, on each key from 0."""

    def __init__(self) -> None:
        self.sender = SystemRandom().randrange(2**32)
        self._next: dict[str, int] = {}

    def attachment(self, key: str) -> bytes:
        """Return what to attach to the next message on a key."""
        number = self._next.get(key, 0)
        self._next[key] = number + 1
        return ENCODER.encode((self.sender, number))


class Gaps:
    """The last number on each key of one subscription.

    It knows nothing of what was sent before the first message that came: who listens late has lost nothing. Nor does a
    sender that has started again lose anything: it is another sender.
    """

    def __init__(self) -> None:
        self._last: dict[str, tuple[int, int]] = {}  # by key: sender and number; the key silent longest is first

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
        before = self._last.pop(key, None)
        if before is None and len(self._last) >= MOST:
            del self._last[next(iter(self._last))]
        goes_on = before is not None and before[0] == sender and abs(number - before[1]) <= FARTHEST
        last = before[1] if before is not None and goes_on else number
        self._last[key] = sender, max(last, number)  # put back at the end
        return max(0, number - last - 1)

    def sender(self, key: str, attached: bytes | None) -> int | None:
        """Return the sender of the message on a key that was counted last; None if nothing was attached to it."""
        return None if attached is None else self._last[key][0]
