"""What cells of a lattice a disc is in: compiled, since it is asked of every point of a braking path, each tick."""

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
    """List the cells of a lattice that a disc reaches into at any of some points ((n, 2), m); some come repeatedly.

    ``x0``, ``y0`` [m] and the cosine and sine of its yaw are the pose of the map's frame; ``along`` and ``up`` [m] in
    it is the lattice's corner, ``side`` [m] a cell's.
    """
    cells: NDArray[np.int64] = _cells_under(points, radius, x0, y0, cos_o, sin_o, along, up, side, rows, columns)
    return cells
