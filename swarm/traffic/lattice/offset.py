"""Where a lattice lies on a floor: the offset that serves best, of a few that are tried."""

from collections import Counter
from collections.abc import Callable, Sequence
from typing import Final

import numpy as np

from swarm.maps.occupancy import FREE, OccupancyMap, Point
from swarm.traffic.lattice.cell_map import OUTSIDE, CellMap

PHASES: Final = 4  # lattice offsets tried along each axis
ROUNDING: Final = 1e-6  # cells; a row that fits exactly fits


def best_offset(
    occupancy: OccupancyMap,
    *,
    side: float,
    radius: float,
    missed: Callable[[CellMap], int] = lambda cells: 0,
    centred: bool = False,
    phases: int = PHASES,
    places: Sequence[Point] = (),
) -> Point:
    """Return the lattice offset [m] that leaves most of the floor in one piece, misses least, then joins most cells.

    Before all that, bodies at as few ``places`` [m, map frame] as possible reach beyond the last cells.

    Walls rarely fit a lattice: shifting it by part of a cell opens doors; ``phases`` offsets are tried along each axis.
    The offset 0 wins ties. If ``centred``, an offset is tried first at which as many rows as fit lie in the middle of
    the free floor: two lanes in a hall, each as far from its wall as the other.
    """

    def worth(offset: Point) -> tuple[int, float, int, int]:
        cells = CellMap(occupancy, side=side, radius=radius, offset=offset)
        sizes = Counter(piece for piece, stands in zip(cells.pieces, cells.stands, strict=False) if stands).values()
        together = sum(size * size for size in sizes) / max(1, sum(sizes)) ** 2
        beyond = sum(OUTSIDE in cells.cells_under_disc(*place, radius) for place in places)
        return -beyond, round(together, 2), -missed(cells), sum(map(len, cells.neighbours))

    shifts = [-k * side / phases for k in range(phases)]
    across, up = (_middle_shifts(occupancy, axis, side, radius) if centred else [] for axis in (1, 0))
    return max(((x, y) for y in (*up, *shifts) for x in (*across, *shifts)), key=worth)


def _middle_shifts(occupancy: OccupancyMap, axis: int, side: float, radius: float) -> list[float]:
    """Return the shift along an axis [m] that centres as many cells as fit on the free floor; [] if none fits."""
    free = np.flatnonzero((occupancy.cells == FREE).any(axis=1 - axis))
    if not len(free):
        return []
    low, high = int(free[0]) * occupancy.resolution, (int(free[-1]) + 1) * occupancy.resolution
    if high - low < 2 * radius:
        return []
    count = int((high - low - 2 * radius) / side + ROUNDING) + 1
    return [((low + high - count * side) / 2) % side - side]
