"""What robots have seen in cells and tell each other: unexpected bodies, and empty cells of silent robots."""

from collections.abc import Iterable, Mapping

from swarm.messages.traffic import Notice, Record, Sighting
from swarm.traffic.settings import TrafficConstants

Cleared = frozenset[tuple[str, int]]  # (silent robot, cell that was seen empty since it spoke last)


class Sightings:
    """The newest sighting of each cell, the robot's own and those heard."""

    def __init__(self, settings: TrafficConstants) -> None:
        self._settings = settings
        self._newest: dict[int, Sighting] = {}
        self._cleared: Cleared = frozenset()

    def note(self, cell: int, *, empty: bool, tick: int) -> None:
        """Record what the robot has seen itself."""
        self._newest[cell] = Sighting(cell, empty, tick)

    def hear(self, tick: int, records: Iterable[Record]) -> None:
        """Take over newer sightings of others, and forget those that are too old."""
        for record in records:
            for sighting in record.seen:
                known = self._newest.get(sighting.cell)
                if sighting.tick <= tick and (known is None or sighting.tick > known.tick):
                    self._newest[sighting.cell] = sighting
        if self._newest:
            self._newest = {cell: one for cell, one in self._newest.items() if tick - one.tick < self._lasts(one)}

    def occupied(self) -> frozenset[int]:
        """Return the cells in which an unexpected body stands."""
        return frozenset([cell for cell, sighting in self._newest.items() if not sighting.empty])

    def clear(self, others: Mapping[str, Record], fresh: Mapping[str, Record]) -> Cleared:
        """Clear the cells of silent robots that were seen empty after the robot spoke last; return all cleared cells.

        Such a cell stays cleared until its robot is heard again.
        """
        if not self._newest and not self._cleared:
            return self._cleared
        kept = {pair for pair in self._cleared if pair[0] not in fresh}
        empty = [sighting for sighting in self._newest.values() if sighting.empty]
        if empty:
            kept |= {
                (robot, sighting.cell)
                for robot, record in others.items()
                if robot not in fresh
                for sighting in empty
                if sighting.tick > record.stamp and keeps(record, sighting.cell)
            }
        self._cleared = frozenset(kept)
        return self._cleared

    def told(self) -> tuple[Sighting, ...]:
        """Return the sightings to tell others, newest first."""
        if not self._newest:
            return ()
        newest = sorted(self._newest.values(), key=lambda one: (-one.tick, one.cell))
        return tuple(newest[: self._settings.sightings])

    def _lasts(self, sighting: Sighting) -> int:
        return self._settings.emptied if sighting.empty else self._settings.obstacle


def keeps(record: Notice, cell: int) -> bool:
    """Return True if a robot holds or claims a cell."""
    return cell in record.held or cell in [claim.cell for claim in record.claims]
