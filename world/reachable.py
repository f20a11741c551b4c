"""Which places robots can be sent to, on the floor as it is."""

from collections.abc import Sequence

from swarm.errors import PeerError
from swarm.maps.occupancy import FREE, OccupancyMap, Point
from swarm.scenario.check import NOWHERE, pieces
from swarm.settings import Settings
from swarm.traffic.cells import OUTSIDE, CellMap
from swarm.traffic.cells_of import comes_near, short_of


class Reachable:
    """The check of an order's targets; what it computes of a floor is kept until the floor changes."""

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._cells: CellMap | None = None
        self._pieces: list[int] = []

    def check(
        self, name: str, here: Point, targets: Sequence[Point], floor: OccupancyMap, cells: CellMap, first: int = 1
    ) -> None:
        """Check that a robot at ``here`` [m] can come within ``reach`` of every target [m]; they count from ``first``.

        Raises:
            PeerError: a target is off the map, in or too near a wall, or no way over cells leads there.
        """
        settings = self._settings
        if self._cells is not cells:
            self._cells, self._pieces = cells, pieces(cells)
        for number, there in enumerate(targets, start=first):
            where = f"{name}: target {number} at ({there[0]:g}, {there[1]:g})"
            if not floor.inside(floor.cell_of(*there)):
                raise PeerError(f"{where}: expected a place on the map, got one outside; move it")
            if floor.at(*there) != FREE:
                raise PeerError(f"{where}: expected free floor, got a wall or obstacle; move it")
            if (short := short_of(cells, there, settings)) > settings.reach:
                raise PeerError(
                    f"{where}: expected a place that is reached within {settings.reach:g} m from inside a cell, the "
                    f"nearest is {short:.2f} m off; move it away from walls"
                )
            start, goal = cells.cell_of(*here), cells.cell_of(*there)
            joined = OUTSIDE not in {start, goal} and self._pieces[start] == self._pieces[goal] != NOWHERE
            if not joined and not comes_near(cells, here, there, settings):
                raise PeerError(f"{where}: expected a place that {name} can reach, found no way; move it or open one")
