"""What robots have seen in cells and tell each other: unexpected bodies, and empty cells of silent robots."""

from collections.abc import Iterable, Mapping
from typing import Final

from swarm.messages.traffic import Notice, Record, Sighting
from swarm.traffic.settings import TrafficConstants

Cleared = frozenset[tuple[str, int]]  # (silent robot, cell that was seen empty since it spoke last)

NOTHING_CLEARED: Final[Cleared] = frozenset()


class Sightings:
    """The newest sighting of each cell, the robot's own and those heard."""

    def __init__(self, settings: TrafficConstants) -> None:
        self._settings = settings
        self._newest: dict[int, Sighting] = {}
        self._cleared: dict[tuple[str, int], int] = {}  # silent robot and cell, tick at which the cell was seen empty

    def note(self, cell: int, *, empty: bool, tick: int) -> None:
        """Record what the robot has seen itself."""
        self._newest[cell] = Sighting(cell, empty, tick)

    def merge_sightings(self, tick: int, records: Iterable[Record]) -> None:
        """Take over newer sightings of others, and forget those that are too old."""
        for record in records:
            for sighting in record.seen:
                known = self._newest.get(sighting.cell)
                if sighting.tick <= tick and (known is None or sighting.tick > known.tick):
                    self._newest[sighting.cell] = sighting
        if self._newest:
            self._newest = {cell: one for cell, one in self._newest.items() if tick - one.tick < self._lifetime(one)}

    def occupied_cells(self) -> frozenset[int]:
        """Return the cells in which an unexpected body stands."""
        return frozenset([cell for cell, sighting in self._newest.items() if not sighting.empty])

    def clear(self, others: Mapping[str, Record], fresh: Mapping[str, Record]) -> Cleared:
        """Clear the cells of silent robots that were seen empty after the robot spoke last; return all cleared cells.

        Such a cell stays cleared until a newer record of its robot comes, from itself or from another one.
        """
        if not self._newest and not self._cleared:
            return NOTHING_CLEARED
        kept = {
            pair: seen
            for pair, seen in self._cleared.items()
            if pair[0] not in fresh and (pair[0] not in others or others[pair[0]].stamp < seen)
        }
        kept |= {
            (robot, sighting.cell): sighting.tick
            for sighting in self._newest.values()
            if sighting.empty
            for robot, record in others.items()
            if robot not in fresh and sighting.tick > record.stamp and has_reserved(record, sighting.cell)
        }
        self._cleared = kept
        return frozenset(kept)

    def sightings_to_tell(self) -> tuple[Sighting, ...]:
        """Return the sightings to tell others, newest first."""
        if not self._newest:
            return ()
        newest = sorted(self._newest.values(), key=lambda one: (-one.tick, one.cell))
        return tuple(newest[: self._settings.sightings])

    def _lifetime(self, sighting: Sighting) -> int:
        return self._settings.emptied if sighting.empty else self._settings.obstacle


def has_reserved(record: Notice, cell: int) -> bool:
    """Return True if a robot holds or claims a cell."""
    return cell in record.held or cell in [claim.cell for claim in record.claims]
