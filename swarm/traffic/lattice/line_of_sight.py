"""Cells for a radio that walls stop: all robots that want to enter a cell must hear each other."""

from itertools import combinations

from swarm.maps.occupancy import Point
from swarm.traffic.lattice.cell_map import CellMap

Joined = tuple[tuple[int, ...], ...]


def without_unheard(cells: CellMap, room: float) -> CellMap:
    """Return the cells without joins over which two robots could want one cell and not hear each other round a corner.

    A robot claims a cell from the middle of its own. If walls hide another robot from there, it leans towards the cell
    that it claims; ``room`` [m] is what it then keeps to the edge. If two robots that want one cell do not even see
    each other then, the cell is entered from one side only: from the cell with the lower number.
    """
    parted = True
    while parted:
        parted = False
        for cell in range(len(cells)):
            for one, other in combinations(sorted(cells.neighbours[cell]), 2):
                if not cells.in_sight(_place(cells, one, cell, room), _place(cells, other, cell, room)):
                    cells = cells.without([(cell, other)])
                    parted = True
                    break
    return cells


def _place(cells: CellMap, cell: int, towards: int, room: float) -> Point:
    return cells.leaning(cell, towards, room) if cells.is_blind(cell, towards) else cells.centre(cell)
