"""The pace of ticks on the wall clock."""

from bisect import bisect_left
from itertools import accumulate
from math import ceil, exp, log
from time import monotonic, perf_counter
from typing import Final

SHARES: Final = {"p50": 0.5, "p99": 0.99, "p99.9": 0.999}  # of the ticks
SHORTEST: Final = 1e-5  # s, upper edge of the first bin
STEP: Final = log(1.01)  # each bin's upper edge is 1 % above that of the bin before
BINS: Final = 1 + ceil(log(1e7) / STEP)  # up to 100 s
SLIP: Final = 0.5  # s behind the wall clock; a longer delay is not caught up, so that no burst of ticks follows a stall


class Times:
    """The wall times of many ticks, in a histogram of fixed size: a share is at most 1 % too high."""

    def __init__(self, bins: list[int] | None = None, longest: float = 0.0) -> None:
        """Begin with no tick, or go on counting from ``bins`` and the ``longest`` time [s] of a world before."""
        self.bins = bins if bins is not None and len(bins) == BINS else [0] * BINS
        self.longest = longest

    def add(self, seconds: float) -> None:
        """Count one tick."""
        self.bins[min(BINS - 1, ceil(log(max(seconds, SHORTEST) / SHORTEST) / STEP))] += 1
        self.longest = max(self.longest, seconds)

    def time_within(self, share: float) -> float:
        """Return the time [s] within which this share of the ticks was over."""
        ticks = list(accumulate(self.bins))
        return min(SHORTEST * exp(bisect_left(ticks, share * ticks[-1]) * STEP), self.longest)

    def report(self) -> dict[str, float] | None:
        """Return the times for a report [s]; None if no tick was counted."""
        if not any(self.bins):
            return None
        return {name: self.time_within(share) for name, share in SHARES.items()} | {"max": self.longest}


class Timetable:
    """The time at which each tick ends, on the wall clock, and how long the ticks took."""

    def __init__(self, dt: float, factor: float) -> None:
        self._period = dt / factor
        self._next = monotonic()
        self._timed = True
        self.times = Times()

    def start(self) -> None:
        """Start again from now, as after a pause."""
        self._next = monotonic()

    def tick(self) -> None:
        """Begin the next tick."""
        self._next = max(self._next + self._period, monotonic() - SLIP)
        self._timed = False

    def look(self, *, answered: bool) -> float:
        """Return the seconds until the current tick ends; count its time once it is ``answered`` or has ended.

        The time runs from the tick's place in the timetable: a world that begins a tick late spends that time too, and
        a tick that is not answered in time takes at least the period.
        """
        left = self.time_left
        if not self._timed and (answered or left == 0.0):
            self._timed = True
            self.times.add(self._period - (self._next - monotonic()))
        return left

    @property
    def time_left(self) -> float:
        """Seconds until the current tick ends; 0 if it has ended."""
        return max(0.0, self._next - monotonic())


class Stopwatch:
    """A stopwatch of wall time, without the pauses."""

    def __init__(self, seconds: float = 0.0) -> None:
        self._sum = seconds
        self._since: float | None = None

    def go(self) -> None:
        """Start or resume."""
        if self._since is None:
            self._since = perf_counter()

    def halt(self) -> None:
        """Pause."""
        if self._since is not None:
            self._sum += perf_counter() - self._since
            self._since = None

    @property
    def seconds(self) -> float:
        """Wall time so far [s], without the pauses."""
        return self._sum + (perf_counter() - self._since if self._since is not None else 0.0)
