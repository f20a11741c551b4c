"""How fast ticks follow each other. The one file of the world that reads the wall clock."""

from time import monotonic, perf_counter
from typing import Final

SLIP: Final = 0.5  # s behind the wall clock; more is not caught up but given up, so that a stall is no burst


class Timetable:
    """When each tick is over, on the wall clock."""

    def __init__(self, dt: float, factor: float) -> None:
        self._period = dt / factor
        self._next = monotonic()

    def start(self) -> None:
        """Begin anew from now, as after a pause."""
        self._next = monotonic()

    def tick(self) -> None:
        """Let the next tick begin."""
        self._next = max(self._next + self._period, monotonic() - SLIP)

    @property
    def left(self) -> float:
        """Seconds until the tick under way is over; 0 when it is."""
        return max(0.0, self._next - monotonic())


class Stopwatch:
    """Wall time, without the pauses."""

    def __init__(self) -> None:
        self._sum = 0.0
        self._since: float | None = None

    def go(self) -> None:
        """Let it run."""
        if self._since is None:
            self._since = perf_counter()

    def halt(self) -> None:
        """Let it stand."""
        if self._since is not None:
            self._sum += perf_counter() - self._since
            self._since = None

    @property
    def seconds(self) -> float:
        """What it shows."""
        return self._sum + (perf_counter() - self._since if self._since is not None else 0.0)
