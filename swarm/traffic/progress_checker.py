"""How long a robot has made no progress: its way has not become shorter, or it is still at one place."""

from collections.abc import Callable
from functools import partial
from math import inf
from typing import Generic, TypeVar

from swarm.geometry import distance

Measure = TypeVar("Measure")


class ProgressChecker(Generic[Measure]):
    """Measures for how long a robot has made no progress, by a clock that the caller reads or counts.

    ``is_progress`` says of what was measured at the last progress, and of what is measured now, if there is progress.
    """

    def __init__(self, is_progress: Callable[[Measure, Measure], bool]) -> None:
        self._is_progress = is_progress
        self._then: Measure | None = None
        self._since = 0.0

    def check(self, now: Measure, clock: float) -> float:
        """Return how far the ``clock`` has gone on since the last progress."""
        if self._then is None or self._is_progress(self._then, now):
            self.restart(now, clock)
        return clock - self._since

    def restart(self, now: Measure, clock: float) -> None:
        """Measure from now on, because the robot has a reason to make no progress."""
        self._then, self._since = now, clock

    def forget(self) -> None:
        """Measure from the next check on."""
        self._then = None


def make_movement_test(radius: float) -> Callable[[tuple[float, ...], tuple[float, ...]], bool]:
    """Return the test of a robot that makes progress when it is more than ``radius`` [m] from where it was."""
    return partial(_has_moved, radius)


def make_way_length_test(longer: float = inf) -> Callable[[int, int], bool]:
    """Return the test of a robot that makes progress when fewer cells of its way are left.

    A way that is more than ``longer`` [cells] longer is another way, on which the count starts again.
    """
    return partial(_is_shorter, longer)


def _has_moved(radius: float, then: tuple[float, ...], now: tuple[float, ...]) -> bool:
    return distance(then, now) > radius


def _is_shorter(longer: float, fewest: int, left: int) -> bool:
    return not fewest <= left <= fewest + longer
