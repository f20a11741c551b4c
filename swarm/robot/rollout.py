"""Where the tables would drive a robot in the next seconds, if it had all the floor it wanted."""

from math import atan2, cos, degrees, hypot, pi, sin

import numpy as np
from numba import njit
from numpy.typing import NDArray

from swarm.maps.occupancy import Point
from swarm.robot.fuzzy.controller import Controller
from swarm.robot.fuzzy.kernel import _TABLES, Floats, Integers, infer_into, scratch_size


@njit(f"f8[:, ::1](f8[::1], {_TABLES})", cache=True)
def _roll(
    given: NDArray[np.float64],
    universes: Floats,
    terms: Floats,
    rules: Integers,
    yields: Integers,
    pieces: Integers,
    areas: Floats,
) -> NDArray[np.float64]:
    x, y, yaw, left_now, right_now, left, front, right, aim_x, aim_y, scale, width, most, dt = given[:14]
    ticks = int(given[14])
    scratch = np.empty(scratch_size(terms, pieces))
    points = np.empty((ticks, 2))
    count = 0
    while count < ticks and hypot(aim_x - x, aim_y - y) > 0.1:
        error = (atan2(aim_y - y, aim_x - x) - yaw + pi) % (2 * pi) - pi
        want_left, want_right, _ = infer_into(
            left, front, right, -error * 180.0 / pi, universes, terms, rules, yields, pieces, areas, scratch
        )
        want_left, want_right = scale * want_left, scale * want_right
        left_now = min(left_now + most, max(left_now - most, want_left))
        right_now = min(right_now + most, max(right_now - most, want_right))
        half = (right_now - left_now) / width * dt / 2
        reach = (left_now + right_now) / 2 * dt
        x += reach * cos(yaw + half)
        y += reach * sin(yaw + half)
        yaw += 2 * half
        points[count] = x, y
        count += 1
    before = hypot(aim_x - given[0], aim_y - given[1])
    if count == ticks and before < 1.3 and hypot(aim_x - x, aim_y - y) > 0.7 * before:
        return points[:0].copy()
    return points[:count].copy()


def rollout(
    controller: Controller, x, y, yaw, left_now, right_now, left, front, right, aim_x, aim_y, speed_scale, width, acceleration, dt, ticks
) -> NDArray[np.float64]:
    """Return the points (n, 2) [m], one a tick."""
    given = np.array((x, y, yaw, left_now, right_now, left, front, right, aim_x, aim_y, speed_scale, width, acceleration * dt, dt, ticks), np.float64)
    points: NDArray[np.float64] = _roll(given, *controller._tables)
    return points
