"""What a robot knows of the others: the newest record of each, how far it was relayed, and if it is believable."""

from collections.abc import Collection, Iterable, Sequence
from itertools import chain
from math import hypot
from typing import Final, NamedTuple

from msgspec.structs import replace

from swarm.maps.occupancy import Disc
from swarm.messages.traffic import Record, Relayed, TrafficBroadcast
from swarm.traffic.lattice.cell_map import OUTSIDE, CellMap
from swarm.traffic.peers.relay import KnownRecord, RelayChooser
from swarm.traffic.peers.uncooperative import MuteBroadcast, Mutes
from swarm.traffic.settings import TrafficConstants

SKEW: Final = 20  # ticks by which clocks may differ before a record counts as from the future
MOST_CELLS: Final = 64  # cells in one record's lists
SILENCE: Final = 100  # ticks between two events about the same fault of the same robot
SLACK: Final = 0.5  # m; a robot that moved farther than it can drive by more than this has jumped
FOREVER: Final = 1 << 60  # ticks


class TrafficNote(NamedTuple):
    """Something to report: its kind, the robots concerned, and a sentence."""

    kind: str
    robots: tuple[str, ...]
    text: str


class LiveRecords(NamedTuple):
    """The robots that are not silent at a tick; valid until ``until`` if nothing new is heard."""

    tick: int
    until: int  # tick at which the first of them falls silent
    records: dict[str, Record]
    silent: dict[str, Record]  # of all other robots
    held: frozenset[int]  # cells that any of them holds
    listens: bool  # one of them does


NOBODY: Final = LiveRecords(0, -1, {}, {}, frozenset(), listens=False)


