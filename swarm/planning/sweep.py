"""Exact tests whether a disc can move along a straight line between the solid squares of a grid.

Coordinates are in cells: the square of cell (row, column) is [column, column + 1] x [row, row + 1]. Everything outside
the array is solid. If the disc is too near something at the start of the line already, it may move as long as it comes
no nearer to anything.
"""

from math import floor, hypot

import numpy as np
from numba import boolean, float32, float64, int64, njit, uint8, void
from numpy.typing import NDArray

from swarm.planning.steps import COLUMN_STEP, ROW_STEP

TOLERANCE = 1e-9  # cells: more than the sum of rounding errors
ROUGH = 1e-3  # cells: more than the rounding error of a float32 clearance

Solid = NDArray[np.uint8]
Metres = NDArray[np.float32]
Discs = NDArray[np.float64]  # (count, 3): x, y, sum of the disc's and the robot's radius; all in cells


@njit(float64(float64, float64, float64, float64, float64, float64), cache=True, error_model="numpy")
def point_segment(x: float, y: float, ax: float, ay: float, bx: float, by: float) -> float:
    """Return the distance from a point to a segment."""
    dx, dy = bx - ax, by - ay
    square = dx * dx + dy * dy
    t = ((x - ax) * dx + (y - ay) * dy) / square if square > 0.0 else 0.0
    t = min(1.0, max(0.0, t))
    return hypot(ax + t * dx - x, ay + t * dy - y)


@njit(float64(float64, float64, float64, float64), cache=True, error_model="numpy")
def point_square(x: float, y: float, column: float, row: float) -> float:
    """Return the distance from a point to a cell's square."""
    dx = max(column - x, 0.0, x - column - 1.0)
    dy = max(row - y, 0.0, y - row - 1.0)
    return hypot(dx, dy)


@njit(boolean(float64, float64, float64, float64, float64, float64), cache=True, error_model="numpy")
def crosses(ax: float, ay: float, bx: float, by: float, column: float, row: float) -> bool:
    """Return True if a segment meets a cell's square (separating axes: those of the square, the segment's normal)."""
    if max(ax, bx) < column or min(ax, bx) > column + 1.0 or max(ay, by) < row or min(ay, by) > row + 1.0:
        return False
    dx, dy = bx - ax, by - ay
    middle = dx * (row + 0.5 - ay) - dy * (column + 0.5 - ax)
    return abs(middle) <= 0.5 * (abs(dx) + abs(dy))


@njit(float64(float64, float64, float64, float64, float64, float64), cache=True, error_model="numpy")
def segment_square(ax: float, ay: float, bx: float, by: float, column: float, row: float) -> float:
    """Return the distance from a segment to a cell's square."""
    if crosses(ax, ay, bx, by, column, row):
        return 0.0
    near = min(point_square(ax, ay, column, row), point_square(bx, by, column, row))
    for k in range(4):
        near = min(near, point_segment(column + (k & 1), row + (k >> 1), ax, ay, bx, by))
    return near


@njit(
    boolean(uint8[:, ::1], float32[:, ::1], float64, float64[:, ::1], float64, float64, float64, float64, float64),
    cache=True,
    error_model="numpy",
)
def sweep(
    solid: Solid,
    clearance: Metres,
    resolution: float,
    discs: Discs,
    ax: float,
    ay: float,
    bx: float,
    by: float,
    radius: float,
) -> bool:
    """Return True if a disc of ``radius`` cells can move from a to b [cells]."""
    rows, columns = solid.shape
    if not (0.0 <= ax < columns and 0.0 <= ay < rows and 0.0 <= bx < columns and 0.0 <= by < rows):
        return False
    for k in range(discs.shape[0]):
        x, y = discs[k, 0], discs[k, 1]
        # ``radius`` applies to walls only: ``discs`` already include the robot's own radius
        if point_segment(x, y, ax, ay, bx, by) < min(discs[k, 2], hypot(x - ax, y - ay)) - TOLERANCE:
            return False
    radius = max(radius, ROUGH)  # a robot of radius 0 may not pass through walls either
    keep = radius
    if clearance[int(ay), int(ax)] / resolution < radius + 1.0:
        for r in range(floor(ay - radius), floor(ay + radius) + 1):
            for c in range(floor(ax - radius), floor(ax + radius) + 1):
                if not (0 <= r < rows and 0 <= c < columns) or solid[r, c]:
                    keep = min(keep, point_square(ax, ay, c, r))
    keep -= TOLERANCE
    if keep <= 0.0:
        return False
    length = hypot(bx - ax, by - ay)
    done = 0.0
    while True:
        t = done / length if length > 0.0 else 0.0
        px, py = ax + t * (bx - ax), ay + t * (by - ay)
        row, column = min(int(py), rows - 1), min(int(px), columns - 1)
        spare = clearance[row, column] / resolution - hypot(px - column - 0.5, py - row - 0.5) - radius - ROUGH
        if spare > 0.0:  # the disc touches nothing within the next ``spare`` cells
            done += max(spare, ROUGH)
            if done >= length:
                return True
            continue
        onward = min(done + 1.0, length)
        t = onward / length if length > 0.0 else 0.0
        qx, qy = ax + t * (bx - ax), ay + t * (by - ay)
        for r in range(floor(min(py, qy) - radius), floor(max(py, qy) + radius) + 1):
            for c in range(floor(min(px, qx) - radius), floor(max(px, qx) + radius) + 1):
                if 0 <= r < rows and 0 <= c < columns and solid[r, c] == 0:
                    continue
                if segment_square(px, py, qx, qy, c, r) < keep:
                    return False
        done = onward
        if done >= length:
            return True


