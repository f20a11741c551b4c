"""Where a robot wants to be: a cell that it can stand in and reach, and the place in that cell."""

from swarm.geometry import distance
from swarm.maps.occupancy import Point
from swarm.traffic.cells import FAR, OUTSIDE, CellMap


class Goal:
    """The goal of one robot."""

    def __init__(self) -> None:
        self.cell = OUTSIDE
        self.since = 0  # tick
        self.wish: Point | None = None  # m; None: nowhere in particular
        self._place_for: tuple[CellMap, int, Point] | None = None
        self._place: Point = (0.0, 0.0)

    def set(self, wish: Point | None, head: int, tick: int, cells: CellMap) -> bool:
        """Take the place wanted [m]; return True if that changes the cell of a robot that wants to be somewhere.

        Where no way of the map leads from ``head`` to it, the nearest cell is taken that can be reached.
        """
        changed = False
        if wish is None:
            if self.wish is not None or self.cell == OUTSIDE:
                self.cell = head
        elif wish != self.wish or self.cell == OUTSIDE:
            cell = cells.cell_of(*wish)
            table = cells.distances(head)
            if cell == OUTSIDE or table[cell] >= FAR:
                reachable = [other for other, steps in enumerate(table) if steps < FAR]
                cell = min(reachable, key=lambda other: (distance(cells.centre(other), wish), other))
            if cell != self.cell:
                self.cell, self.since, changed = cell, tick, True
        self.wish = wish
        return changed

    def place(self, wish: Point, room: float, cells: CellMap) -> Point:
        """Return the place in the goal's cell nearest to ``wish`` where a disc of a radius ``room`` fits [m]."""
        asked = (cells, self.cell, wish)
        if asked != self._place_for:
            self._place_for = asked
            self._place = cells.moved_inside(self.cell, wish, room)
        return self._place
