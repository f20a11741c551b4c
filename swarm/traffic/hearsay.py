"""What a robot knows of the others: the newest record of each, by how many hops, and whether it can be believed."""

from collections.abc import Iterable, Iterator, Sequence
from itertools import chain
from math import hypot
from typing import NamedTuple

from msgspec.structs import replace

from swarm.maps.occupancy import Point
from swarm.traffic.cells import OUTSIDE, CellMap
from swarm.traffic.record import Record, Relayed, TrafficBroadcast
from swarm.traffic.settings import TrafficSettings

SKEW = 20  # ticks; clocks may differ by so much before a record counts as from the future
MOST_CELLS = 64  # cells in one record's lists
SILENCE = 100  # ticks between two events about the same fault of the same robot
OLD_NEWS = 8  # broadcasts, of which one passes on the records of robots long silent
SLACK = 0.5  # m; a jump is more than this beyond what a robot can drive


class Event(NamedTuple):
    """Something worth a line: what kind, about whom, and a sentence."""

    kind: str
    robots: tuple[str, ...]
    text: str


class Known(NamedTuple):
    """The newest record of a robot."""

    record: Record
    hops: int  # 1: heard from itself


class Live(NamedTuple):
    """Those who are not silent at a tick."""

    tick: int
    records: dict[str, Record]
    held: frozenset[int]  # cells that any of them holds


