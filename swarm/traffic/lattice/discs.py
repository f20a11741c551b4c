"""Discs over the cells of a lattice: which cells one reaches into, in which it fits, and where it passes.

Compiled: the cells under a disc are computed for every point of a braking path in each tick, the line test runs for
all cells that robots could want without hearing each other, and learned floors change often.
"""

from math import ceil, floor

import numpy as np
from numba import njit
from numpy.typing import NDArray

STANDS, RIGHT, UP, OPEN = range(4)  # of the flags of a cell: see ``measure``


@njit("i8[::1](f8[:, ::1], f8, f8, f8, f8, f8, f8, f8, f8, i8, i8)", cache=True)
def cells_under(
    points: NDArray[np.float64],
    radius: float,
    x0: float,
    y0: float,
    cos_o: float,
    sin_o: float,
    along: float,
    up: float,
    side: float,
    rows: int,
    columns: int,
) -> NDArray[np.int64]:
    """List the cells of a lattice that a disc reaches into at any of some points ((n, 2), m); cells may repeat.

    The pose of the map's frame is ``x0``, ``y0`` [m] and the cosine and sine of its yaw. In this frame the corner of
    the lattice is ``along``, ``up`` [m]; ``side`` [m] is the side of a cell.
    """
    reach = radius / side
    found = np.empty(points.shape[0] * (ceil(2 * reach) + 2) ** 2, np.int64)
    count = 0
    for k in range(points.shape[0]):
        dx, dy = points[k, 0] - x0, points[k, 1] - y0
        u, v = (cos_o * dx + sin_o * dy - along) / side, (cos_o * dy - sin_o * dx - up) / side
        for row in range(max(0, floor(v - reach)), min(rows, ceil(v + reach))):
            off_v = max(row - v, v - row - 1, 0.0)
            for column in range(max(0, floor(u - reach)), min(columns, ceil(u + reach))):
                off_u = max(column - u, u - column - 1, 0.0)
                if off_u * off_u + off_v * off_v < reach * reach:
                    found[count] = row * columns + column
                    count += 1
    return found[:count].copy()


@njit("b1(b1[:, ::1], f8, f8, f8, f8, f8, f8, f8, f8, f8, f8, i8)", cache=True)
def line_is_clear(
    solid: NDArray[np.bool_],
    resolution: float,
    x0: float,
    y0: float,
    cos_o: float,
    sin_o: float,
    ax: float,
    ay: float,
    bx: float,
    by: float,
    radius: float,
    count: int,
) -> bool:
    """Return True if a disc is clear of walls at each of ``count - 1`` points between two points [m].

    ``solid`` is the fine map with a rim one cell wide, ``resolution`` [m] the side of its cells. The pose of the map's
    frame is ``x0``, ``y0`` [m] and the cosine and sine of its yaw.
    """
    reach = radius / resolution
    for k in range(1, count):
        dx, dy = ax + (bx - ax) * k / count - x0, ay + (by - ay) * k / count - y0
        u, v = (cos_o * dx + sin_o * dy) / resolution, (cos_o * dy - sin_o * dx) / resolution
        for row in range(max(floor(v - reach), -1), min(ceil(v + reach), solid.shape[0] - 1)):
            up = max(row - v, v - row - 1, 0.0)
            for column in range(max(floor(u - reach), -1), min(ceil(u + reach), solid.shape[1] - 1)):
                along = max(column - u, u - column - 1, 0.0)
                if along * along + up * up < reach * reach and solid[row + 1, column + 1]:
                    return False
    return True


@njit("b1(b1[:, ::1], f8, f8, f8, f8, f8, f8)", cache=True)
def _is_clear(
    solid: NDArray[np.bool_], x: float, y: float, dx: float, dy: float, radius: float, resolution: float
) -> bool:
    """Return True if a disc stays clear from (x, y) to ``(dx, dy)`` away [m]; dx or dy is zero.

    The line and a fine cell are both boxes along the axes, so their distance is exact.
    """
    rows, columns = solid.shape[0] - 2, solid.shape[1] - 2
    low, left = floor((y - radius) / resolution), floor((x - radius) / resolution)
    limit = radius * radius - 1e-12
    for row in range(low, low + ceil((dy + 2 * radius) / resolution) + 2):
        up = max(row * resolution - y - dy, y - (row + 1) * resolution, 0.0)
        for column in range(left, left + ceil((dx + 2 * radius) / resolution) + 2):
            across = max(column * resolution - x - dx, x - (column + 1) * resolution, 0.0)
            near = up * up + across * across < limit
            if near and solid[min(max(row, -1), rows) + 1, min(max(column, -1), columns) + 1]:
                return False
    return True


@njit("b1(b1[:, ::1], f8, f8, f8, f8)", cache=True)
def _is_open(solid: NDArray[np.bool_], x: float, y: float, side: float, resolution: float) -> bool:
    """Return True if the square with the low corner (x, y) [m] is all on the map and nothing solid lies in it."""
    rows, columns = solid.shape
    for row in range(floor(y / resolution + 1e-6) + 1, ceil((y + side) / resolution - 1e-6) + 1):
        for column in range(floor(x / resolution + 1e-6) + 1, ceil((x + side) / resolution - 1e-6) + 1):
            if solid[min(max(row, 0), rows - 1), min(max(column, 0), columns - 1)]:
                return False
    return True


@njit("void(b1[:, ::1], f8, f8, f8, f8, f8, i8, i8, i8, i8, b1[:, :, ::1])", cache=True)
def compute_flags(
    solid: NDArray[np.bool_],  # fine cells, with a solid rim around them
    resolution: float,  # m, side of a fine cell
    along: float,  # m, corner of the lattice
    up: float,
    side: float,  # m, of a cell
    radius: float,  # m, of the disc
    first_row: int,
    first_column: int,
    beyond_row: int,
    beyond_column: int,
    flags: NDArray[np.bool_],  # (4, rows, columns), written
) -> None:
    """Compute for each cell of a block if the disc fits at its centre (STANDS) and passes right (RIGHT) and up (UP).

    OPEN means that no part of the cell is solid.
    """
    for row in range(first_row, beyond_row):
        y = up + (row + 0.5) * side
        for column in range(first_column, beyond_column):
            x = along + (column + 0.5) * side
            flags[STANDS, row, column] = _is_clear(solid, x, y, 0.0, 0.0, radius, resolution)
            flags[RIGHT, row, column] = _is_clear(solid, x, y, side, 0.0, radius, resolution)
            flags[UP, row, column] = _is_clear(solid, x, y, 0.0, side, radius, resolution)
            flags[OPEN, row, column] = _is_open(solid, along + column * side, up + row * side, side, resolution)


def list_nearest_flagged(flags: NDArray[np.bool_], row: float, column: float) -> list[int]:
    """List the set ones of ``flags`` whose middles are nearest to a place (row, column), and those hardly farther."""
    rows, columns = np.nonzero(flags)
    away = np.hypot(rows + 0.5 - row, columns + 0.5 - column)
    near = np.flatnonzero(away <= away.min(initial=np.inf) + 1e-6)
    return (rows[near] * flags.shape[1] + columns[near]).tolist()  # type: ignore[no-any-return]
