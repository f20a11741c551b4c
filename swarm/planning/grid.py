"""The planning grid: a map whose solid parts are grown by the robot's radius; free cells are for the robot's centre."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil, cos, floor, hypot, inf, isfinite, sin
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from swarm.errors import ConfigError
from swarm.geometry import Pose, from_frame
from swarm.maps.limits import check_size
from swarm.maps.occupancy import FREE, UNKNOWN, Cell, OccupancyMap, Point
from swarm.planning.astar import Lattice
from swarm.planning.distance import clearance_of
from swarm.planning.steps import number_pieces
from swarm.planning.sweep import find_moves

Coordinate = TypeVar("Coordinate", float, NDArray[np.float64])

UNIT = 64  # cost of a cell far from everything solid, see ``Grid.cost``
NEAR, FAR = 3.0, 0.3  # extra cost, as a share, of a cell in contact: within the margin, and up to a diameter beyond


@dataclass(frozen=True, eq=False)
class Grid:
    """The cells in which a robot may stand, and their clearance. A grid is immutable.

    A cell is free if a disc of ``radius`` at its centre touches nothing solid. ``margin`` closes no passage, it only
    adds cost: a path goes through a narrower place only if the way round is much longer.
    """

    free: NDArray[np.bool_]  # (rows, columns), row 0 at the lowest y
    resolution: float  # m, the side of a cell
    origin: Pose  # of the outer corner of cell (0, 0), in map
    clearance: NDArray[np.float32]  # m, (rows, columns): from a cell's centre to the nearest solid point
    solid: NDArray[np.uint8]  # (rows, columns), 1 where solid
    moves: NDArray[np.uint8]  # (rows, columns): bit k set where a step in direction k is legal, see ``sweep``
    radius: float  # m, of the robot
    margin: float  # m, preferred clearance beyond the radius
    factor: int  # cells of the grid per cell of the map, along each axis
    unknown_free: bool
    discs: NDArray[np.float64]  # (count, 3): x, y, sum of the disc's and the robot's radius; all in cells

    @classmethod
    def grown(
        cls,
        map: OccupancyMap,  # noqa: A002
        radius: float,
        margin: float = 0.0,
        resolution: float | None = None,
        unknown_free: bool = False,
    ) -> "Grid":
        """Return the grid of a map grown by ``radius`` [m]; its cells are divided evenly to at most ``resolution`` [m].

        Raises:
            ConfigError: a length is not valid, or the grid is too large.
        """
        for name, length, least in (("radius", radius, 0.0), ("margin", margin, 0.0)):
            if not (isfinite(length) and length >= least):
                raise ConfigError(f"planning: {name}: expected a length of 0 m or more, got {length!r}; correct it")
        if resolution is not None and not (isfinite(resolution) and resolution > 0.0):
            raise ConfigError(f"planning: resolution: expected more than 0 m, got {resolution!r}; 0.1 is usual")
        factor = 1 if resolution is None else refinement(map, resolution)
        rows, columns = map.shape
        check_size(rows * factor, columns * factor, f"planning grid of cells of {map.resolution / factor:g} m")
        solid = _solid(map.cells, factor, unknown_free)
        side = map.resolution / factor
        clearance = clearance_of(solid, side, (0, 0), solid.shape)
        grid = cls(
            free=clearance > np.float32(radius),
            resolution=side,
            origin=map.origin,
            clearance=clearance,
            solid=solid,
            moves=np.zeros_like(solid),
            radius=float(radius),
            margin=float(margin),
            factor=factor,
            unknown_free=unknown_free,
            discs=np.empty((0, 3)),
        )
        grid._find_moves((0, 0), grid.shape)
        return grid

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        rows, columns = self.free.shape
        return rows, columns

    def cell_of(self, x: float, y: float) -> Cell:
        """Return the cell that contains a point [m, map frame]; it may lie outside the grid."""
        column, row = self.to_cells(x, y)
        return floor(row), floor(column)

    def centre_of(self, cell: Cell) -> Point:
        """Return the centre of a cell [m, map frame]."""
        return self.from_cells(cell[1] + 0.5, cell[0] + 0.5)

    def to_cells(self, x: Coordinate, y: Coordinate) -> tuple[Coordinate, Coordinate]:
        """Transform a point, or many, [m, map frame] into (column, row) of the grid, in fractions of cells."""
        x0, y0, c, s, side = self._frame
        dx, dy = x - x0, y - y0
        return (c * dx + s * dy) / side, (c * dy - s * dx) / side

    @cached_property
    def _frame(self) -> tuple[float, float, float, float, float]:
        x, y, yaw = self.origin
        return x, y, cos(yaw), sin(yaw), self.resolution

    def from_cells(self, column: float, row: float) -> Point:
        """Transform (column, row), in fractions of cells, into a point [m, map frame]."""
        return from_frame(self.origin, column * self.resolution, row * self.resolution)

    def is_free(self, x: float, y: float) -> bool:
        """Return True if the point [m, map frame] is in a free cell of the grid."""
        row, column = self.cell_of(x, y)
        return 0 <= row < self.shape[0] and 0 <= column < self.shape[1] and bool(self.free[row, column])

    def room_at(self, x: float, y: float) -> float:
        """Return the distance [m] from a point [m, map] to the nearest solid cell, disc or map edge.

        It is 0 if the point is in one of them or outside the map.
        """
        column, row = self.to_cells(x, y)
        rows, columns = self.shape
        if not (0 <= column < columns and 0 <= row < rows):
            return 0.0
        least = min(row, rows - row, column, columns - column)
        reach = float(self.clearance[int(row), int(column)]) / self.resolution + 1.0
        low, high = self._clip((floor(row - reach), floor(column - reach)), (ceil(row + reach), ceil(column + reach)))
        solid = np.argwhere(self.solid[low[0] : high[0], low[1] : high[1]]) + low
        if len(solid):
            gap = np.maximum(np.maximum(solid - (row, column), (row, column) - solid - 1.0), 0.0)
            least = min(least, float(np.hypot(gap[:, 0], gap[:, 1]).min()))
        for disc_x, disc_y, wide in self.discs.tolist():
            least = min(least, max(0.0, hypot(disc_x - column, disc_y - row) - wide + self.radius / self.resolution))
        return least * self.resolution

    def least_room(self, points: NDArray[np.float64]) -> float:
        """Return the distance [m] to the nearest solid from the point (n, 2) [m, map] with the least clearance.

        The distance is exact, the choice of the point is not: another one may be nearer by part of a cell. With no
        point it is infinite.
        """
        if not len(points):
            return inf
        columns, rows = (np.floor(along).astype(np.int64) for along in self.to_cells(points[:, 0], points[:, 1]))
        inside = (rows >= 0) & (rows < self.shape[0]) & (columns >= 0) & (columns < self.shape[1])
        if not inside.all():
            return 0.0
        x, y = points[int(np.argmin(self.clearance[rows, columns]))].tolist()
        return self.room_at(x, y)

    def lattice(self) -> Lattice:
        """Return a new lattice to search on. Its working memory is larger than the grid: do not keep it."""
        return Lattice(self.free, self.moves)

    @cached_property
    def pieces(self) -> NDArray[np.int32]:
        """The number of each cell's piece, (rows, columns): a path joins two free cells of one piece, and no others."""
        numbers = np.empty(self.shape, np.int32)
        number_pieces(self.moves, numbers)
        return numbers

    @cached_property
    def cost(self) -> NDArray[np.int16]:
        """Cost of each cell, (rows, columns): ``UNIT`` far from everything solid, more the nearer to something solid.

        The cost rises slowly from one diameter beyond the margin, which keeps a path in the middle of a passage and
        away from corners if the detour is small. Within the margin it rises steeply.
        """
        room = np.maximum(self.clearance - np.float32(self.radius), 0.0)
        ease = self.margin + 2 * self.radius
        dearness = FAR * np.square(np.maximum(0.0, 1.0 - room / ease)) if ease else np.zeros_like(room)
        if self.margin:
            dearness += NEAR * np.square(np.maximum(0.0, 1.0 - room / self.margin))
        costs: NDArray[np.int16] = np.rint(UNIT * (1.0 + dearness)).astype(np.int16)
        return costs

    def with_discs(self, centres: Iterable[Point], radius: float) -> "Grid":
        """Return the grid with additional solid discs, each of ``radius`` [m] around a centre [m, map frame]."""
        free, clearance = self.free.copy(), self.clearance.copy()
        added = [(*self.to_cells(x, y), (radius + self.radius) / self.resolution) for x, y in centres]
        grid = replace(
            self,
            free=free,
            clearance=clearance,
            moves=self.moves.copy(),
            discs=np.concatenate([self.discs, np.array(added, np.float64).reshape(-1, 3)]),
        )
        blocks = []
        for x, y, reach in added:
            wide = reach + (2 * self.radius + self.margin) / self.resolution + 2  # as far as ``cost`` looks
            low, high = self._clip((floor(y - wide), floor(x - wide)), (ceil(y + wide) + 1, ceil(x + wide) + 1))
            if low[0] >= high[0] or low[1] >= high[1]:
                continue
            rows, columns = np.ogrid[low[0] : high[0], low[1] : high[1]]
            away = np.hypot(rows + 0.5 - y, columns + 0.5 - x)
            block = np.s_[low[0] : high[0], low[1] : high[1]]
            room = np.maximum(away * self.resolution - radius, 0.0).astype(np.float32)
            clearance[block] = np.minimum(clearance[block], room)
            free[block] &= away > reach
            blocks.append((low, high))
        for low, high in blocks:
            grid._find_moves(low, high)
        return grid

    def update_cells(self, map: OccupancyMap, low: Cell, high: Cell) -> "Grid":  # noqa: A002
        """Return the grid of an edited map: cells of the *map* from ``low`` up to, but not including, ``high`` differ.

        The result equals ``grown`` of the new map, but only the edit's surroundings are computed again.

        Raises:
            ValueError: the grid has discs (change the grid without discs, then add them), or the map's shape differs.
        """
        if len(self.discs):
            raise ValueError("expected a grid without discs; change the grid first, then add the discs")
        if (map.shape[0] * self.factor, map.shape[1] * self.factor) != self.shape:
            raise ValueError(f"expected a map of {self.shape[0] // self.factor} rows, got {map.shape[0]}")
        f = self.factor
        low, high = self._clip((low[0] * f, low[1] * f), (high[0] * f, high[1] * f))
        if low[0] >= high[0] or low[1] >= high[1]:
            return self
        solid = self.solid.copy()
        edit = map.cells[low[0] // f : high[0] // f, low[1] // f : high[1] // f]
        solid[low[0] : high[0], low[1] : high[1]] = _solid(edit, f, self.unknown_free)

        # clearance may change only in cells that are at least as near to the edit as to their nearest solid point
        rows, columns = self.shape
        down = np.maximum(np.maximum(low[0] - np.arange(rows), np.arange(rows) + 1 - high[0]) - 0.5, 0.0)
        across = np.maximum(np.maximum(low[1] - np.arange(columns), np.arange(columns) + 1 - high[1]) - 0.5, 0.0)
        reach = (self.clearance / self.resolution + 1e-3) ** 2
        touched = down[:, None] ** 2 + across[None, :] ** 2 <= reach
        in_rows, in_columns = np.flatnonzero(touched.any(axis=1)), np.flatnonzero(touched.any(axis=0))
        first = (int(in_rows[0]), int(in_columns[0]))
        beyond = (int(in_rows[-1]) + 1, int(in_columns[-1]) + 1)
        block = np.s_[first[0] : beyond[0], first[1] : beyond[1]]
        clearance, free, moves = self.clearance.copy(), self.free.copy(), self.moves.copy()
        clearance[block] = clearance_of(solid, self.resolution, first, beyond)
        free[block] = clearance[block] > np.float32(self.radius)
        grid = replace(self, solid=solid, clearance=clearance, free=free, moves=moves)
        grid._find_moves(*self._clip((first[0] - 1, first[1] - 1), (beyond[0] + 1, beyond[1] + 1)))
        return grid

    def _clip(self, low: Cell, high: Cell) -> tuple[Cell, Cell]:
        rows, columns = self.shape
        return (max(low[0], 0), max(low[1], 0)), (min(high[0], rows), min(high[1], columns))

    def _find_moves(self, low: Cell, high: Cell) -> None:
        radius = self.radius / self.resolution
        free = self.free.view(np.uint8)
        args = (self.solid, self.clearance, self.resolution, self.discs, radius)
        find_moves(free, *args, *low, *high, self.moves)


def refinement(map: OccupancyMap, resolution: float) -> int:  # noqa: A002
    """Return into how many cells along each axis a cell of the map is divided: each has at most ``resolution`` [m]."""
    return max(1, ceil(map.resolution / resolution - 1e-9))


def _solid(cells: NDArray[np.uint8], factor: int, unknown_free: bool) -> NDArray[np.uint8]:
    solid = (cells != FREE) & (cells != UNKNOWN) if unknown_free else cells != FREE
    return np.ascontiguousarray(solid.repeat(factor, axis=0).repeat(factor, axis=1).astype(np.uint8))
