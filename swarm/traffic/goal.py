"""Where a robot wants to be: a cell that it can stand in and reach, and the place in that cell."""

from swarm.geometry import distance
from swarm.maps.occupancy import Point
from swarm.traffic.breadth_first import FAR
from swarm.traffic.cells import OUTSIDE, CellMap
from swarm.traffic.presence import Body
from swarm.traffic.route_progress import BESIDE, RouteProgress


class Goal:
    """The goal of one robot."""

    def __init__(self) -> None:
        self.cell = OUTSIDE
        self.since = 0  # tick
        self.wish: Point | None = None  # m; None: nowhere in particular
        self.way_out: tuple[int, ...] = ()  # of a cell that is none to stand in, as a way; () elsewhere
        self._place_for: tuple[CellMap, int, Point] | None = None
        self._place: Point = (0.0, 0.0)

    def set(self, wish: Point | None, progress: RouteProgress, body: Body, cells: CellMap, radius: float) -> bool:
        """Take the place wanted [m]; return True if that changes the cell of a robot that wants to be somewhere.

        Where no way of the map leads from its head to it, the nearest cell is taken that can be reached. ``radius`` [m]
        is the footprint's.
        """
        changed = False
        if wish is None:
            if self.wish is not None or self.cell == OUTSIDE:
                self.cell = progress.head
        elif wish != self.wish or self.cell == OUTSIDE or self.way_out or not cells.stands[self.cell]:
            self.way_out = _way_out(progress, body, cells, radius)
            cell = self.way_out[0] if self.way_out else cells.cell_of(*wish)
            table = cells.distances(cell if self.way_out else progress.head)
            if cell == OUTSIDE or table[cell] >= FAR:
                reachable = [other for other, steps in enumerate(table) if steps < FAR]
                cell = min(reachable, key=lambda other: (distance(cells.centre(other), wish), other))
            if cell != self.cell:
                self.cell, self.since, changed = cell, body.tick, True
        self.wish = wish
        return changed

    def place(self, wish: Point, room: float, cells: CellMap) -> Point:
        """Return the place in the goal's cell nearest to ``wish`` where a disc of a radius ``room`` fits [m]."""
        asked = (cells, self.cell, wish)
        if asked != self._place_for:
            self._place_for = asked
            self._place = cells.moved_inside(self.cell, wish, room)
        return self._place


def _way_out(progress: RouteProgress, body: Body, cells: CellMap, radius: float) -> tuple[int, ...]:
    """Return the cell to drive to, as a way, where an edit has left the body in a cell that is none to stand in.

    No way of the map leads from there. () where it stands in a cell of the map, or every cell beside is shut off.
    """
    head = progress.head
    if cells.stands[head] or any(step != BESIDE for step in progress.steps[:-1]):
        return ()
    middles = {cell: cells.centre(cell) for cell in cells.around(head, 1) if cells.stands[cell]}
    near = sorted(middles, key=lambda cell: (distance(middles[cell], body.pose), cell))
    here = (body.pose.x, body.pose.y)
    return next(((cell,) for cell in near if cells.in_sight(here, middles[cell], radius)), ())
