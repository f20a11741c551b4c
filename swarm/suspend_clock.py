"""A clock for patience with others: it stands while this process does."""

from collections.abc import Callable
from time import monotonic
from typing import Final

LONGEST: Final = 1.0  # s between two looks; beyond that the process was stopped, or computed and heard nobody


class Awake:
    """The time for which a process could hear others.

    A process that was stopped for longer than it waits for others must not blame them for its own silence: what they
    said meanwhile is still to be read, or is said again.
    """

    def __init__(self, source: Callable[[], float] = monotonic) -> None:
        self._source = source
        self._read = source()
        self._now = 0.0

    def now(self) -> float:
        """Return the time [s] since the beginning, without what is beyond ``LONGEST`` between two calls."""
        read = self._source()
        self._now += min(read - self._read, LONGEST)
        self._read = read
        return self._now
