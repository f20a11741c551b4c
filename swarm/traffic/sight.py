"""Where walls stop the radio: from which cells a cell may be entered so that all who want it hear each other."""

from itertools import combinations

from swarm.maps.occupancy import Point
from swarm.traffic.cells import CellMap

Joined = tuple[tuple[int, ...], ...]


def without_unheard(cells: CellMap, room: float) -> CellMap:
    """Return the cells without joins by which two robots could want one cell and not hear each other round a corner.

    A robot claims a cell from the middle of its own, or leaning towards it where walls hide somebody from the middle;
    ``room`` [m] is what it keeps to the edge then. Where two robots that want one cell do not even see each other so,
    the cell is entered from one side only: the one with the lower number.
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
