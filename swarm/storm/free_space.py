"""Ways over the drawing of a floor: where a disc can be moved between its solid squares. No lattice, no planner."""

from collections import deque
from math import floor
from typing import Final

import numpy as np
from numpy.typing import NDArray

from swarm.geometry import from_frame, to_frame
from swarm.maps.occupancy import FREE, OccupancyMap, Point

FINE: Final = 0.05  # m, side of a pixel
SPARE: Final = 0.05  # m, beside a body, for a way to count: narrower passages are closed

Grid = NDArray[np.bool_]  # [row, column], row 0 at the bottom; True is solid


def gaps(solid: Grid, side: float, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the distance [m] from each point (n, 2) to the nearest solid square of a ``side`` [m].

    A square with solid squares all around it is the nearest one only of points inside it.
    """
    high, wide = solid.shape
    around = np.pad(solid, 1)
    inner = np.logical_and.reduce([around[up : up + high, to : to + wide] for up in range(3) for to in range(3)])
    rows, columns = np.nonzero(solid & ~inner)
    at = np.floor(points / side).astype(np.int64)
    on = ((at >= 0) & (at < (wide, high))).all(axis=1)
    least = np.full(len(points), np.inf)
    least[on] = np.where(inner[at[on, 1], at[on, 0]], 0.0, np.inf)
    for x, y in zip(columns * side, rows * side, strict=True):
        dx = np.maximum(np.maximum(x - points[:, 0], points[:, 0] - x - side), 0.0)
        dy = np.maximum(np.maximum(y - points[:, 1], points[:, 1] - y - side), 0.0)
        least = np.minimum(least, np.hypot(dx, dy))
    return least


def label_spaces(solid: Grid, side: float, radius: float) -> NDArray[np.int64]:
    """Return for each pixel the piece of floor that a disc's centre can be moved in; 0: the disc does not fit."""
    shape = tuple(floor(size * side / FINE + 1e-6) for size in solid.shape)
    ys, xs = np.mgrid[: shape[0], : shape[1]]
    fits = gaps(solid, side, (np.stack([xs.ravel(), ys.ravel()], 1) + 0.5) * FINE).reshape(shape) >= radius
    pieces = np.zeros(shape, np.int64)
    for row, column in np.argwhere(fits).tolist():
        if not pieces[row, column]:
            pieces[steps(fits, (row, column)) >= 0] = pieces.max() + 1
    return pieces


def steps(fits: Grid, start: tuple[int, int]) -> NDArray[np.int64]:
    """Return for each pixel the number of steps to it from a start; -1: no way leads there."""
    found = np.full(fits.shape, -1)
    found[start] = 0
    ready = deque([start])
    while ready:
        row, column = ready.popleft()
        for near in ((row + 1, column), (row - 1, column), (row, column + 1), (row, column - 1)):
            if 0 <= near[0] < fits.shape[0] and 0 <= near[1] < fits.shape[1] and fits[near] and found[near] < 0:
                found[near] = found[row, column] + 1
                ready.append(near)
    return found


def room(known: OccupancyMap, radius: float, here: Point) -> list[Point]:
    """List the places [m, map frame] that a disc can be moved to between the squares of a floor, a pixel apart."""
    pieces = label_spaces(known.cells != FREE, known.resolution, radius)
    x, y = to_frame(known.origin, *here)
    row, column = floor(y / FINE), floor(x / FINE)
    if not (0 <= row < pieces.shape[0] and 0 <= column < pieces.shape[1] and pieces[row, column]):
        return []
    inside = np.argwhere(pieces == pieces[row, column]).tolist()
    return [from_frame(known.origin, (x + 0.5) * FINE, (y + 0.5) * FINE) for y, x in inside]
