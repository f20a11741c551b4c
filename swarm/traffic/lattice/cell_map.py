"""The cells that robots reserve: a lattice over the map, coarse enough for a robot to turn within one cell.

A cell is named by one number, ``row * columns + column``, the same for every robot that reads the same map. A robot can
stand in a cell if a disc is clear of walls at its centre. Two neighbours are joined if the disc is clear all along the
line between their centres. Both tests are exact for the boxes of the fine map.
"""

from collections.abc import Collection, Iterable, Iterator, Sequence
from math import ceil, cos, floor, hypot, sin
from typing import Final

import numpy as np
from numpy.typing import NDArray

from swarm.geometry import from_frame, to_frame
from swarm.maps.occupancy import FREE, UNKNOWN, Cell, OccupancyMap, Point
from swarm.traffic.lattice.discs import OPEN, STANDS, cells_under, compute_flags, line_is_clear, list_nearest_flagged
from swarm.traffic.lattice.distances import Distances
from swarm.traffic.lattice.extent import lattice_shape

OUTSIDE: Final = -1  # not a cell: beyond the lattice
ACROSS: Final = 16  # parts of a cell's side, at whose ends a body is tried
SIGHT: Final = 0.1  # m; a line of sight that passes a wall nearer than this does not count

Flags = NDArray[np.bool_]


