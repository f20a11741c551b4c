"""A robot's ear: it subscribes to the zones around it, and hears just those whom the radio model lets it hear.

The floor is cut into square zones of the radio's range; a robot listens to its own and the eight around it, so that a
neighbour is always subscribed to before it comes into range, and traffic does not grow as the square of the fleet.
"""

from collections.abc import Iterable
from math import floor
from typing import Final

from swarm.bus import Bus
from swarm.messages import RADIO, Broadcast

Pair = tuple[str, int]  # a robot and the tick of its broadcast
PATIENCE: Final = 40  # ticks that a broadcast and the word that it was heard wait for each other, in real time


def zone(x: float, y: float, side: float) -> tuple[int, int]:
    """Find the zone a point lies in."""
    return floor(x / side), floor(y / side)


class Radio:
    """What arrives on the radio's keys, until the world says who heard it."""

    def __init__(self, bus: Bus, reach: float) -> None:
        self._bus = bus
        self._side = reach
        self._zones: set[tuple[int, int]] = set()
        self._arrived: dict[Pair, Broadcast] = {}
        self._granted: set[Pair] = set()
        self._run = 0

    def tune(self, x: float, y: float) -> tuple[int, int]:
        """Listen around a point, and give its zone."""
        here = zone(x, y, self._side)
        wanted = {(here[0] + dx, here[1] + dy) for dx in (-1, 0, 1) for dy in (-1, 0, 1)}
        for zx, zy in sorted(wanted - self._zones):
            self._bus.listen(RADIO, quiet=True, zx=zx, zy=zy)
        for zx, zy in sorted(self._zones - wanted):
            self._bus.unlisten(RADIO, zx=zx, zy=zy)
        self._zones = wanted
        return here

    def take(self, broadcast: Broadcast) -> None:
        """Keep what arrived, unless it is of a run that is over."""
        if broadcast.run >= self._run:
            self._arrived[broadcast.robot, broadcast.tick] = broadcast

    def lacks(self, hears: Iterable[Pair]) -> bool:
        """Return True if something that was heard has not arrived yet."""
        return any(pair not in self._arrived for pair in hears)

    def exactly(self, hears: Iterable[Pair], now: int) -> list[Broadcast]:
        """Return what was heard at this tick, in the world's order: lockstep."""
        heard = [self._arrived[pair] for pair in hears if pair in self._arrived]
        self._forget(now)
        return heard

    def what_came(self, hears: Iterable[Pair], now: int) -> list[Broadcast]:
        """Return what was heard at this tick or a little earlier and has arrived by now, oldest first: real time."""
        self._granted.update(hears)
        both = sorted((tick, robot) for robot, tick in self._granted if (robot, tick) in self._arrived)
        heard = [self._arrived.pop((robot, tick)) for tick, robot in both]
        self._granted.difference_update((robot, tick) for tick, robot in both)
        self._forget(now)
        return heard

    def begin(self, run: int) -> None:
        """Forget all runs before this one; others may have spoken in it already."""
        self._run = run
        self._arrived = {pair: b for pair, b in self._arrived.items() if b.run >= run}
        self._granted.clear()

    def _forget(self, now: int) -> None:
        oldest = now - PATIENCE
        if len(self._arrived) > 4 * PATIENCE:
            self._arrived = {pair: b for pair, b in self._arrived.items() if oldest <= pair[1] <= now}
        self._granted = {pair for pair in self._granted if pair[1] >= oldest}
