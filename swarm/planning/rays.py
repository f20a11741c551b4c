"""Rays over a grid's solid cells: what a sensor would read from the map alone, and which cells a ray has passed.

A ray visits cells one boundary after the other (Amanatides and Woo, Eurographics 1987), so distances are exact.
"""

from collections.abc import Sequence
from functools import lru_cache
from math import cos, floor, inf, pi, sin

import numpy as np
from numba import njit
from numpy.typing import NDArray

from swarm.geometry import Pose
from swarm.planning.grid import Grid


@njit("Tuple((i8, i8, f8, f8))(f8, f8)", cache=True)
def _axis(at: float, along: float) -> tuple[int, int, float, float]:
    """Return a ray's start along one axis: its cell, its step (-1 or 1), the distances to the first boundary and on."""
    cell = floor(at)
    if along == 0.0:
        return cell, -1, inf, inf
    return cell, 1 if along > 0 else -1, (cell + (along > 0) - at) / along, abs(1 / along)


@njit("f8(u1[:, ::1], f8, f8, f8, f8, f8, b1)", cache=True)
def first_solid(
    solid: NDArray[np.uint8], x: float, y: float, dx: float, dy: float, reach: float, walled: bool
) -> float:
    """Return the distance [cells], at most ``reach``, from (x, y) along a unit direction to the first solid cell.

    Everything outside the grid is solid if ``walled``, else free.
    """
    rows, columns = solid.shape
    column, step_x, next_x, wide_x = _axis(x, dx)
    row, step_y, next_y, wide_y = _axis(y, dy)
    gone = 0.0
    while gone < reach:
        inside = 0 <= row < rows and 0 <= column < columns
        if solid[row, column] if inside else walled:
            return gone
        if next_x < next_y:
            gone, next_x, column = next_x, next_x + wide_x, column + step_x
        else:
            gone, next_y, row = next_y, next_y + wide_y, row + step_y
    return reach


@njit("void(i1[:, ::1], f8, f8, f8, f8, f8, f8, b1, i8, i8, i8, i8)", cache=True)
def note_ray(
    odds: NDArray[np.int8],
    x: float,
    y: float,
    heading: float,
    length: float,
    nearer: float,
    farther: float,
    hit: bool,
    gain: int,
    loss: int,
    most: int,
    solid: int,
) -> None:
    """Enter a ray of ``length`` [cells] into ``odds``: passed cells become less likely solid, the hit cell more likely.

    A noisy ray must not make a second wall beside a known one. So if the cell at the ray's end is not known to be
    solid, the hit counts for a known solid cell up to ``nearer`` [cells] before the end or ``farther`` behind it.
    """
    rows, columns = odds.shape
    dx, dy = cos(heading), sin(heading)
    column, step_x, next_x, wide_x = _axis(x, dx)
    row, step_y, next_y, wide_y = _axis(y, dy)
    end_column, end_row = floor(x + (length + 0.01) * dx), floor(y + (length + 0.01) * dy)
    gone = 0.0
    inside = 0 <= end_row < rows and 0 <= end_column < columns
    settled = not hit or (inside and odds[end_row, end_column] >= solid)
    while gone < length + (0.0 if settled else farther):
        there = 0 <= row < rows and 0 <= column < columns
        before_end = gone < length - 0.7 and (column != end_column or row != end_row)
        leaves = min(next_x, next_y)
        if not settled and there and leaves >= length - nearer and odds[row, column] >= solid:
            end_row, end_column, inside = row, column, True
            break
        if before_end and there:
            odds[row, column] = max(-most, odds[row, column] - loss)
        elif settled:
            break
        gone = leaves
        if next_x < next_y:
            next_x, column = next_x + wide_x, column + step_x
        else:
            next_y, row = next_y + wide_y, row + step_y
    if hit and inside:
        odds[end_row, end_column] = min(most, odds[end_row, end_column] + gain)


@njit("f8[::1](u1[:, ::1], f8, f8, f8, f8[::1], f8)", cache=True)
def _cast_each(
    solid: NDArray[np.uint8], x: float, y: float, yaw: float, angles: NDArray[np.float64], reach: float
) -> NDArray[np.float64]:
    found = np.empty(angles.size)
    for k in range(angles.size):
        heading = (yaw + angles[k] + pi) % (2 * pi) - pi
        heading = pi if heading <= -pi else heading
        found[k] = first_solid(solid, x, y, cos(heading), sin(heading), reach, True)
    return found


@lru_cache
def _as_array(angles: tuple[float, ...]) -> NDArray[np.float64]:
    return np.array(angles, np.float64)


def distances_on_map(grid: Grid, pose: Pose, angles: Sequence[float], reach: float) -> NDArray[np.float64]:
    """Return the distances [m], 0..reach, from the centre to the map's first solid cells at body ``angles`` [rad]."""
    x, y = grid.to_cells(pose.x, pose.y)
    yaw = pose.yaw - grid.origin.yaw
    found: NDArray[np.float64] = _cast_each(grid.solid, x, y, yaw, _as_array(tuple(angles)), reach / grid.resolution)
    return found * grid.resolution


def free_on_map(grid: Grid, pose: Pose, radius: float, reach: float, angles: Sequence[float]) -> list[float]:
    """Return the distances [m], 0..reach, of ``distances_on_map`` from the edge of a robot of this radius [m]."""
    found: list[float] = (distances_on_map(grid, pose, angles, radius + reach) - radius).tolist()
    return found


def least_free_on_map(
    grid: Grid, pose: Pose, error: float, yaw_error: float, radius: float, reach: float, angles: Sequence[float]
) -> list[float]:
    """Return the least distances [m] that ``free_on_map`` gives for any of the poses that the robot may have.

    These are the pose, and those that are off by ``error`` [m] along the map's axes, each turned by up to
    ``yaw_error`` [rad] to a side.
    """
    places = ((0.0, 0.0), (error, 0.0), (-error, 0.0), (0.0, error), (0.0, -error))
    tried = [
        distances_on_map(grid, Pose(pose.x + dx, pose.y + dy, pose.yaw + turn), angles, radius + reach)
        for dx, dy in places
        for turn in (-yaw_error, 0.0, yaw_error)
    ]
    found: list[float] = (np.min(tried, axis=0) - radius).tolist()
    return found
