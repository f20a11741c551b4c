"""Where wheels lead, what cells a body is in there, and how near it comes to boxes: compiled, as asked many times a tick."""

from math import ceil, cos, floor, hypot, sin
from typing import Final

import numpy as np
from numba import njit
from numpy.typing import NDArray

Boxes = NDArray[np.float64]  # (n, 4): low x, low y, high x, high y [m]
STRIDE: Final = 0.05  # m, between two points tried on a line
LONGEST: Final = 400  # ticks, of a braking path


@njit("f8(f8[:, ::1], f8, f8)", cache=True)
def _gap(boxes: Boxes, x: float, y: float) -> float:
    least = np.inf
    for k in range(boxes.shape[0]):
        dx = max(boxes[k, 0] - x, x - boxes[k, 2], 0.0)
        dy = max(boxes[k, 1] - y, y - boxes[k, 3], 0.0)
        least = min(least, hypot(dx, dy))
    return least


@njit("f8(f8[:, ::1], f8, f8, f8, f8)", cache=True)
def _line_room(boxes: Boxes, x0: float, y0: float, x1: float, y1: float) -> float:
    count = int(hypot(x1 - x0, y1 - y0) / STRIDE) + 1
    least = np.inf
    for k in range(1, count + 1):
        least = min(least, _gap(boxes, x0 + (x1 - x0) * k / count, y0 + (y1 - y0) * k / count))
    return least


@njit("f8(f8[:, ::1], f8, f8, f8, f8, f8, f8, f8, f8, f8, f8, i8)", cache=True)
def _path_room(
    boxes: Boxes,
    x: float,
    y: float,
    yaw: float,
    left_now: float,
    right_now: float,
    left: float,
    right: float,
    track_width: float,
    most: float,
    dt: float,
    ticks: int,
) -> float:
    least = _gap(boxes, x, y)
    step = 0
    while step < ticks or left_now != 0.0 or right_now != 0.0:
        want_left, want_right = (left, right) if step < ticks else (0.0, 0.0)
        left_now = min(left_now + most, max(left_now - most, want_left))
        right_now = min(right_now + most, max(right_now - most, want_right))
        half = (right_now - left_now) / track_width * dt / 2
        reach = (left_now + right_now) / 2 * dt
        x += reach * cos(yaw + half)
        y += reach * sin(yaw + half)
        yaw += 2 * half
        least = min(least, _gap(boxes, x, y))
        step += 1
    return least


@njit("f8[:, ::1](f8, f8, f8, f8, f8, f8, f8, f8)", cache=True)
def _braking_points(
    x: float, y: float, yaw: float, left: float, right: float, track_width: float, most: float, dt: float
) -> NDArray[np.float64]:
    points = np.empty((LONGEST, 2))
    count = 0
    while (left != 0.0 or right != 0.0) and count < LONGEST:
        left -= min(most, max(-most, left))
        right -= min(most, max(-most, right))
        half = (right - left) / track_width * dt / 2
        reach = (left + right) / 2 * dt
        x += reach * cos(yaw + half)
        y += reach * sin(yaw + half)
        yaw += 2 * half
        points[count] = x, y
        count += 1
    return points[:count].copy()


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


def line_room(boxes: Boxes, x0: float, y0: float, x1: float, y1: float) -> float:
    """Give the least distance [m] to a box on the straight way from one point to another, its start left out."""
    room: float = _line_room(boxes, x0, y0, x1, y1)
    return room


def path_room(
    boxes: Boxes,
    x: float,
    y: float,
    yaw: float,
    left_now: float,
    right_now: float,
    left: float,
    right: float,
    track_width: float,
    most: float,
    dt: float,
    ticks: int,
) -> float:
    """Give the least distance [m] to a box, the wheels told ``left`` and ``right`` for some ticks and to stop then.

    ``most`` [m/s] is the change of a rim speed within one step of ``dt`` [s].
    """
    room: float = _path_room(boxes, x, y, yaw, left_now, right_now, left, right, track_width, most, dt, ticks)
    return room


def braking_points(
    x: float, y: float, yaw: float, left: float, right: float, track_width: float, acceleration: float, dt: float
) -> NDArray[np.float64]:
    """Give where the centre would be ((n, 2), m) at each step until the wheels stand."""
    points: NDArray[np.float64] = _braking_points(x, y, yaw, left, right, track_width, acceleration * dt, dt)
    return points