class PeerRecords:
    """Everything heard so far, merged: the newest stamp wins, however the record came."""

    def __init__(self, me: str, settings: TrafficConstants) -> None:
        self.me = me
        self.others: dict[str, Record] = {}  # in the order of their ids
        self._live = NOBODY
        self._news: list[Record] = []  # taken since ``others`` was made
        self._known: dict[str, KnownRecord] = {}
        self._direct: dict[str, int] = {}  # stamp of the last record heard from each robot itself
        self._told: dict[tuple[str, str], int] = {}
        self._woke = -1
        self._relaying = RelayChooser(settings)
        self.mutes = Mutes(settings)
        self._settings = settings

    def merge_broadcasts(
        self, tick: int, cells: CellMap, broadcasts: Iterable[TrafficBroadcast], mute: Iterable[MuteBroadcast] = ()
    ) -> list[TrafficNote]:
        """Merge the broadcasts heard; leave out records that cannot be true, and return an event for each."""
        had_mutes = bool(self.mutes)
        refused: list[TrafficNote] = []
        for broadcast in broadcasts:
            self._merge_broadcast(tick, cells, broadcast, refused)
        self.mutes.note_broadcasts(tick, mute, self._direct)
        surmises, new = self._has_records_before_sleep or had_mutes, len(self.others) != len(self._known)
        if new:
            self._known = dict(sorted(self._known.items()))
        if new or surmises:
            self.others = {robot: self._add_unheard_cells(known.record, tick) for robot, known in self._known.items()}
        else:
            self.others.update([(record.robot, record) for record in self._news])
        if self.mutes:
            mutes = self.mutes.records(tick, {robot: known.record for robot, known in self._known.items()}, cells)
            self.others = dict(sorted((self.others | mutes).items()))
        if self._news or surmises or self.mutes:
            self._news, self._live = [], NOBODY
        self._live = self._live_at(tick)
        return refused

    @property
    def _has_records_before_sleep(self) -> bool:
        """True if a record is from before the robot woke: what is concluded from it depends on the tick."""
        return self._woke > 0 and any(known.record.stamp < self._woke for known in self._known.values())

    def _live_at(self, tick: int) -> LiveRecords:
        if self._live.tick <= tick <= self._live.until:
            return self._live
        fresh, records, silent = self._settings.fresh, self.others, {}
        oldest = min([record.stamp for record in records.values()], default=FOREVER)
        if oldest < tick - fresh or self.mutes.names:
            heard = {robot: record for robot, record in self.others.items() if robot not in self.mutes.names}
            records = {robot: record for robot, record in heard.items() if record.stamp >= tick - fresh}
            silent = {robot: record for robot, record in self.others.items() if robot not in records}
            oldest = min([record.stamp for record in records.values()], default=FOREVER)
        theirs, until = records.values(), oldest + fresh
        held = frozenset(chain.from_iterable([record.held for record in (*theirs, *self._mute_records())]))
        return LiveRecords(tick, until, records, silent, held, listens=True in [record.listens for record in theirs])

    def _mute_records(self) -> list[Record]:
        """Return the records that stand for the mute robots heard lately."""
        return [self.others[robot] for robot in sorted(self.mutes.names)]

    def records_expected(self) -> Collection[Record]:
        """Return the records of robots that are where they say: all but mute ones that move."""
        moving = self.mutes.moving_robots if self.mutes.names else ()
        return (
            [record for robot, record in self.others.items() if robot not in moving] if moving else self.others.values()
        )

    def recent_records(self, tick: int) -> dict[str, Record]:
        """Return the records of all robots heard lately, mute ones too."""
        fresh, mutes = self.fresh_records(tick), self._mute_records()
        return fresh | {record.robot: record for record in mutes} if mutes else fresh

    def note_wake(self, tick: int) -> None:
        """Record that nothing was heard for a while before this tick."""
        self._woke = tick

    def _add_unheard_cells(self, record: Record, tick: int) -> Record:
        """Add to a silent robot's cells those it may have taken while I heard nothing: the next cells of its way."""
        if record.stamp >= self._woke or tick - record.stamp <= self._settings.fresh:
            return record
        further = record.ahead[: self._settings.horizon]
        return replace(record, held=(*further, *record.held)) if record.held else record

    def fresh_records(self, tick: int) -> dict[str, Record]:
        """Return the records of all robots that are not silent."""
        return self._live_at(tick).records

    def silent_records(self, tick: int) -> dict[str, Record]:
        """Return the records of all robots that are silent."""
        return self._live_at(tick).silent

    def somebody_listens(self, tick: int) -> bool:
        """Return True if a robot that is not silent has just started, and claims nothing yet."""
        return self._live_at(tick).listens

    def relay(self, tick: int, x: float, y: float) -> tuple[Relayed, ...]:
        """Choose the records to relay in this broadcast from a place [m], nearest robots first."""
        return self._relaying.choose(tick, x, y, self._known, listens=self.somebody_listens(tick))

    def cells_held_alone(self, held: Sequence[int], tick: int) -> tuple[int, ...]:
        """Return my cells without those that a live robot holds too: two robots may start in one cell."""
        theirs = self._live_at(tick).held
        return tuple(held) if theirs.isdisjoint(held) else tuple(cell for cell in held if cell not in theirs)

    def holder_bodies(self, cell: int, tick: int) -> tuple[Disc, ...]:
        """Return the bodies of live robots that hold a cell."""
        live = self._live_at(tick)
        if cell not in live.held:
            return ()
        holders = [record for record in live.records.values() if cell in record.held]
        return tuple([(record.x, record.y, self._settings.radius_of(record)) for record in holders])

    def _merge_broadcast(
        self, tick: int, cells: CellMap, broadcast: TrafficBroadcast, refused: list[TrafficNote]
    ) -> None:
        own = broadcast.own
        if own.robot == self.me:
            self._report_fault(tick, own.robot, "another robot uses my id", refused)
            return
        if own.stamp <= self._direct.get(own.robot, -1):
            self._report_fault(tick, own.robot, f"sent the record of tick {own.stamp} again", refused)
            return
        if own.stamp <= tick + SKEW:
            if own.stamp - self._direct.get(own.robot, -FOREVER) > self._settings.fresh:
                self._relaying.note_new_robot(tick)
            self._direct[own.robot] = own.stamp
        self._merge_record(tick, cells, own, 1, refused)
        most, latest, everybody = self._settings.hops, tick + SKEW, self._known
        for hops, record in broadcast.others:  # hundreds in a tick, if many robots are close together: mostly old news
            robot, stamp = record.robot, record.stamp
            if robot == self.me or hops > most:
                continue
            if stamp <= latest:
                self._relaying.hear(own.robot, record)
            known = everybody.get(robot)
            if known is None or (stamp >= known.record.stamp and (known.record is not record or hops + 1 < known.hops)):
                self._merge_record(tick, cells, record, hops + 1, refused)

    def _merge_record(self, tick: int, cells: CellMap, record: Record, hops: int, refused: list[TrafficNote]) -> None:
        known = self._known.get(record.robot)
        if known is not None:
            if record.stamp < known.record.stamp:
                return
            if record.stamp == known.record.stamp:
                if record is not known.record and record != known.record:
                    self._report_fault(tick, record.robot, f"two different records of tick {record.stamp}", refused)
                elif hops < known.hops:
                    self._known[record.robot] = known._replace(hops=hops)
                return
        fault = self._fault(tick, cells, record, known.record if known else None)
        if fault is None:
            self._known[record.robot] = KnownRecord(record, hops)
            self._news.append(record)
        else:
            self._report_fault(tick, record.robot, fault, refused)

    def _report_fault(self, tick: int, robot: str, fault: str, refused: list[TrafficNote]) -> None:
        key = (robot, fault.split(" of tick ")[0])
        if tick - self._told.get(key, -SILENCE) >= SILENCE:
            self._told[key] = tick
            refused.append(TrafficNote("refused", (robot,), f"dropped a record of {robot}: {fault}"))

    def _fault(self, tick: int, cells: CellMap, record: Record, before: Record | None) -> str | None:
        """Return why a record cannot be true, or None."""
        settings = self._settings
        if record.stamp > tick + SKEW:
            return "it is from the future"
        x, y = record.x, record.y
        if before is not None and (before.x, before.y, before.held, before.claims) == (
            x,
            y,
            record.held,
            record.claims,
        ):
            return None  # it stands, and its cells were checked before
        if (
            not 0.0 < settings.radius_of(record) <= cells.side / 2
            or not 0.0 < (record.top or settings.speed) <= settings.speed
        ):
            return "is wider than a cell, or faster than any robot of the fleet"
        mentioned = (*record.held, *[claim.cell for claim in record.claims])
        if len(mentioned) > MOST_CELLS or (mentioned and not 0 <= min(mentioned) <= max(mentioned) < len(cells)):
            return "holds or claims cells that are not there"
        farthest = max(settings.claim_radius, 2 * cells.side) + 2 * cells.side  # m
        for at_x, at_y in map(cells.centre, mentioned):
            if hypot(at_x - x, at_y - y) > farthest:
                return "holds or claims a cell far from where it is"
        if before is not None:
            driven = settings.speed * settings.tick * (record.stamp - before.stamp) + SLACK
            if hypot(before.x - x, before.y - y) > driven:
                return "jumped farther than a robot can drive"
        here = cells.cell_of(x, y)
        if here != OUTSIDE and here not in record.held:
            return "is in a cell that it does not hold"
        return None
