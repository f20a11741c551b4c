"""Which places robots can be sent to, on the floor as it is."""

from collections.abc import Sequence
from math import inf
from typing import Final

from swarm.errors import PeerError
from swarm.geometry import distance
from swarm.maps.occupancy import OccupancyMap, Point
from swarm.scenario.check import explain_not_free
from swarm.traffic.lattice.cell_map import OUTSIDE, CellMap
from swarm.traffic.lattice.placement import comes_near, distance_to_stop, traffic_settings
from world.bodies.roster import Roster

TRIED: Final = 8  # cells around a target whose nearest place is looked at; each look is one more check of a target


class Reachable:
    """The places that robots can be sent to on one floor, robots by their numbers."""

    def __init__(self, roster: Roster, floor: OccupancyMap) -> None:
        self._roster, self._floor = roster, floor

    def check(self, robot: int, here: Point, targets: Sequence[Point], first: int = 1) -> None:
        """Check that a robot at ``here`` [m] can come within ``reach`` of each target [m]; they count from ``first``.

        Raises:
            PeerError: a target is off the map, in or too near a wall, or has no way to it; the nearest place is named.
        """
        for number, there in enumerate(targets, start=first):
            if wrong := self.wrong(robot, here, there):
                x, y = there
                best = self._nearest(robot, here, there)
                do = f"the nearest place that it can reach is {best[0]:.2f},{best[1]:.2f}" if best else "move it"
                raise PeerError(f"{self._roster.names[robot]}: target {number} at ({x:g}, {y:g}): {wrong}; {do}")

    def wrong(self, robot: int, here: Point, there: Point) -> str:
        """Return what was expected of a target [m] and what came, "" if the robot at ``here`` [m] can come there."""
        if wrong := explain_not_free(self._floor, there):
            return wrong
        name, settings, cells = self._roster.names[robot], self._roster.settings(robot), self._cells(robot)
        if (short := distance_to_stop(cells, there, settings)) > settings.reach:
            how = "no place there to stand" if short == inf else f"it has to stay {short:.2f} m away from it"
            where = "at a wall or behind a corner"
            return f"expected a place that {name} comes within {settings.reach:g} m of, got one {where}: {how}"
        if not comes_near(cells, here, there, settings):
            return f"expected a place that {name} can reach, found no way"
        return ""

    def _cells(self, robot: int) -> CellMap:
        return self._roster.cells(self._floor, robot)

    def _nearest(self, robot: int, here: Point, there: Point) -> Point | None:
        """Return the place [m] nearest to a target that a robot can reach, to the centimetre; None if there is none."""
        cells, room = self._cells(robot), traffic_settings(self._roster.settings(robot)).standing_room
        pieces = cells.pieces
        piece = pieces[cells.nearest_standable(*here)]
        if piece == OUTSIDE:
            return None
        stands = [cells.move_inside(cell, there, room) for cell in range(len(cells)) if pieces[cell] == piece]
        for x, y in sorted(stands, key=lambda stand: distance(stand, there))[:TRIED]:
            place = round(x, 2), round(y, 2)
            if not self.wrong(robot, here, place):
                return place
        return None
