"""The receiver of a process: it subscribes to the zones around its robots, and each hears what the radio model allows.

The floor is cut into square zones of the radio's range. A robot needs its own zone and the eight around it. So a
process subscribes to a neighbour before that comes into range, and traffic does not grow as the square of the fleet.
"""

from collections import Counter
from collections.abc import Iterable
from math import floor
from typing import Final

from swarm.bus import Bus
from swarm.messages import RADIO, Broadcast

Pair = tuple[str, int]  # a robot and the tick of its broadcast
Zone = tuple[int, int]
PATIENCE: Final = 40  # ticks for which a broadcast and the sense that lists it wait for each other, in real time


def zone_of(x: float, y: float, side: float) -> Zone:
    """Return the zone of a point [m]; ``side`` [m] is that of a zone."""
    return floor(x / side), floor(y / side)


def zones_around(here: Zone) -> set[Zone]:
    """Return a zone and the eight around it."""
    return {(here[0] + dx, here[1] + dy) for dx in (-1, 0, 1) for dy in (-1, 0, 1)}


class Radio:
    """The broadcasts that arrived at a process, and the zones that it subscribes to for its robots."""

    def __init__(self, bus: Bus) -> None:
        self.arrived: dict[Pair, Broadcast] = {}
        self._bus = bus
        self._near: Counter[Zone] = Counter()  # robots of this process that need a zone
        self._run = 0
        self._room = 4 * PATIENCE  # broadcasts; if there are more, old ones are dropped

    def move(self, old: set[Zone], new: set[Zone]) -> None:
        """Subscribe to zones that a robot needs now; end the subscriptions that no robot needs any more."""
        for zx, zy in sorted(new - old):
            self._near[zx, zy] += 1
            if self._near[zx, zy] == 1:
                self._bus.listen(RADIO, quiet=True, zx=zx, zy=zy)
        for zx, zy in sorted(old - new):
            self._near[zx, zy] -= 1
            if self._near[zx, zy] == 0:
                del self._near[zx, zy]
                self._bus.unlisten(RADIO, zx=zx, zy=zy)

    def take(self, broadcast: Broadcast) -> None:
        """Store a broadcast unless it belongs to an earlier run."""
        if broadcast.run >= self._run:
            self.arrived[broadcast.robot, broadcast.tick] = broadcast

    def begin(self, run: int) -> None:
        """Drop the broadcasts of earlier runs; keep those of this run, which may have come before the first sense."""
        self._run = run
        self.arrived = {pair: b for pair, b in self.arrived.items() if b.run >= run}

    def forget(self, now: int) -> None:
        """Drop broadcasts that are too far from this tick, if there are many."""
        if len(self.arrived) > self._room:
            self.arrived = {pair: b for pair, b in self.arrived.items() if abs(pair[1] - now) <= PATIENCE}
            self._room = max(4 * PATIENCE, 5 * len(self.arrived) // 4)


class Receiver:
    """What one robot hears of the broadcasts that arrived at its process."""

    def __init__(self, radio: Radio, reach: float) -> None:
        self._radio = radio
        self._side = reach
        self._here: Zone | None = None
        self._zones: set[Zone] = set()
        self._granted: set[Pair] = set()  # listed by a sense, and not heard yet
        self._heard: set[Pair] = set()

    def tune(self, x: float, y: float) -> Zone:
        """Receive the zones around a point [m] and return the zone of the point."""
        here = zone_of(x, y, self._side)
        if here != self._here:
            self._here = here
            self._move(zones_around(here))
        return here

    def close(self) -> None:
        """Receive nothing any more."""
        self._move(set())

    def misses_broadcast(self, hears: Iterable[Pair]) -> bool:
        """Return True if a broadcast that the sense lists has not arrived yet."""
        return any(pair not in self._radio.arrived for pair in hears)

    def listed_broadcasts(self, hears: Iterable[Pair], now: int) -> list[Broadcast]:
        """Return the broadcasts that the sense lists, in its order (lockstep)."""
        arrived = self._radio.arrived
        heard = [arrived[pair] for pair in hears if pair in arrived]
        self._forget(now)
        return heard

    def what_came(self, hears: Iterable[Pair], now: int) -> list[Broadcast]:
        """Return the broadcasts that this or an earlier sense lists and that are new, oldest first (real time)."""
        arrived = self._radio.arrived
        self._granted.update(pair for pair in hears if pair not in self._heard)
        new = {pair for pair in self._granted if pair in arrived}
        self._granted -= new
        self._heard |= new
        self._forget(now)
        return [arrived[pair] for pair in sorted(new, key=lambda pair: (pair[1], pair[0]))]

    def begin(self, run: int) -> None:
        """Begin a run: nothing of it has been heard."""
        self._radio.begin(run)
        self._granted.clear()
        self._heard.clear()

    def _move(self, zones: set[Zone]) -> None:
        self._radio.move(self._zones, zones)
        self._zones = zones

    def _forget(self, now: int) -> None:
        oldest = now - PATIENCE
        self._radio.forget(now)
        self._granted = {pair for pair in self._granted if pair[1] >= oldest}
        self._heard = {pair for pair in self._heard if pair[1] >= oldest}