@njit(
    void(
        uint8[:, ::1],
        uint8[:, ::1],
        float32[:, ::1],
        float64,
        float64[:, ::1],
        float64,
        int64,
        int64,
        int64,
        int64,
        uint8[:, ::1],
    ),
    cache=True,
    error_model="numpy",
)
def find_moves(
    free: Solid,
    solid: Solid,
    clearance: Metres,
    resolution: float,
    discs: Discs,
    radius: float,
    r0: int,
    c0: int,
    r1: int,
    c1: int,
    moves: Solid,
) -> None:
    """Fill ``moves`` in rows [r0, r1) and columns [c0, c1): bit k is set where a step in direction k is legal.

    A step is legal if both cells are free, it cuts no corner, and the disc touches nothing between the two centres.
    """
    rows, columns = free.shape
    # if two centres are at most sqrt 2 apart and each is ``d`` from a corner, their segment is sqrt(d^2 - 1/2) from it
    safe = (radius * radius + 0.5) ** 0.5 + ROUGH
    for row in range(r0, r1):
        for column in range(c0, c1):
            mask = 0
            if free[row, column]:
                for k in range(8):
                    r, c = row + ROW_STEP[k], column + COLUMN_STEP[k]
                    if not (0 <= r < rows and 0 <= c < columns) or not free[r, c]:
                        continue
                    if k & 1 and not (free[row, c] and free[r, column]):
                        continue
                    if min(clearance[row, column], clearance[r, c]) < safe * resolution:
                        # always test from the same end, so that a step and its reverse agree
                        x, y, u, v = column + 0.5, row + 0.5, c + 0.5, r + 0.5
                        if k >= 4:
                            x, y, u, v = u, v, x, y
                        if not sweep(solid, clearance, resolution, discs, x, y, u, v, radius):
                            continue
                    mask |= 1 << k
            moves[row, column] = mask


@njit(
    int64[::1](
        uint8[:, ::1],
        float32[:, ::1],
        float64,
        float64[:, ::1],
        float64[:, ::1],
        float64[::1],
        float64,
        float64,
        int64,
    ),
    cache=True,
    error_model="numpy",
)
def pull_polyline(
    solid: Solid,
    clearance: Metres,
    resolution: float,
    discs: Discs,
    points: NDArray[np.float64],
    room: NDArray[np.float64],
    radius: float,
    comfort: float,
    ahead: int,
) -> NDArray[np.int64]:
    """Return the indices of the shortest free polyline from the first to the last of ``points`` (n, 2), in their order.

    ``room[i]`` is the least clearance of the given path between points i and i + 1. A shortcut keeps the least of the
    clearances that it replaces, limited to ``radius`` .. ``comfort``. One shortcut skips at most ``ahead`` points. All
    lengths are in cells.
    """
    count = points.shape[0]
    best = np.full(count, np.inf)
    back = np.zeros(count, np.int64)
    keep = np.empty(count, np.float64)
    best[0] = 0.0
    for j in range(1, count):
        least = comfort
        first = max(0, j - ahead)
        for i in range(j - 1, first - 1, -1):
            least = min(least, room[i])
            keep[i] = max(radius, least)
        for i in range(first, j):  # the farthest first: a nearer point rarely gives a shorter polyline
            ax, ay, bx, by = points[i, 0], points[i, 1], points[j, 0], points[j, 1]
            total = best[i] + hypot(bx - ax, by - ay) + 1e-6  # 1e-6: of equal lengths, fewer points win
            if total < best[j] and (i == j - 1 or sweep(solid, clearance, resolution, discs, ax, ay, bx, by, keep[i])):
                best[j] = total
                back[j] = i
    steps = 1
    j = count - 1
    while j > 0:
        j = back[j]
        steps += 1
    chosen = np.empty(steps, np.int64)
    j = count - 1
    for k in range(steps - 1, -1, -1):
        chosen[k] = j
        j = back[j]
    return chosen
