"""The cells of a lattice that a disc reaches into, and a test whether walls are near a line.

Compiled: the cells are computed for every point of a braking path in each tick, and the line test runs for all cells
that robots could want without hearing each other.
"""

from math import ceil, floor

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit("i8[::1](f8[:, ::1], f8, f8, f8, f8, f8, f8, f8, f8, i8, i8)", cache=True)
def _cells_under(
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
    cells: NDArray[np.int64] = _cells_under(points, radius, x0, y0, cos_o, sin_o, along, up, side, rows, columns)
    return cells
