"""The pace of ticks on the wall clock."""

from time import monotonic, perf_counter
from typing import Final

SLIP: Final = 0.5  # s behind the wall clock; a longer delay is not caught up, so that no burst of ticks follows a stall


class Timetable:
    """The time at which each tick ends, on the wall clock."""

    def __init__(self, dt: float, factor: float) -> None:
        self._period = dt / factor
        self._next = monotonic()

    def start(self) -> None:
        """Start again from now, as after a pause."""
        self._next = monotonic()

    def tick(self) -> None:
        """Begin the next tick."""
        self._next = max(self._next + self._period, monotonic() - SLIP)

    @property
    def left(self) -> float:
        """Seconds until the current tick ends; 0 if it has ended."""
        return max(0.0, self._next - monotonic())


class Stopwatch:
    """A stopwatch of wall time, without the pauses."""

    def __init__(self) -> None:
        self._sum = 0.0
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
