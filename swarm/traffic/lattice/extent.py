"""How many cells lie over a map. Nothing here is compiled: who only draws cells need not load what is."""

from math import ceil
from typing import Final

from swarm.maps.occupancy import OccupancyMap, Point

ROUNDING: Final = 1e-9  # cells; a learned map sums its length from finer cells and must get the same number of cells


def lattice_shape(floor: OccupancyMap, side: float, offset: Point) -> tuple[int, int]:
    """Return the rows and columns of cells over a floor, as ``CellMap`` numbers them: row * columns + column.

    ``side`` [m] is a cell's. ``offset`` [m, the map's own frame] is the outer corner of cell 0.
    """
    rows, columns = floor.shape
    height, width = rows * floor.resolution, columns * floor.resolution
    return (
        max(0, ceil((height - offset[1]) / side - 0.5 - ROUNDING)),
        max(0, ceil((width - offset[0]) / side - 0.5 - ROUNDING)),
    )
