"""The detection of robots that make no progress, from poses and stops alone, whatever the cause."""

from collections.abc import Sequence
from math import floor, inf
from typing import Final

from swarm.geometry import Pose
from world.measure.state import ProgressState

STALLED: Final = 60.0  # s without progress, with stops left; a slow queue takes less (benchmarks/traffic.py)
SQUARE: Final = 1.0  # m, side of a square of the floor
NOWHERE: Final = -1  # the stop of a robot before the first look


class ProgressWatch:
    """The progress of all robots, judged from their poses and next stops.

    A robot makes progress when its next stop changes, or when it enters a square of the floor for the first time since
    then. Standing still is no progress, and neither is driving back and forth.
    """

    def __init__(self, robots: int) -> None:
        self.state = ProgressState()
        for _ in range(robots):
            self.add_robot(0.0)

    def add_robot(self, time: float) -> None:
        """Judge one more robot from a time [s] on."""
        state = self.state
        state.times.append(0)
        state.longest.append(0.0)
        state.stop.append(NOWHERE)
        state.seen.append(set())
        state.since.append(time)
        state.stalled.append(False)

    def begin(self, robot: int, time: float) -> None:
        """Judge a robot from a time [s] on by other stops."""
        self.state.stop[robot], self.state.since[robot] = NOWHERE, time

    def look(self, time: float, poses: Sequence[Pose], stops: Sequence[int | None]) -> list[int]:
        """Return the numbers of the robots that begin to stall. ``stops`` is None for a robot with no stop left."""
        state, begun = self.state, []
        for number, (pose, stop) in enumerate(zip(poses, stops, strict=True)):
            square = floor(pose.x / SQUARE), floor(pose.y / SQUARE)
            seen = state.seen[number]
            if stop != state.stop[number]:
                seen.clear()
            if stop is None or square not in seen:
                seen.add(square)
                state.stop[number], state.since[number], state.stalled[number] = stop, time, False
                continue
            for_so_long = time - state.since[number]
            state.longest[number] = max(state.longest[number], for_so_long)
            if for_so_long >= STALLED and not state.stalled[number]:
                state.stalled[number] = True
                state.times[number] += 1
                begun.append(number)
        return begun

    def standing(self, time: float) -> list[float]:
        """Return how long [s] each robot has made no progress; infinite if it has no stop left."""
        state = self.state
        return [inf if stop is None else time - since for stop, since in zip(state.stop, state.since, strict=True)]
