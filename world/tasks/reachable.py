"""Which places robots can be sent to, on the floor as it is."""

from collections.abc import Sequence
from math import inf
from typing import Final

from swarm.errors import PeerError
from swarm.geometry import distance
from swarm.maps.occupancy import OccupancyMap, Point
from swarm.scenario.check import explain_not_free
from swarm.settings import Settings
from swarm.traffic.lattice.cell_map import OUTSIDE, CellMap
from swarm.traffic.lattice.placement import comes_near, distance_to_stop, traffic_settings

TRIED: Final = 8  # cells around a target whose nearest place is looked at; each look is one more check of a target


class Reachable:
    """The places that robots can be sent to on one floor with its cells."""

    def __init__(self, settings: Settings, floor: OccupancyMap, cells: CellMap) -> None:
        self._settings, self._floor, self._cells = settings, floor, cells

    def check(self, name: str, here: Point, targets: Sequence[Point], first: int = 1) -> None:
        """Check that a robot at ``here`` [m] can come within ``reach`` of each target [m]; they count from ``first``.

        Raises:
            PeerError: a target is off the map, in or too near a wall, or has no way to it; the nearest place is named.
        """
        for number, there in enumerate(targets, start=first):
            if wrong := self.wrong(name, here, there):
                x, y = there
                best = self._nearest(here, there)
                do = f"the nearest place that it can reach is {best[0]:.2f},{best[1]:.2f}" if best else "move it"
                raise PeerError(f"{name}: target {number} at ({x:g}, {y:g}): {wrong}; {do}")

    def wrong(self, name: str, here: Point, there: Point) -> str:
        """Return what was expected of a target [m] and what came, "" if the robot at ``here`` [m] can come there."""
        if wrong := explain_not_free(self._floor, there):
            return wrong
        settings = self._settings
        if (short := distance_to_stop(self._cells, there, settings)) > settings.reach:
            how = "no place there to stand" if short == inf else f"it has to stay {short:.2f} m away from it"
            where = "at a wall or behind a corner"
            return f"expected a place that {name} comes within {settings.reach:g} m of, got one {where}: {how}"
        if not comes_near(self._cells, here, there, settings):
            return f"expected a place that {name} can reach, found no way"
        return ""

    def _nearest(self, here: Point, there: Point) -> Point | None:
        """Return the place [m] nearest to a target that a robot can reach, to the centimetre; None if there is none."""
        cells, room = self._cells, traffic_settings(self._settings).standing_room
        pieces = cells.pieces
        piece = pieces[cells.nearest_standable(*here)]
        if piece == OUTSIDE:
            return None
        stands = [cells.move_inside(cell, there, room) for cell in range(len(cells)) if pieces[cell] == piece]
        for x, y in sorted(stands, key=lambda stand: distance(stand, there))[:TRIED]:
            place = round(x, 2), round(y, 2)
            if not self.wrong("", here, place):
                return place
        return None
