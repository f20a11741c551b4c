"""The goal of a robot: a cell that it can stand in and reach, and the point in that cell."""

from collections.abc import Sequence
from typing import NamedTuple

from swarm.geometry import distance
from swarm.maps.occupancy import Point
from swarm.traffic.lattice.breadth_first import FAR
from swarm.traffic.lattice.cell_map import OUTSIDE, CellMap
from swarm.traffic.reservations.presence import Footprint
from swarm.traffic.reservations.route import BESIDE, RouteProgress


class Wish(NamedTuple):
    """Where a robot wants to be in one tick."""

    goal: Point | None  # m; None: it stays, but makes room for others
    path: Sequence[Point]  # m, to the goal; (): any shortest way
    done: bool  # no stop is left: the goal is only a place to stand


class Goal:
    """The goal of one robot."""

    def __init__(self) -> None:
        self.cell = OUTSIDE
        self.since = 0  # tick
        self.wish: Point | None = None  # m; None: no particular place
        self.way_out: tuple[int, ...] = ()  # the way out of a cell in which no robot can stand; () elsewhere
        self._place_for: tuple[CellMap, int, Point] | None = None
        self._place: Point = (0.0, 0.0)

    def set(self, wish: Point | None, progress: RouteProgress, body: Footprint, cells: CellMap, radius: float) -> bool:
        """Set the wanted point [m]; return True if the goal cell changes and the robot wants to be somewhere.

        If no way leads from the head to that point, the nearest reachable cell is taken. ``radius`` [m] is that of the
        footprint.
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

    def choose_again(self) -> None:
        """Choose the cell again with the next wish, because the floor has changed."""
        self.wish = None

    def forget(self) -> None:
        """Forget the cell, because ways on the old floor count no more."""
        self.cell = OUTSIDE

    def stay_at(self, cell: int) -> None:
        """Take the cell to which a joint plan leads the robot, which has no goal of its own."""
        self.cell = cell

    def place(self, wish: Point, room: float, cells: CellMap) -> Point:
        """Return the point in the goal cell nearest to ``wish`` where a disc with the radius ``room`` fits [m]."""
        asked = (cells, self.cell, wish)
        if asked != self._place_for:
            self._place_for = asked
            self._place = cells.moved_inside(self.cell, wish, room)
        return self._place


def _way_out(progress: RouteProgress, body: Footprint, cells: CellMap, radius: float) -> tuple[int, ...]:
    """Return the cell to drive to, as a way, if an edit has left the body in a cell where no robot can stand.

    No way over cells leads out of such a cell. The result is () if the robot stands in a proper cell, or if every cell
    beside it is shut off.
    """
    head = progress.head
    if cells.stands[head] or any(step != BESIDE for step in progress.steps[:-1]):
        return ()
    middles = {cell: cells.centre(cell) for cell in cells.around(head, 1) if cells.stands[cell]}
    near = sorted(middles, key=lambda cell: (distance(middles[cell], body.pose), cell))
    here = (body.pose.x, body.pose.y)
    return next(((cell,) for cell in near if cells.in_sight(here, middles[cell], radius)), ())