class Hearsay:
    """Everything heard so far, merged: the newest stamp wins, whichever way it came."""

    def __init__(self, me: str, cells: CellMap, settings: TrafficSettings) -> None:
        self.me = me
        self.others: dict[str, Record] = {}  # in the order of their ids
        self._live = Live(-1, {}, frozenset())  # of the tick heard last
        self._known: dict[str, Known] = {}
        self._direct: dict[str, int] = {}  # stamp of the last record heard from each itself
        self._told: dict[tuple[str, str], int] = {}
        self._woke = -1
        self.cells = cells
        self._settings = settings

    def hear(self, tick: int, broadcasts: Iterable[TrafficBroadcast]) -> list[Event]:
        """Merge what came in; what cannot be true is left out, and named."""
        refused = [event for broadcast in broadcasts for event in self._hear_one(tick, broadcast)]
        if len(self.others) != len(self._known):
            self._known = dict(sorted(self._known.items()))
        self.others = {robot: self._as_known(known.record, tick) for robot, known in self._known.items()}
        self._live = self._live_at(tick)
        return refused

    def _live_at(self, tick: int) -> Live:
        oldest = tick - self._settings.fresh
        records = {robot: record for robot, record in self.others.items() if record.stamp >= oldest}
        return Live(tick, records, frozenset(chain.from_iterable([record.held for record in records.values()])))

    def wake(self, tick: int) -> None:
        """Note that nothing was heard for a while before now."""
        self._woke = tick

    def _as_known(self, record: Record, tick: int) -> Record:
        """Add to a silent robot's holds what it may have taken while I heard nothing: the next cells of its way."""
        if record.stamp >= self._woke or tick - record.stamp <= self._settings.fresh:
            return record
        further = record.ahead[: self._settings.horizon]
        return replace(record, held=(*further, *record.held)) if record.held else record

    def silent(self, robot: str, tick: int) -> bool:
        """Tell whether a robot has said nothing, as far as known, for so long that it cannot be asked."""
        return tick - self._known[robot].record.stamp > self._settings.fresh

    def fresh(self, tick: int) -> dict[str, Record]:
        """Give the records of all that are not silent."""
        return (self._live if self._live.tick == tick else self._live_at(tick)).records

    def passed_on(self, tick: int, x: float, y: float) -> tuple[Relayed, ...]:
        """Choose the records to pass on: nearest first, none that came too far.

        Old ones, of robots long silent, go out now and then, and at once where somebody listens: who comes new has to
        know of the dead.
        """
        settings = self._settings
        listens = any(record.listens for record in self.fresh(tick).values())
        oldest = -1 if listens or tick // settings.every % OLD_NEWS == 0 else tick - settings.keep
        worth = [
            (hypot(known.record.x - x, known.record.y - y), robot, known)
            for robot, known in self._known.items()
            if known.hops <= settings.hops and known.record.stamp >= oldest
        ]
        return tuple(Relayed(known.hops, known.record) for _, _, known in sorted(worth)[: settings.relayed])

    def alone_in(self, held: Sequence[int], tick: int) -> tuple[int, ...]:
        """Leave out of my cells what a live robot holds too, as at a start where two stand in the corners of one."""
        theirs = (self._live if self._live.tick == tick else self._live_at(tick)).held
        return tuple(held) if theirs.isdisjoint(held) else tuple(cell for cell in held if cell not in theirs)

    def holders_of(self, cell: int, tick: int) -> tuple[Point, ...]:
        """List where live robots are that hold a cell [m]."""
        return tuple((record.x, record.y) for record in self.fresh(tick).values() if cell in record.held)

    def _hear_one(self, tick: int, broadcast: TrafficBroadcast) -> Iterator[Event]:
        own = broadcast.own
        if own.robot == self.me:
            yield from self._name(tick, own.robot, "another robot goes by my id")
            return
        if own.stamp <= self._direct.get(own.robot, -1):
            yield from self._name(tick, own.robot, f"sent the record of tick {own.stamp} again")
            return
        if own.stamp <= tick + SKEW:
            self._direct[own.robot] = own.stamp
        yield from self._merge(tick, own, 1)
        for hops, record in broadcast.others:
            if record.robot != self.me and hops <= self._settings.hops:
                known = self._known.get(record.robot)
                if known is None or known.record is not record or hops + 1 < known.hops:
                    yield from self._merge(tick, record, hops + 1)

    def _merge(self, tick: int, record: Record, hops: int) -> Iterator[Event]:
        known = self._known.get(record.robot)
        if known is not None:
            if record.stamp < known.record.stamp:
                return
            if record.stamp == known.record.stamp:
                if record is not known.record and record != known.record:
                    yield from self._name(tick, record.robot, f"two different records of tick {record.stamp}")
                elif hops < known.hops:
                    self._known[record.robot] = known._replace(hops=hops)
                return
        fault = self._fault(tick, record, known.record if known else None)
        if fault is None:
            self._known[record.robot] = Known(record, hops)
        else:
            yield from self._name(tick, record.robot, fault)

    def _name(self, tick: int, robot: str, fault: str) -> Iterator[Event]:
        key = (robot, fault.split(" of tick ")[0])
        if tick - self._told.get(key, -SILENCE) >= SILENCE:
            self._told[key] = tick
            yield Event("refused", (robot,), f"{robot}: {fault}; its record was dropped")

    def _fault(self, tick: int, record: Record, before: Record | None) -> str | None:
        """Say why a record cannot be true, if so."""
        settings, cells = self._settings, self.cells
        if record.stamp > tick + SKEW:
            return "a record from the future"
        mentioned = (*record.held, *[claim.cell for claim in record.claims])
        if len(mentioned) > MOST_CELLS or (mentioned and not 0 <= min(mentioned) <= max(mentioned) < len(cells)):
            return "holds or claims cells that are not there"
        at = (record.x, record.y)
        reach = max(settings.claim_radius, 2 * cells.side) + 2 * cells.side
        for cell in mentioned:
            if _far(cells.centre(cell), at, reach):
                return "holds or claims a cell far from where it is"
        if before is not None:
            driven = settings.speed * settings.tick * (record.stamp - before.stamp) + SLACK
            if _far((before.x, before.y), at, driven):
                return "jumped farther than a robot can drive"
        here = cells.cell_of(*at)
        if here != OUTSIDE and here not in record.held:
            return "is in a cell that it does not hold"
        return None


def _far(a: tuple[float, float], b: tuple[float, float], reach: float) -> bool:
    return hypot(a[0] - b[0], a[1] - b[1]) > reach
