"""What one process has not got: messages lost on the way, by the numbers that senders attach, and those it refused."""

from collections import Counter
from collections.abc import Callable
from random import SystemRandom
from time import monotonic
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
PAUSE: Final = 1.0  # s between two lines in the log about the same matter
ADVICE: Final = "this process or the network is too slow: fewer robots or a lower --pace"


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

    def count_lost(self, key: str, attached: bytes | None) -> int:
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


class Tally:
    """A count by topic, and at most one line a second about it in the log."""

    def __init__(self, says: Callable[[int, str], str], log: Callable[[str], None]) -> None:
        self._says, self._log = says, log
        self.counts: Counter[str] = Counter()  # by topic key
        self._since_log = 0
        self._last = ""
        self._logged_at = float("-inf")

    def add(self, where: str, text: str, count: int = 1) -> None:
        """Count under a topic key; the text says what came last."""
        self.counts[where] += count
        self._since_log += count
        self._last = text
        self.flush()

    def flush(self) -> None:
        """Log what has not been logged, if the last line is a second old."""
        if self._since_log and monotonic() - self._logged_at >= PAUSE:
            self._log(self._says(self._since_log, self._last))
            self._logged_at, self._since_log = monotonic(), 0


def _messages(count: int, kind: str = "") -> str:
    return f"{count} {kind}message{'s' * (count > 1)}"


class Ledger:
    """The two tallies of a bus."""

    def __init__(self, log: Callable[[str], None]) -> None:
        self.refused = Tally(lambda count, last: f"dropped {_messages(count, 'bad ')}; the last one: {last}", log)
        self.lost = Tally(
            lambda count, last: f"{_messages(count)} lost on the way; the last gap: {last}; {ADVICE}", log
        )

    def refuse(self, where: str, fault: PeerError) -> None:
        """Count a message that was dropped because it is bad."""
        self.refused.add(where, str(fault))

    def miss(self, where: str, key: str, count: int) -> None:
        """Count messages that were lost right before one that came on a key."""
        self.lost.add(where, f"{_messages(count)} on {key}", count)

    def flush(self) -> None:
        """Log what has not been logged."""
        self.refused.flush()
        self.lost.flush()
