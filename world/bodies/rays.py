"""Rays against everything on the floor: solid cells, discs and boxes. Compiled, for thousands of rays per second.

Distances are exact; the tests compare them with pymunk's segment queries and with shapely.
"""

from math import cos, hypot, inf, sin, sqrt

import numpy as np
from numba import njit
from numpy.typing import NDArray

from swarm.planning.rays import first_solid

Numbers = NDArray[np.float64]


@njit("f8(f8, f8, f8, f8, f8, f8, f8)", cache=True)
def _to_disc(x: float, y: float, dx: float, dy: float, cx: float, cy: float, radius: float) -> float:
    ox, oy = cx - x, cy - y
    along = ox * dx + oy * dy
    beside = ox * ox + oy * oy - along * along
    if ox * ox + oy * oy <= radius * radius:
        return 0.0
    if along <= 0 or beside >= radius * radius:
        return inf
    return along - sqrt(radius * radius - beside)


@njit("f8(f8, f8, f8, f8, f8, f8, f8, f8, f8)", cache=True)
def _to_box(
    x: float, y: float, dx: float, dy: float, cx: float, cy: float, yaw: float, half_length: float, half_width: float
) -> float:
    c, s = cos(yaw), sin(yaw)
    ox, oy = c * (x - cx) + s * (y - cy), c * (y - cy) - s * (x - cx)
    ux, uy = c * dx + s * dy, c * dy - s * dx
    enter, leave = 0.0, inf
    for o, u, half in ((ox, ux, half_length), (oy, uy, half_width)):
        if u == 0.0:
            if abs(o) > half:
                return inf
            continue
        a, b = (-half - o) / u, (half - o) / u
        enter, leave = max(enter, min(a, b)), min(leave, max(a, b))
    return enter if enter <= leave else inf


@njit("f8[:, ::1](u1[:, ::1], f8, f8, f8, f8, i8[::1], f8[::1], f8[:, ::1], f8[:, ::1], f8[::1], f8)", cache=True)
def cast_all(
    solid: NDArray[np.uint8],
    side: float,  # m, of a cell
    origin_x: float,
    origin_y: float,
    origin_yaw: float,
    robots: NDArray[np.int64],  # those whose rays are cast
    yaws: Numbers,  # rad, of all robots
    discs: Numbers,  # (n, 3): x, y, radius [m]; the robots first
    boxes: Numbers,  # (n, 5): x, y, yaw, half length, half width [m]
    angles: Numbers,
    reach: float,  # m
) -> Numbers:
    """Return the free distances [m, 0..reach] from the edge of some robots along rays at body ``angles`` [rad].

    The shape is (robots, angles). A robot does not see its own disc.
    """
    cos_o, sin_o = cos(origin_yaw), sin(origin_yaw)
    found = np.empty((robots.size, angles.size))
    near = np.empty(discs.shape[0], np.int64)
    for row in range(robots.size):
        robot = robots[row]
        x, y, radius = discs[robot, 0], discs[robot, 1], discs[robot, 2]
        far = radius + reach  # m, from the centre
        u = (cos_o * (x - origin_x) + sin_o * (y - origin_y)) / side
        v = (cos_o * (y - origin_y) - sin_o * (x - origin_x)) / side
        # discs in reach
        count = 0
        for other in range(discs.shape[0]):
            if other != robot and hypot(discs[other, 0] - x, discs[other, 1] - y) <= far + discs[other, 2]:
                near[count] = other
                count += 1
        for k in range(angles.size):
            heading = yaws[robot] + angles[k]
            dx, dy = cos(heading), sin(heading)
            along, across = cos_o * dx + sin_o * dy, cos_o * dy - sin_o * dx
            nearest = side * first_solid(solid, u, v, along, across, far / side, False)
            for other in near[:count]:
                nearest = min(nearest, _to_disc(x, y, dx, dy, discs[other, 0], discs[other, 1], discs[other, 2]))
            for b in range(boxes.shape[0]):
                box = boxes[b]
                nearest = min(nearest, _to_box(x, y, dx, dy, box[0], box[1], box[2], box[3], box[4]))
            found[row, k] = min(reach, max(0.0, nearest - radius))
    return found


@njit("b1[::1](u1[:, ::1], f8, f8, f8, f8, f8, f8, f8[:, ::1])", cache=True)
def are_in_sight(
    solid: NDArray[np.uint8],
    side: float,
    origin_x: float,
    origin_y: float,
    origin_yaw: float,
    x: float,
    y: float,
    places: Numbers,  # (n, 2): x, y [m]
) -> NDArray[np.bool_]:
    """Return for each place True if no solid cell lies between it and a point [m]."""
    found = np.empty(places.shape[0], np.bool_)
    cos_o, sin_o = cos(origin_yaw), sin(origin_yaw)
    u = (cos_o * (x - origin_x) + sin_o * (y - origin_y)) / side
    v = (cos_o * (y - origin_y) - sin_o * (x - origin_x)) / side
    for k in range(places.shape[0]):
        dx, dy = places[k, 0] - x, places[k, 1] - y
        whole = hypot(dx, dy)
        if whole > 0.0:
            dx, dy = dx / whole, dy / whole
            along, across = cos_o * dx + sin_o * dy, cos_o * dy - sin_o * dx
            found[k] = first_solid(solid, u, v, along, across, whole / side, False) >= whole / side
        else:
            found[k] = True
    return found