class CellMap:
    """The cells, which of them are joined, and their distances in steps.

    ``radius`` [m] is that of the disc that has to fit: the robot, plus how far it may stray. ``side`` [m] is the side
    of a cell. ``offset`` [m, the map's own frame] is the outer corner of cell 0. ``like`` are cells of the
    same lattice: what was computed for them is taken over.
    """

    def __init__(
        self,
        occupancy: OccupancyMap,
        *,
        side: float,
        radius: float,
        offset: Point = (0.0, 0.0),
        unknown_is_free: bool = False,
        like: "CellMap | None" = None,
    ) -> None:
        self.occupancy = occupancy
        self.side = side
        self.radius = radius
        self.offset = offset
        self.rows, self.columns = lattice_shape(occupancy, side, offset)
        self._unknown_is_free = unknown_is_free
        x, y, yaw = occupancy.origin
        self._frame = (x, y, cos(yaw), sin(yaw), *offset, side)
        self._blind: dict[tuple[int, int], bool] = {}
        self._passable: dict[tuple[int, int], bool] = {}
        self._other_radii: dict[float, CellMap] = {}
        self._shut: frozenset[tuple[int, int]] = frozenset() if like is None else like._shut
        if like is None:
            self._solid = np.pad(_solid(occupancy.cells, unknown_is_free), 1, constant_values=True)
            self._flags = np.zeros((4, self.rows, self.columns), np.bool_)
            self._compute_flags(0, 0, self.rows, self.columns)
            self._open: tuple[bool, ...] = tuple(self._flags[OPEN].ravel().tolist())
            self.stands: tuple[bool, ...] = tuple(self._flags[STANDS].ravel().tolist())
            self.neighbours: tuple[tuple[int, ...], ...] = tuple(
                near for _, near in self._iterate_joins(range(self.rows), range(self.columns))
            )
            self._centres: dict[int, Point] = {}
            self._distances = Distances(self.neighbours)
        else:
            self._solid, self._flags, self._open = like._solid, like._flags, like._open
            self.stands, self.neighbours = like.stands, like.neighbours
            self._centres, self._distances = like._centres, like._distances

    def __len__(self) -> int:
        return self.rows * self.columns

    @property
    def has_unused_floor(self) -> bool:
        """True if free floor lies in cells that a wall reaches into: a way over the drawing may be none over cells."""
        free = np.count_nonzero(~self._solid) * self.occupancy.resolution**2
        return bool(sum(self._open) * self.side**2 < free - 0.5 * self.occupancy.resolution**2)

    # ---- geometry

    def centre(self, cell: int) -> Point:
        """Return the middle of a cell [m, map frame]."""
        found = self._centres.get(cell)
        if found is None:
            row, column = divmod(cell, self.columns)
            x, y = self.offset[0] + (column + 0.5) * self.side, self.offset[1] + (row + 0.5) * self.side
            found = self._centres[cell] = from_frame(self.occupancy.origin, x, y)
        return found

    def cell_of(self, x: float, y: float) -> int:
        """Return the cell that holds a point [m, map frame], or OUTSIDE."""
        x0, y0, c, s, along, up, side = self._frame
        dx, dy = x - x0, y - y0
        row, column = floor((c * dy - s * dx - up) / side), floor((c * dx + s * dy - along) / side)
        return row * self.columns + column if 0 <= row < self.rows and 0 <= column < self.columns else OUTSIDE

    def cells_under_disc(self, x: float, y: float, radius: float) -> tuple[int, ...]:
        """Return every cell that a disc [m, map frame] reaches into, in ascending order; OUTSIDE may be among them."""
        x0, y0, c, s, along, up, side = self._frame
        dx, dy = x - x0, y - y0
        u, v, reach = (c * dx + s * dy - along) / side, (c * dy - s * dx - up) / side, radius / side
        left, low = floor(u), floor(v)
        if left + 1 - u >= reach <= u - (left - 1) - 1 and low + 1 - v >= reach <= v - (low - 1) - 1 and reach > 0.0:
            return (self._number(low, left),)
        found = []
        for row in range(floor(v - reach), ceil(v + reach)):
            dy = max(row - v, v - row - 1, 0.0)
            for column in range(floor(u - reach), ceil(u + reach)):
                dx = max(column - u, u - column - 1, 0.0)
                if dx * dx + dy * dy < reach * reach:
                    found.append(self._number(row, column))
        return tuple(found)

    def room_in(self, held: Collection[int], x: float, y: float, radius: float) -> float:
        """Return the radius [m] of the largest disc around a point that lies inside the held cells, ``radius`` at most.

        The edge of the lattice bounds no disc: what is beyond is wall.
        """
        x0, y0, c, s, along, up, side = self._frame
        dx, dy, least = x - x0, y - y0, radius
        u, v = c * dx + s * dy - along, c * dy - s * dx - up
        for cell in self.cells_under_disc(x, y, radius):
            if cell not in held and cell != OUTSIDE:
                row, column = divmod(cell, self.columns)
                across = max(column * side - u, u - (column + 1) * side, 0.0)
                least = min(least, hypot(across, max(row * side - v, v - (row + 1) * side, 0.0)))
        return least

    def cells_around(self, cell: int, reach: int) -> list[int]:
        """List the cells at most ``reach`` rows and columns away from a cell, the cell itself included."""
        row, column = divmod(cell, self.columns)
        rows = range(max(0, row - reach), min(self.rows, row + reach + 1))
        columns = range(max(0, column - reach), min(self.columns, column + reach + 1))
        return [r * self.columns + c for r in rows for c in columns] if cell != OUTSIDE else []

    def adjacent_cells(self, cell: int) -> list[int]:
        """List the cells that share a side with a cell, joined or not, in ascending order."""
        row, column = divmod(cell, self.columns)
        near = ((row - 1, column), (row, column - 1), (row, column + 1), (row + 1, column))
        return [number for place in near if (number := self._number(*place)) != OUTSIDE]

    def swept_cells(self, points: Sequence[Point] | NDArray[np.float64], radius: float) -> frozenset[int]:
        """Return every cell of the lattice that a disc reaches into at any of the points [m, map frame]."""
        if len(points) == 1:
            touched = frozenset(self.cells_under_disc(points[0][0], points[0][1], radius))
            return touched - {OUTSIDE} if OUTSIDE in touched else touched
        places = np.asarray(points, np.float64)
        return frozenset(cells_under(places, radius, *self._frame, self.rows, self.columns).tolist())

    def swept_in_order(self, points: NDArray[np.float64], radius: float) -> tuple[int, ...]:
        """Return the cells of ``swept`` in the order in which the disc reaches them."""
        return tuple(dict.fromkeys(cells_under(points, radius, *self._frame, self.rows, self.columns).tolist()))

    def can_fit_disc(self, held: Collection[int], x: float, y: float, radius: float) -> bool:
        """Return True if a disc [m, map frame] lies inside the held cells and is clear of the walls in them."""
        touched = self.cells_under_disc(x, y, radius)
        if any(cell not in held for cell in touched):
            return False
        return all(self._open[cell] for cell in touched) or self._is_clear((x, y), (x, y), radius, 2)

    def move_inside(self, cell: int, point: Point, radius: float) -> Point:
        """Move a point to where a disc fits in the cell: inside its edges, then towards its middle [m, map frame]."""
        x0, y0 = self.centre(cell)
        row, column = divmod(cell, self.columns)
        room = max(0.0, self.side / 2 - radius)
        along, up = to_frame(self.occupancy.origin, *point)
        u, v = self.offset[0] + (column + 0.5) * self.side, self.offset[1] + (row + 0.5) * self.side
        point = from_frame(
            self.occupancy.origin, u + max(-room, min(room, along - u)), v + max(-room, min(room, up - v))
        )
        for share in (1.0, 0.8, 0.6, 0.4, 0.2):
            x, y = x0 + share * (point[0] - x0), y0 + share * (point[1] - y0)
            if self.can_fit_disc((cell,), x, y, radius - 1e-6):
                return x, y
        return x0, y0

    def nearest_standable(self, x: float, y: float, among: Collection[int] = ()) -> int:
        """Return the cell to stand in that holds a point [m, map frame], else the one with the nearest centre.

        Cells of ``among`` are preferred. The result is OUTSIDE if there is no cell to stand in.
        """
        here = self.cell_of(x, y)
        if here != OUTSIDE and self.stands[here]:
            return here
        standable = [cell for cell in sorted(among) if self.stands[cell]]
        if not standable:
            along, up = to_frame(self.occupancy.origin, x, y)
            row, column = (up - self.offset[1]) / self.side, (along - self.offset[0]) / self.side
            standable = list_nearest_flagged(self._flags[STANDS], row, column)

        def away(cell: int) -> float:
            centre = self.centre(cell)
            return hypot(centre[0] - x, centre[1] - y)

        return min(standable, key=away, default=OUTSIDE)

    def leaning_point(self, cell: int, towards: int, radius: float) -> Point:
        """Return the point of a cell nearest to a joined cell where a disc stays inside its own cell [m, map frame]."""
        (x0, y0), (x1, y1) = self.centre(cell), self.centre(towards)
        share = max(0.0, 0.5 - radius / self.side)
        return x0 + share * (x1 - x0), y0 + share * (y1 - y0)

    def is_blind(self, cell: int, towards: int) -> bool:
        """Return True if, from the middle of ``cell``, walls hide another cell that is joined to ``towards``."""
        key = (cell, towards)
        if key not in self._blind:
            here = self.centre(cell)
            others = (self.centre(other) for other in self.neighbours[towards] if other != cell)
            self._blind[key] = not all(self.in_sight(here, other) for other in others)
        return self._blind[key]

    def is_joined(self, cell: int) -> bool:
        """Return True if a robot can stand in a cell and drive on from there."""
        return cell != OUTSIDE and self.stands[cell] and bool(self.neighbours[cell])

    def is_passable(self, a: int, b: int) -> bool:
        """Return True if a body can get from one cell to a neighbour somewhere across their common side.

        Somewhere on that side the disc that has to fit is clear of walls; the cells need not be joined.
        """
        key = (min(a, b), max(a, b))
        if key not in self._passable:
            (x0, y0), (x1, y1) = self.centre(a), self.centre(b)
            x, y, dx, dy = (x0 + x1) / 2, (y0 + y1) / 2, y1 - y0, x0 - x1  # its middle, and a side's length along it
            shares = [number / ACROSS - 0.5 for number in range(ACROSS + 1)]
            places = ((x + share * dx, y + share * dy) for share in shares)
            self._passable[key] = any(self._is_clear(place, place, self.radius, 2) for place in places)
        return self._passable[key]

    def in_sight(self, a: Point, b: Point, room: float = SIGHT) -> bool:
        """Return True if no wall comes nearer than ``room`` [m] to the line between two points [m, map frame]."""
        return self._is_clear(a, b, room, ceil(hypot(b[0] - a[0], b[1] - a[1]) / SIGHT))

    # ---- distances

    def distances(self, goal: int, without: Collection[int] = ()) -> list[int]:
        """Return the steps from every cell to ``goal``, or FAR; no way enters ``without``. Do not change the list."""
        return self._distances.steps_to(goal, without)

    @property
    def pieces(self) -> list[int]:
        """A number for each cell: the same for two cells if a way joins them. Do not change the list.

        A cell not to stand in has a number of its own. The list ends with OUTSIDE, the number of the place OUTSIDE.
        """
        return self._distances.pieces

    # ---- other floors, on the same lattice

    def update_cells(self, occupancy: OccupancyMap, low: Cell, high: Cell) -> "CellMap":
        """Return the cells of an edited map; only fine cells from ``low`` up to but not including ``high`` may differ.

        The result is the same as if all cells were made again, but only the surroundings of the edit are computed. If
        no join changes, ``neighbours`` is the very same object.
        """
        other = self._over_map(occupancy)
        other._solid = self._solid.copy()
        block = _solid(occupancy.cells[low[0] : high[0], low[1] : high[1]], self._unknown_is_free)
        other._solid[low[0] + 1 : high[0] + 1, low[1] + 1 : high[1] + 1] = block
        other._flags = self._flags.copy()
        row, column = (self._edit_bound(low[axis], self.offset[1 - axis], -1) for axis in (0, 1))
        beyond_row = min(self.rows, self._edit_bound(high[0], self.offset[1], 1))
        beyond_column = min(self.columns, self._edit_bound(high[1], self.offset[0], 1))
        other._compute_flags(row, column, beyond_row, beyond_column)
        if (other._flags == self._flags).all():
            return other
        other._open = tuple(other._flags[OPEN].ravel().tolist())
        if (other._flags[:OPEN] == self._flags[:OPEN]).all():
            return other
        other.stands = tuple(other._flags[STANDS].ravel().tolist())
        joined = list(self.neighbours)
        rows, columns = range(row, min(self.rows, beyond_row + 1)), range(column, min(self.columns, beyond_column + 1))
        for cell, near in other._iterate_joins(rows, columns):
            joined[cell] = near
        if tuple(joined) != self.neighbours:
            other.neighbours = tuple(joined)
            other._distances = Distances(other.neighbours)
        return other

    def without_joins(self, shut: Iterable[tuple[int, int]]) -> "CellMap":
        """Return the same cells, with the given pairs of neighbours no longer joined."""
        pairs = set(shut)
        if not pairs:
            return self
        other = self._over_map(self.occupancy)
        other._shut = self._shut | pairs
        other.neighbours = tuple(
            tuple(near for near in row if (cell, near) not in pairs and (near, cell) not in pairs)
            for cell, row in enumerate(self.neighbours)
        )
        other._distances = Distances(other.neighbours)
        return other

    def for_radius(self, radius: float) -> "CellMap":
        """Return the cells of the same floor as they are joined for a disc of another radius [m]; it is kept.

        What was taken from the joins by ``without_joins`` is missing there too.
        """
        found = self._other_radii.get(radius)
        if found is None:
            found = CellMap(
                self.occupancy, side=self.side, radius=radius, offset=self.offset, unknown_is_free=self._unknown_is_free
            ).without_joins(self._shut)
            self._other_radii[radius] = found
        return found

    def _over_map(self, occupancy: OccupancyMap) -> "CellMap":
        """Return the same cells over another map of the same size."""
        return CellMap(
            occupancy, side=self.side, radius=self.radius, offset=self.offset,
            unknown_is_free=self._unknown_is_free, like=self,
        )  # fmt: skip

    def _edit_bound(self, fine: int, offset: float, towards: int) -> int:
        """Return the first row or column that a fine cell affects (``towards`` -1), or the one after the last (1)."""
        at = (fine * self.occupancy.resolution - offset + towards * self.radius) / self.side
        return max(0, floor(at - 1.5) if towards < 0 else ceil(at + 0.5))

    # ---- building

    def _number(self, row: int, column: int) -> int:
        return row * self.columns + column if 0 <= row < self.rows and 0 <= column < self.columns else OUTSIDE

    def _compute_flags(self, row: int, column: int, beyond_row: int, beyond_column: int) -> None:
        """Compute the flags of a block of cells."""
        compute_flags(
            self._solid, self.occupancy.resolution, *self.offset, self.side, self.radius,
            row, column, beyond_row, beyond_column, self._flags,
        )  # fmt: skip

    def _iterate_joins(self, rows: range, columns: range) -> Iterator[tuple[int, tuple[int, ...]]]:
        """Yield each cell of a block with its joined neighbours: right, up, left, down."""
        stands, right, up = self._flags[:OPEN].tolist()
        for row in rows:
            for column in columns:
                cell, near = row * self.columns + column, []
                if column + 1 < self.columns and right[row][column] and stands[row][column + 1]:
                    near.append(cell + 1)
                if row + 1 < self.rows and up[row][column] and stands[row + 1][column]:
                    near.append(cell + self.columns)
                if column > 0 and right[row][column - 1] and stands[row][column - 1]:
                    near.append(cell - 1)
                if row > 0 and up[row - 1][column] and stands[row - 1][column]:
                    near.append(cell - self.columns)
                yield cell, tuple(near) if stands[row][column] else ()

    def _is_clear(self, a: Point, b: Point, radius: float, count: int) -> bool:
        """Return True if a disc is clear of walls at each of ``count - 1`` points between two points [m, map frame]."""
        return bool(line_is_clear(self._solid, self.occupancy.resolution, *self._frame[:4], *a, *b, radius, count))


def _solid(cells: NDArray[np.uint8], unknown_is_free: bool) -> Flags:
    """Return the fine cells that a robot cannot enter."""
    return np.asarray((cells != FREE) & (cells != UNKNOWN) if unknown_is_free else cells != FREE)
