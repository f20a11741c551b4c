"""What one process has not got: messages that it refused, and messages that were lost on the way."""

from collections import Counter
from collections.abc import Callable
from time import monotonic
from typing import Final

from swarm.errors import PeerError

PAUSE: Final = 1.0  # s between two lines in the log about the same matter
ADVICE: Final = "this process or the network is too slow: fewer robots or a lower --pace"


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
