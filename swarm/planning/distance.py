"""Exact Euclidean distance to the nearest solid cell.

Two passes (Felzenszwalb & Huttenlocher 2012; the integer form of the second is Meijster, Roerdink & Hesselink 2000).
Distances run from a cell's centre to the nearest *point* of a solid square, so that they are what a disc would touch;
in half cells they are integers, hence exact.
"""

import numpy as np
from numba import int64, njit, uint8
from numpy.typing import NDArray

FAR = 1 << 20  # half cells, more than any map is wide


@njit(int64[:, ::1](uint8[:, ::1]), cache=True, error_model="numpy")
def squared_half_cells(solid: NDArray[np.uint8]) -> NDArray[np.int64]:
    """Return the squared distance of every centre to the nearest solid square [half cells squared].

    ``solid`` is (rows, columns), 1 where solid; without any, every entry is at least ``FAR`` squared.
    """
    rows, columns = solid.shape
    squared = np.empty((rows, columns), np.int64)
    gap = np.full((rows, columns), FAR, np.int64)  # whole cells to the nearest solid one in the same column
    for row in range(rows):
        for column in range(columns):
            if solid[row, column]:
                gap[row, column] = 0
            elif row > 0 and gap[row - 1, column] < FAR:
                gap[row, column] = gap[row - 1, column] + 1
    for row in range(rows - 2, -1, -1):
        for column in range(columns):
            below = gap[row + 1, column] + 1
            gap[row, column] = min(below, gap[row, column])

    vertical = np.empty(columns, np.int64)
    value = np.empty(columns + 1, np.int64)
    site = np.empty(columns + 1, np.int64)
    begin = np.empty(columns + 1, np.int64)
    for row in range(rows):
        for column in range(columns):
            cells = gap[row, column]
            half = 2 * cells - 1 if cells > 0 else 0
            vertical[column] = half * half
        # the squares of a column reach from its left edge to its right one: sites are the edges between columns
        value[0] = vertical[0]
        value[columns] = vertical[columns - 1]
        for edge in range(1, columns):
            value[edge] = min(vertical[edge - 1], vertical[edge])
        last = -1
        for edge in range(columns + 1):
            while last >= 0:
                x = 2 * begin[last] + 1
                old, new = x - 2 * site[last], x - 2 * edge
                if old * old + value[site[last]] > new * new + value[edge]:
                    last -= 1
                else:
                    break
            if last < 0:
                last = 0
                site[0] = edge
                begin[0] = 0
                continue
            other = site[last]
            # smallest column c where (2c+1-2 edge)^2 + value[edge] <= (2c+1-2 other)^2 + value[other]
            width = 4 * (edge - other)
            rise = value[edge] - value[other] + 4 * (edge * edge - other * other)
            first = -((width - rise) // (2 * width))
            if first < columns:
                last += 1
                site[last] = edge
                begin[last] = first
        for column in range(columns - 1, -1, -1):
            while last > 0 and column < begin[last]:
                last -= 1
            across = 2 * column + 1 - 2 * site[last]
            squared[row, column] = min(vertical[column], across * across + value[site[last]])
    return squared


def clearance_of(
    solid: NDArray[np.uint8], resolution: float, low: tuple[int, int], high: tuple[int, int]
) -> NDArray[np.float32]:
    """Measure the block of cells from ``low`` up to and without ``high`` [m]; all outside ``solid`` is solid too.

    Looks only as far around the block as its own answers reach, so that a small block costs little.
    """
    rows, columns = solid.shape
    reach = 8
    while True:
        r0, c0 = max(low[0] - reach, -1), max(low[1] - reach, -1)
        r1, c1 = min(high[0] + reach, rows + 1), min(high[1] + reach, columns + 1)
        window = np.ones((r1 - r0, c1 - c0), np.uint8)
        inner = solid[max(r0, 0) : min(r1, rows), max(c0, 0) : min(c1, columns)]
        top, left = max(r0, 0) - r0, max(c0, 0) - c0
        window[top : top + inner.shape[0], left : left + inner.shape[1]] = inner
        squared = squared_half_cells(window)[low[0] - r0 : high[0] - r0, low[1] - c0 : high[1] - c0]
        whole = r0 == c0 == -1 and r1 == rows + 1 and c1 == columns + 1
        # a solid cell that the window missed lies more than 2 * reach half cells away
        if whole or squared.max(initial=0) <= (2 * reach) ** 2:
            return np.sqrt(squared).astype(np.float32) * np.float32(resolution / 2)
        reach *= 2
