"""A robot's receiver: it subscribes to the zones around the robot and hears what the radio model lets it hear.

The floor is cut into square zones of the radio's range. A robot subscribes to its own zone and the eight around it.
So it subscribes to a neighbour before that comes into range, and traffic does not grow as the square of the fleet.
"""

from collections.abc import Iterable
from math import floor
from typing import Final

from swarm.bus import Bus
from swarm.messages import RADIO, Broadcast

Pair = tuple[str, int]  # a robot and the tick of its broadcast
PATIENCE: Final = 40  # ticks for which a broadcast and the sense that lists it wait for each other, in real time


def zone(x: float, y: float, side: float) -> tuple[int, int]:
    """Return the zone of a point [m]; ``side`` [m] is that of a zone."""
    return floor(x / side), floor(y / side)


class Radio:
    """Broadcasts that arrived, until the world says that this robot hears them."""

    def __init__(self, bus: Bus, reach: float) -> None:
        self._bus = bus
        self._side = reach
        self._zones: set[tuple[int, int]] = set()
        self._arrived: dict[Pair, Broadcast] = {}
        self._granted: set[Pair] = set()
        self._run = 0

    def tune(self, x: float, y: float) -> tuple[int, int]:
        """Subscribe to the zones around a point [m] and return the zone of the point."""
        here = zone(x, y, self._side)
        wanted = {(here[0] + dx, here[1] + dy) for dx in (-1, 0, 1) for dy in (-1, 0, 1)}
        for zx, zy in sorted(wanted - self._zones):
            self._bus.listen(RADIO, quiet=True, zx=zx, zy=zy)
        for zx, zy in sorted(self._zones - wanted):
            self._bus.unlisten(RADIO, zx=zx, zy=zy)
        self._zones = wanted
        return here

    def take(self, broadcast: Broadcast) -> None:
        """Store a broadcast unless it belongs to an earlier run."""
        if broadcast.run >= self._run:
            self._arrived[broadcast.robot, broadcast.tick] = broadcast

    def lacks(self, hears: Iterable[Pair]) -> bool:
        """Return True if a broadcast that the sense lists has not arrived yet."""
        return any(pair not in self._arrived for pair in hears)

    def exactly(self, hears: Iterable[Pair], now: int) -> list[Broadcast]:
        """Return the broadcasts that the sense lists, in its order (lockstep)."""
        heard = [self._arrived[pair] for pair in hears if pair in self._arrived]
        self._forget(now)
        return heard

    def what_came(self, hears: Iterable[Pair], now: int) -> list[Broadcast]:
        """Return the broadcasts that this or an earlier sense lists and that are new, oldest first (real time)."""
        self._granted.update(hears)
        both = sorted((tick, robot) for robot, tick in self._granted if (robot, tick) in self._arrived)
        heard = [self._arrived.pop((robot, tick)) for tick, robot in both]
        self._granted.difference_update((robot, tick) for tick, robot in both)
        self._forget(now)
        return heard

    def begin(self, run: int) -> None:
        """Drop the broadcasts of earlier runs; keep those of this run, which may have come before the first sense."""
        self._run = run
        self._arrived = {pair: b for pair, b in self._arrived.items() if b.run >= run}
        self._granted.clear()

    def _forget(self, now: int) -> None:
        oldest = now - PATIENCE
        if len(self._arrived) > 4 * PATIENCE:
            self._arrived = {pair: b for pair, b in self._arrived.items() if oldest <= pair[1] <= now}
        self._granted = {pair for pair in self._granted if pair[1] >= oldest}
