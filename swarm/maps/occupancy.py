"""The occupancy map: every loader returns one, everything else reads it."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from hashlib import blake2b
from math import ceil, floor
from typing import Final

import numpy as np
from numpy.typing import NDArray

from swarm.geometry import Pose, from_frame, to_frame

FREE: Final = 0
WALL: Final = 1
OBSTACLE: Final = 2  # as solid as a wall; contacts with it are counted separately
UNKNOWN: Final = 3  # never observed: solid for the world; a planner may treat it as free

ORIGIN: Final = Pose(0.0, 0.0, 0.0)

Cell = tuple[int, int]  # (row, column)
Point = tuple[float, float]  # m, in the map frame
Disc = tuple[float, float, float]  # m, in the map frame: centre and radius


@dataclass(frozen=True, eq=False)
class OccupancyMap:
    """The state of each cell of a map. A map is immutable; maps with equal cells in equal places are equal.

    Row 0 is at the lowest y of the map's own frame (the loaders of images and text flip the rows), column 0 at the
    lowest x. ``origin`` is the pose of the outer corner of cell (0, 0) in the ``map`` frame, as in ROS map_server.
    """

    cells: NDArray[np.uint8]  # (rows, columns) of FREE, WALL, OBSTACLE, UNKNOWN
    resolution: float  # m, the side of a cell
    origin: Pose = ORIGIN

    @cached_property
    def _content(self) -> tuple[object, ...]:
        return (blake2b(self.cells.tobytes()).digest(), self.shape, self.resolution, self.origin)

    def __eq__(self, other: object) -> bool:
        return self is other or (isinstance(other, OccupancyMap) and self._content == other._content)

    def __hash__(self) -> int:
        return hash(self._content)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        rows, columns = self.cells.shape
        return rows, columns

    def cell_of(self, x: float, y: float) -> Cell:
        """Return the cell that contains a point [m, map frame]; it may lie outside the map."""
        along, up = to_frame(self.origin, x, y)
        return floor(up / self.resolution), floor(along / self.resolution)

    def centre_of(self, cell: Cell) -> Point:
        """Return the centre of a cell [m, map frame]."""
        return from_frame(self.origin, (cell[1] + 0.5) * self.resolution, (cell[0] + 0.5) * self.resolution)

    def inside(self, cell: Cell) -> bool:
        """Return True if the map has that cell."""
        rows, columns = self.shape
        return 0 <= cell[0] < rows and 0 <= cell[1] < columns

    def at(self, x: float, y: float) -> int:
        """Return the state of the cell at a point [m, map frame]; everything outside the map is WALL."""
        cell = self.cell_of(x, y)
        return int(self.cells[cell]) if self.inside(cell) else WALL

    def edit_rectangle(self, kind: int, a: Point, b: Point) -> "tuple[OccupancyMap, Cell, Cell]":
        """Return a map in which all cells that a rectangle touches are ``kind``; a and b [m, map] are opposite corners.

        The rectangle covers at least one row and one column. Returns the new map, ``low`` and ``high``: only cells from
        ``low`` up to, but not including, ``high`` may differ. That block is empty if the rectangle is outside the map.
        """
        ring = [to_frame(self.origin, x, y) for x in (a[0], b[0]) for y in (a[1], b[1])]
        along, up = zip(*((x / self.resolution, y / self.resolution) for x, y in ring), strict=True)
        rows, columns = self.shape
        first = floor(min(up) + 1e-9), floor(min(along) + 1e-9)
        low = max(0, first[0]), max(0, first[1])
        last = max(first[0] + 1, ceil(max(up) - 1e-9)), max(first[1] + 1, ceil(max(along) - 1e-9))
        high = min(rows, last[0]), min(columns, last[1])
        cells = self.cells.copy()
        cells[low[0] : max(low[0], high[0]), low[1] : max(low[1], high[1])] = kind
        return replace(self, cells=cells), low, (max(low[0], high[0]), max(low[1], high[1]))

    def corners(self, low: Cell, high: Cell) -> list[Point]:
        """Return the four corners [m, map frame] of a block of cells, counter-clockwise; ``high`` is excluded."""
        (r0, c0), (r1, c1) = low, high
        side = self.resolution
        ring = ((c0, r0), (c1, r0), (c1, r1), (c0, r1))
        return [from_frame(self.origin, column * side, row * side) for column, row in ring]

    def blocks(self, kind: int) -> Iterator[tuple[Cell, Cell]]:
        """Yield few rectangles ``(low, high)`` that cover all cells of one kind; ``high`` is excluded, none overlap."""
        left = self.cells == kind
        for row, column in np.argwhere(left).tolist():
            if not left[row, column]:
                continue
            line = left[row, column:]
            width = int(np.argmin(line)) if not line.all() else line.size
            height = 1
            while row + height < left.shape[0] and left[row + height, column : column + width].all():
                height += 1
            left[row : row + height, column : column + width] = False
            yield (row, column), (row + height, column + width)
