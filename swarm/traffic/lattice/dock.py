"""How a robot comes to a place that it does not reach from inside one cell: it drives straight there from a cell.

The cells that its body then reaches into besides are reserved for the visit only. So a lattice decides no longer where
a robot may stand; walls do.
"""

from collections.abc import Callable, Collection
from math import ceil, hypot
from typing import Final, NamedTuple

from swarm.geometry import distance
from swarm.maps.occupancy import Point
from swarm.traffic.lattice.cell_map import OUTSIDE, CellMap
from swarm.traffic.lattice.distances import FAR
from swarm.traffic.settings import NEAR, TrafficConstants

STEP: Final = 0.05  # m, between two points of the way at which the body is tried
CLEAR: Final = 0.04  # m, kept between the body and walls beside the way: 1 cm more than its safety filter keeps
EXACT: Final = 0.05  # m; with such a reach or a smaller one a robot always drives straight to its place
LEAST: Final = 0.03  # m, from where the robot stands: it is never quite in the middle of its cell


class Dock(NamedTuple):
    """A place, and the cell from whose middle a robot drives straight to it."""

    place: Point  # m
    cell: int

    def cells_beside(self, cells: CellMap, settings: TrafficConstants, uncertainty: float = 0.0) -> tuple[int, ...]:
        """List the other cells that a body reaches into on the way and at the place, in ascending order.

        The body may be off by ``uncertainty`` [m].
        """
        line = _points_between(cells.centre(self.cell), self.place)
        way = cells.swept_cells(line, settings.radius + settings.margin + uncertainty)
        there = cells.swept_cells((self.place,), settings.standing_room + uncertainty)
        return tuple(sorted((way | there) - {self.cell, OUTSIDE}))

    def has_cells(
        self, held: Collection[int], cells: CellMap, settings: TrafficConstants, uncertainty: float = 0.0
    ) -> bool:
        """Return True if the ``held`` cells are all that a body needs here that may be off by ``uncertainty`` [m]."""
        return {self.cell, *self.cells_beside(cells, settings, uncertainty)}.issubset(held)

    def is_within_claims(self, cells: CellMap, settings: TrafficConstants) -> bool:
        """Return True if a robot in the middle of its cell may claim all that it needs: not where cells are large."""
        middle, most = cells.centre(self.cell), settings.claim_radius - NEAR
        return all(distance(cells.centre(cell), middle) <= most for cell in self.cells_beside(cells, settings))

    def is_straight(self, here: Point, held: Collection[int], cells: CellMap, settings: TrafficConstants) -> bool:
        """Return True if the straight line from a point [m] to the place stays in the ``held`` cells and off walls."""
        line = _points_between(here, self.place)
        inside = cells.swept_cells(line, settings.radius + settings.margin).issubset(held)
        return inside and cells.in_sight(here, self.place, settings.radius + LEAST)

    def next_point(self, here: Point, held: Collection[int], cells: CellMap, settings: TrafficConstants) -> Point:
        """Return where to drive from a point [m]: to the place, or first to the middle of the cell.

        A robot that aims at the place past a corner is stopped there by its safety filter.
        """
        middle = cells.centre(self.cell)
        begins = distance(here, middle) <= NEAR
        return self.place if begins or self.is_straight(here, held, cells, settings) else middle


def _points_between(start: Point, end: Point) -> list[Point]:
    count = max(1, ceil(distance(start, end) / STEP))
    shares = [number / count for number in range(count + 1)]
    return [(start[0] + share * (end[0] - start[0]), start[1] + share * (end[1] - start[1])) for share in shares]


def find_dock(
    cells: CellMap,
    place: Point,
    settings: TrafficConstants,
    can_use: Callable[[int], bool] = lambda cell: True,
    uncertainty: float = 0.0,
) -> Dock | None:
    """Return from which cell a robot comes to a place [m]; None: from none, or it needs no other cell than its own.

    The robot may be off by ``uncertainty`` [m]. The cell is one that it ``can_use`` and stand in, the place's own if
    possible, else the nearest around it from which no wall is in the way. Where walls stop the radio there is no dock:
    who claims a cell there leans towards it first, to be heard by all that could claim it too.
    """
    here = cells.cell_of(*place)
    if here == OUTSIDE or settings.in_sight:
        return None
    gap = gap_to_place(cells, here, place, settings, uncertainty)
    if cells.stands[here] and can_use(here) and gap <= settings.reach and settings.reach > EXACT:
        return None
    near = [cell for cell in cells.cells_around(here, 1) if cells.stands[cell] and can_use(cell)]

    def away(cell: int) -> tuple[bool, float, int]:
        middle = cells.centre(cell)
        return cell != here, hypot(middle[0] - place[0], middle[1] - place[1]), cell

    room = settings.radius + CLEAR
    for cell in sorted(near, key=away):
        if cells.in_sight(cells.centre(cell), place, room):
            dock = Dock(place, cell)
            if dock.is_within_claims(cells, settings):
                return dock
    return None


def find_way_out(cells: CellMap, here: Point, radius: float) -> int:
    """Return the nearest cell beside a place [m] to which a body of ``radius`` [m] can drive straight, or OUTSIDE.

    It is for a robot in a cell in which none can stand: no way over cells leads out of there.
    """
    near = [cell for cell in cells.cells_around(cells.cell_of(*here), 1) if cells.stands[cell]]
    near.sort(key=lambda cell: (distance(cells.centre(cell), here), cell))
    return next((cell for cell in near if cells.in_sight(here, cells.centre(cell), radius)), OUTSIDE)


def find_cell_beside(
    cells: CellMap, head: int, cell: int, place: Point, occupied: Collection[int], settings: TrafficConstants
) -> int:
    """Return the cell beside ``cell`` from inside which a robot comes nearest to a place [m], within reach; or OUTSIDE.

    It is none of those ``occupied``, and a way that avoids them leads there from the robot's ``head``.
    """
    gaps = {
        other: gap_to_place(cells, other, place, settings)
        for other in cells.cells_around(cell, 1)
        if cells.stands[other] and other not in occupied
    }
    near = sorted((gap, other) for other, gap in gaps.items() if gap <= settings.reach)
    if not near:
        return OUTSIDE
    steps = cells.distances(head, frozenset(occupied) - {head})
    return next((other for _, other in near if steps[other] < FAR), OUTSIDE)


def gap_to_place(
    cells: CellMap, cell: int, place: Point, settings: TrafficConstants, uncertainty: float = 0.0
) -> float:
    """Return how far from a place [m] a robot stands at most that keeps to one cell and may be off [m]."""
    return distance(cells.move_inside(cell, place, settings.standing_room + uncertainty), place) + NEAR + uncertainty
