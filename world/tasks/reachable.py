"""Which places robots can be sent to, on the floor as it is."""

from collections.abc import Sequence
from math import inf
from typing import Final

from swarm.errors import PeerError
from swarm.geometry import distance
from swarm.maps.occupancy import FREE, OccupancyMap, Point
from swarm.scenario.check import NOWHERE, pieces
from swarm.settings import Settings
from swarm.traffic.lattice.cell_map import OUTSIDE, CellMap
from swarm.traffic.lattice.placement import comes_near, short_of, traffic_settings

TRIED: Final = 8  # cells around a target whose nearest place is looked at; each look is one more check of a target


class Reachable:
    """The check of an order's targets; what it computes of a floor is kept until the floor changes."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._cells: CellMap | None = None
        self._pieces: list[int] = []

    def check(
        self, name: str, here: Point, targets: Sequence[Point], floor: OccupancyMap, cells: CellMap, first: int = 1
    ) -> None:
        """Check that a robot at ``here`` [m] can come within ``reach`` of each target [m]; they count from ``first``.

        Raises:
            PeerError: a target is off the map, in or too near a wall, or has no way to it; the nearest place is named.
        """
        self._take(cells)
        for number, there in enumerate(targets, start=first):
            if wrong := self._wrong(name, here, there, floor, cells):
                x, y = there
                best = self._nearest(here, there, floor, cells)
                do = f"the nearest place that it can reach is {best[0]:.2f},{best[1]:.2f}" if best else "move it"
                raise PeerError(f"{name}: target {number} at ({x:g}, {y:g}): {wrong}; {do}")

    def leads(self, here: Point, there: Point, floor: OccupancyMap, cells: CellMap) -> bool:
        """Return True if a robot at ``here`` [m] can be sent to a target ``there`` [m]."""
        self._take(cells)
        return not self._wrong("", here, there, floor, cells)

    def _take(self, cells: CellMap) -> None:
        if self._cells is not cells:
            self._cells, self._pieces = cells, pieces(cells)

    def _wrong(self, name: str, here: Point, there: Point, floor: OccupancyMap, cells: CellMap) -> str:
        """Return what was expected of a target and what came, "" if the robot can come there."""
        settings = self._settings
        if wrong := not_free(floor, there):
            return wrong
        if (short := short_of(cells, there, settings)) > settings.reach:
            how = "no place there to stand" if short == inf else f"it has to stay {short:.2f} m away from it"
            where = "at a wall or at the corner of traffic cells"
            return f"expected a place that {name} comes within {settings.reach:g} m of, got one {where}: {how}"
        start, goal = cells.cell_of(*here), cells.cell_of(*there)
        joined = OUTSIDE not in {start, goal} and self._pieces[start] == self._pieces[goal] != NOWHERE
        if not joined and not comes_near(cells, here, there, settings):
            return f"expected a place that {name} can reach, found no way"
        return ""

    def _nearest(self, here: Point, there: Point, floor: OccupancyMap, cells: CellMap) -> Point | None:
        """Return the place [m] nearest to a target that a robot can reach, to the centimetre; None if there is none."""
        start = cells.nearest_standable(*here)
        piece, room = self._pieces[start], traffic_settings(self._settings).standing_room
        if piece == NOWHERE:
            return None
        stands = [
            cells.moved_inside(cell, there, room) for cell, number in enumerate(self._pieces[:-1]) if number == piece
        ]
        for x, y in sorted(stands, key=lambda stand: distance(stand, there))[:TRIED]:
            place = round(x, 2), round(y, 2)
            if not self._wrong("", here, place, floor, cells):
                return place
        return None


def not_free(floor: OccupancyMap, place: Point) -> str:
    """Return what was expected of a place [m] and what came, "" if it is free floor."""
    if not floor.inside(floor.cell_of(*place)):
        return "expected a place on the map, got one outside"
    return "" if floor.at(*place) == FREE else "expected free floor, got a wall or obstacle"
