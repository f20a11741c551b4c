"""The detection of robots that make no progress, from poses and stops alone, whatever the cause."""

from collections.abc import Sequence
from math import floor, inf
from typing import Final, NamedTuple

from swarm.geometry import Pose

STALLED: Final = 60.0  # s without progress, with stops left; a slow queue takes less (benchmarks/traffic.py)
SQUARE: Final = 1.0  # m, side of a square of the floor
NOWHERE: Final = -1  # the stop of a robot before the first look


class ProgressState(NamedTuple):
    """The state of `ProgressWatch`."""

    times: list[int]
    longest: list[float]
    stop: list[int | None]
    seen: list[set[tuple[int, int]]]
    since: list[float]
    stalled: list[bool]


class ProgressWatch:
    """The progress of all robots, judged from their poses and next stops.

    A robot makes progress when its next stop changes, or when it enters a square of the floor for the first time since
    then. Standing still is no progress, and neither is driving back and forth.
    """

    def __init__(self, robots: int) -> None:
        self.times: list[int] = []  # how often each has stalled
        self.longest: list[float] = []  # s, longest time without progress
        self._stop: list[int | None] = []
        self._seen: list[set[tuple[int, int]]] = []
        self._since: list[float] = []
        self._stalled: list[bool] = []
        for _ in range(robots):
            self.add_robot(0.0)

    @property
    def state(self) -> ProgressState:
        """The state, which shares its values with this object."""
        return ProgressState(self.times, self.longest, self._stop, self._seen, self._since, self._stalled)

    def restore(self, state: ProgressState) -> None:
        """Continue from a state."""
        self.times, self.longest, self._stop, self._seen, self._since, self._stalled = state

    def add_robot(self, time: float) -> None:
        """Judge one more robot from a time [s] on."""
        self.times.append(0)
        self.longest.append(0.0)
        self._stop.append(NOWHERE)
        self._seen.append(set())
        self._since.append(time)
        self._stalled.append(False)

    def begin(self, robot: int, time: float) -> None:
        """Judge a robot from a time [s] on by other stops."""
        self._stop[robot], self._since[robot] = NOWHERE, time

    def look(self, time: float, poses: Sequence[Pose], stops: Sequence[int | None]) -> list[int]:
        """Return the numbers of the robots that begin to stall. ``stops`` is None for a robot with no stop left."""
        begun = []
        for number, (pose, stop) in enumerate(zip(poses, stops, strict=True)):
            square = floor(pose.x / SQUARE), floor(pose.y / SQUARE)
            seen = self._seen[number]
            if stop != self._stop[number]:
                seen.clear()
            if stop is None or square not in seen:
                seen.add(square)
                self._stop[number], self._since[number], self._stalled[number] = stop, time, False
                continue
            for_so_long = time - self._since[number]
            self.longest[number] = max(self.longest[number], for_so_long)
            if for_so_long >= STALLED and not self._stalled[number]:
                self._stalled[number] = True
                self.times[number] += 1
                begun.append(number)
        return begun

    def standing(self, time: float) -> list[float]:
        """Return how long [s] each robot has made no progress; infinite if it has no stop left."""
        return [inf if stop is None else time - since for stop, since in zip(self._stop, self._since, strict=True)]
