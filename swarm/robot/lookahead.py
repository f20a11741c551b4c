"""Where the wheels would take the robot: under a command for a while, then under the brake; and how near a wall."""

import numpy as np
from numpy.typing import NDArray

from swarm.geometry import Pose
from swarm.planning.grid import Grid
from swarm.traffic.sweep import clearance_along


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
    least: float = clearance_along(
        grid.clearance, grid.resolution, origin.x, origin.y, origin.yaw,
        bodies, body_radius, pose.x, pose.y, pose.yaw,
        now[0], now[1], wanted[0], wanted[1], track_width, acceleration * dt, dt, ticks,
    )  # fmt: skip
    return least
