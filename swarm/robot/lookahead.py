"""Where the wheels would take the robot: under a command for a while, then under the brake; and how near a wall.

Compiled, since the supervisor asks several times a tick.
"""

from math import cos, floor, hypot, sin
from typing import Final

import numpy as np
from numba import njit
from numpy.typing import NDArray

from swarm.geometry import Pose
from swarm.planning.grid import Grid

SIGNATURE: Final = "f8(f4[:, ::1], f8, f8, f8, f8, f8[:, ::1], f8, f8, f8, f8, f8, f8, f8, f8, f8, f8, f8, i8)"


@njit(SIGNATURE, cache=True)
def _least_clearance(
    field: NDArray[np.float32],
    side: float,
    origin_x: float,
    origin_y: float,
    origin_yaw: float,
    bodies: NDArray[np.float64],  # (count, 2): m, centres of others
    body_radius: float,
    x: float,
    y: float,
    yaw: float,
    left_now: float,
    right_now: float,
    left: float,
    right: float,
    track_width: float,
    most: float,  # m/s, change of a rim speed in one step
    dt: float,
    ticks: int,
) -> float:
    rows, columns = field.shape
    cos_o, sin_o = cos(origin_yaw), sin(origin_yaw)
    least = np.inf
    step = 0
    while True:
        want_left, want_right = (left, right) if step < ticks else (0.0, 0.0)
        left_now = min(left_now + most, max(left_now - most, want_left))
        right_now = min(right_now + most, max(right_now - most, want_right))
        half = (right_now - left_now) / track_width * dt / 2
        reach = (left_now + right_now) / 2 * dt
        x += reach * cos(yaw + half)
        y += reach * sin(yaw + half)
        yaw += 2 * half
        along = (cos_o * (x - origin_x) + sin_o * (y - origin_y)) / side - 0.5
        up = (cos_o * (y - origin_y) - sin_o * (x - origin_x)) / side - 0.5
        row, column = floor(up), floor(along)
        if row < 0 or column < 0 or row + 1 >= rows or column + 1 >= columns:
            return 0.0
        u, v = up - row, along - column
        room = (1 - u) * ((1 - v) * field[row, column] + v * field[row, column + 1]) + u * (
            (1 - v) * field[row + 1, column] + v * field[row + 1, column + 1]
        )
        for body in range(bodies.shape[0]):
            room = min(room, hypot(bodies[body, 0] - x, bodies[body, 1] - y) - body_radius)
        least = min(least, room)
        step += 1
        if step >= ticks and left_now == 0.0 and right_now == 0.0:
            return float(least)


def least_clearance(
    grid: Grid,
    pose: Pose,
    now: tuple[float, float],
    wanted: tuple[float, float],
    bodies: NDArray[np.float64],
    *,
    body_radius: float,
    track_width: float,
    acceleration: float,
    dt: float,
    ticks: int,
) -> float:
    """Find the smallest distance [m] of the centre to anything solid on the map and to round ``bodies`` ((n, 2), m).

    The robot drives ``wanted`` rim speeds for ``ticks`` control steps and brakes then; its wheels follow at
    ``acceleration`` [m/s2] from the speeds they have ``now``.
    """
    origin = grid.origin
    least: float = _least_clearance(
        grid.clearance, grid.resolution, origin.x, origin.y, origin.yaw,
        bodies, body_radius, pose.x, pose.y, pose.yaw,
        now[0], now[1], wanted[0], wanted[1], track_width, acceleration * dt, dt, ticks,
    )  # fmt: skip
    return least
