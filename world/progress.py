"""Who gets nowhere: judged from poses and stops alone, whatever the cause is."""

from collections.abc import Sequence
from math import floor, inf
from typing import Final

from swarm.geometry import Pose

STALLED: Final = 60.0  # s without getting anywhere, with stops left: a slow queue takes less (benchmarks/traffic.py)
SQUARE: Final = 1.0  # m, side of a square of the floor
NOWHERE: Final = -1  # the stop of a robot that has not been looked at yet


class ProgressWatch:
    """Feeds on poses and on the stop each robot is under way to.

    A robot gets somewhere when its stop changes or when it enters a square of the floor where it has not been since
    then. So standing still counts as getting nowhere, and so does driving to and fro.
    """

    def __init__(self, robots: int) -> None:
        self.times = [0] * robots  # how often each has stalled
        self.longest = [0.0] * robots  # s, that each has got nowhere at a stretch
        self._stop: list[int | None] = [NOWHERE] * robots
        self._seen: list[set[tuple[int, int]]] = [set() for _ in range(robots)]
        self._since = [0.0] * robots
        self._stalled = [False] * robots

    def look(self, time: float, poses: Sequence[Pose], stops: Sequence[int | None]) -> list[int]:
        """Return the numbers of the robots that stall from now on. ``stops`` is None for who has none left."""
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
        """Return for how long [s] each robot has got nowhere; infinite where it has no stop left."""
        return [inf if stop is None else time - since for stop, since in zip(self._stop, self._since, strict=True)]
