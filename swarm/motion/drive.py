"""Kinematics of the differential drive of the paper's section 2.3, and predictions of where wheel commands lead.

The predictions are compiled: of the path, and of the clearance to boxes, walls and bodies on it. Rim speeds [m/s]
approach the wanted ones by at most ``most`` [m/s] in a step of ``dt`` [s]. Boxes are (n, 4): low x, low y, high x,
high y [m]. Points that are compared with boxes are in the boxes' own frame.
"""

from dataclasses import dataclass
from math import cos, floor, hypot, sin
from typing import Final

import numpy as np
from numba import njit
from numpy.typing import NDArray

from swarm.geometry import Twist

Boxes = NDArray[np.float64]
STRIDE: Final = 0.05  # m, between two tested points of a line
NO_COMMANDS: Final = np.empty((0, 2))
LONGEST: Final = 400  # ticks, the longest braking path
GRAZE: Final = 1e-3  # m of clearance that a robot may lose per check: no robot drives exactly parallel to a wall
TIGHT: Final = 0.01  # m; at less clearance a robot may lose none: the losses of many checks would end in a contact


@dataclass(frozen=True, slots=True)
class DifferentialDrive:
    """Two driven wheels on one axle."""

    track_width: float  # m, L: between the wheels' contact points

    def twist(self, left: float, right: float) -> Twist:
        """Return the body twist of two rim speeds [m/s]: v = (v_r + v_l)/2, w = (v_r - v_l)/L."""
        return Twist((right + left) / 2, (right - left) / self.track_width)

    def rim_speeds(self, twist: Twist) -> tuple[float, float]:
        """Return the rim speeds (left, right) [m/s] that give a body twist: the inverse of ``twist``."""
        half = twist.angular * self.track_width / 2
        return twist.linear - half, twist.linear + half


def ramp_wheels(
    wheels: tuple[float, float], wanted: tuple[float, float], fastest: float, most: float
) -> tuple[float, float]:
    """Return rim speeds [m/s] one control step later: ``ramp`` towards the wanted ones, of which none is faster."""
    left, right = (max(-fastest, min(fastest, speed)) for speed in wanted)
    return ramp(wheels[0], left, most), ramp(wheels[1], right, most)


@njit("f8(f8, f8, f8)", cache=True)
def ramp(current: float, wanted: float, most: float) -> float:
    """Return a rim speed [m/s] one control step later: it approaches ``wanted`` by at most ``most`` [m/s]."""
    return min(current + most, max(current - most, wanted))


@njit("UniTuple(f8, 5)(f8, f8, f8, f8, f8, f8, f8, f8, f8, f8)", cache=True)
def advance(
    x: float,
    y: float,
    yaw: float,
    left: float,
    right: float,
    want_left: float,
    want_right: float,
    track_width: float,
    most: float,
    dt: float,
) -> tuple[float, float, float, float, float]:
    """Return the pose and the rim speeds one step later; the step is the straight chord at the arc's middle heading."""
    left, right = ramp(left, want_left, most), ramp(right, want_right, most)
    half = (right - left) / track_width * dt / 2
    reach = (left + right) / 2 * dt
    return x + reach * cos(yaw + half), y + reach * sin(yaw + half), yaw + 2 * half, left, right


@njit("f8(f8[:, ::1], f8, f8)", cache=True)
def gap_to_boxes(boxes: Boxes, x: float, y: float) -> float:
    """Return the distance [m] from a point to the nearest box."""
    least = np.inf
    for k in range(boxes.shape[0]):
        dx = max(boxes[k, 0] - x, x - boxes[k, 2], 0.0)
        dy = max(boxes[k, 1] - y, y - boxes[k, 3], 0.0)
        if dx < least and dy < least:  # skips hypot, which is slow, for boxes that are not nearer
            least = min(least, hypot(dx, dy) if dx > 0.0 and dy > 0.0 else max(dx, dy))
    return least


@njit("f8(f8[:, ::1], f8, f8, f8, f8)", cache=True)
def line_room(boxes: Boxes, x0: float, y0: float, x1: float, y1: float) -> float:
    """Return the least distance [m] to a box on the straight line between two points, without its start."""
    count = int(hypot(x1 - x0, y1 - y0) / STRIDE) + 1
    least = np.inf
    for k in range(1, count + 1):
        least = min(least, gap_to_boxes(boxes, x0 + (x1 - x0) * k / count, y0 + (y1 - y0) * k / count))
    return least


@njit("b1(f8[:, ::1], f8, f8, f8, f8, f8, f8)", cache=True)
def line_is_clear(boxes: Boxes, x0: float, y0: float, x1: float, y1: float, least: float, enough: float) -> bool:
    """Return True if the straight line from one point to another keeps clear of the boxes.

    The required clearance is ``enough`` [m], or the clearance at the start if that is less, but at least ``least`` [m].
    """
    return line_room(boxes, x0, y0, x1, y1) >= min(enough, max(least, gap_to_boxes(boxes, x0, y0)))


@njit("f8(f8[:, ::1], f8, f8, f8, f8, f8, f8, f8, f8, f8, f8, i8)", cache=True)
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
    """Return the least distance [m] to a box while the wheels get ``left`` and ``right`` for ``ticks``, then stop."""
    least = gap_to_boxes(boxes, x, y)
    step = 0
    while step < ticks or left_now != 0.0 or right_now != 0.0:
        want_left, want_right = (left, right) if step < ticks else (0.0, 0.0)
        x, y, yaw, left_now, right_now = advance(
            x, y, yaw, left_now, right_now, want_left, want_right, track_width, most, dt
        )
        least = min(least, gap_to_boxes(boxes, x, y))
        step += 1
    return least


@njit("f8[:, ::1](f8, f8, f8, f8, f8, f8, f8, f8, f8[:, ::1])", cache=True)
def braking_points(
    x: float,
    y: float,
    yaw: float,
    left: float,
    right: float,
    track_width: float,
    most: float,
    dt: float,
    commands: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the centre's positions ((n, 2), m) at each step until the wheels stand.

    ``commands`` ((k, 2), m/s) are rim speeds that may still be on their way to the wheels, oldest first, one per step.
    The wheels may carry out any number of the newest ones before they brake. The result has the points of each case,
    one case after the other.
    """
    known = commands.shape[0]
    points = np.empty(((known + 1) * LONGEST, 2))
    found = 0
    for first in range(known, -1, -1):
        at_x, at_y, heading, left_now, right_now = x, y, yaw, left, right
        count = 0
        while (first + count < known or left_now != 0.0 or right_now != 0.0) and count < LONGEST:
            want_left, want_right = 0.0, 0.0
            if first + count < known:
                want_left, want_right = commands[first + count, 0], commands[first + count, 1]
            at_x, at_y, heading, left_now, right_now = advance(
                at_x, at_y, heading, left_now, right_now, want_left, want_right, track_width, most, dt
            )
            points[found] = at_x, at_y
            count += 1
            found += 1
    return points[:found].copy()


@njit(
    "UniTuple(f8, 2)(f4[:, ::1], f8, f8, f8, f8, f8[:, ::1], f8, f8, f8, f8, f8, f8, f8, f8, f8, f8, i8)",
    cache=True,
)
def clearance_along(
    field: NDArray[np.float32],
    side: float,
    origin_x: float,
    origin_y: float,
    origin_yaw: float,
    bodies: NDArray[np.float64],  # (count, 3): m, centre and radius of other bodies
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
) -> tuple[float, float]:
    """Return the centre's least distances [m] to walls, by the clearance ``field`` [m], and to round bodies.

    The wheels get ``left`` and ``right`` [m/s] for ``ticks``, then they stop. Outside the field both are 0.
    """
    rows, columns = field.shape
    cos_o, sin_o = cos(origin_yaw), sin(origin_yaw)
    walls = others = np.inf
    step = 0
    while True:
        want_left, want_right = (left, right) if step < ticks else (0.0, 0.0)
        x, y, yaw, left_now, right_now = advance(
            x, y, yaw, left_now, right_now, want_left, want_right, track_width, most, dt
        )
        along = (cos_o * (x - origin_x) + sin_o * (y - origin_y)) / side - 0.5
        up = (cos_o * (y - origin_y) - sin_o * (x - origin_x)) / side - 0.5
        row, column = floor(up), floor(along)
        if row < 0 or column < 0 or row + 1 >= rows or column + 1 >= columns:
            return 0.0, 0.0
        u, v = up - row, along - column
        room = (1 - u) * ((1 - v) * field[row, column] + v * field[row, column + 1]) + u * (
            (1 - v) * field[row + 1, column] + v * field[row + 1, column + 1]
        )
        walls = min(walls, room)
        for body in range(bodies.shape[0]):
            others = min(others, hypot(bodies[body, 0] - x, bodies[body, 1] - y) - bodies[body, 2])
        step += 1
        if step >= ticks and left_now == 0.0 and right_now == 0.0:
            return walls, others


@njit("f8(f8, f8, f8)", cache=True)
def needed_clearance(need: float, here: float, radius: float) -> float:
    """Return the clearance [m] to keep where ``need`` is wanted and ``here`` is left; see ``first_clear``."""
    return min(need, max(here - GRAZE, min(here, radius + TIGHT)))


@njit(
    "UniTuple(f8, 3)(f8[:, ::1], f8, f8, f8, f8, f8, f8[:, ::1], f8, f8, f8, f4[:, ::1], f8, f8, f8, f8, "
    "f8[:, ::1], f8, f8, f8, f8, f8, f8, f8, f8, f8, i8)",
    cache=True,
)
def first_clear(
    remedies: NDArray[np.float64],
    linear: float,
    angular: float,
    fastest: float,
    creep: float,
    need: float,
    boxes: Boxes,
    box_x: float,
    box_y: float,
    box_yaw: float,
    field: NDArray[np.float32],
    side: float,
    origin_x: float,
    origin_y: float,
    origin_yaw: float,
    bodies: NDArray[np.float64],
    radius: float,
    x: float,
    y: float,
    yaw: float,
    left_now: float,
    right_now: float,
    track_width: float,
    most: float,
    dt: float,
    ticks: int,
) -> tuple[float, float, float]:
    """Return the number and the rim speeds [m/s] of the first remedy that keeps clear, braking included; -1 if none.

    Each of ``remedies`` (n, 2) is a forward share and a yaw share of the twist (linear, angular). The forward speed is
    limited to ``fastest`` [m/s]; if both shares are equal, the limited twist follows the same arc, and it is skipped if
    ``fastest`` is below ``creep`` [m/s]. The required clearance of the centre is ``need`` [m], to the boxes in their
    own frame, to the walls and to the bodies of ``clearance_along``; ``radius`` [m] is the robot's. One that has less
    already, to one of the three, may lose at most ``GRAZE`` of that, and nothing below ``TIGHT``; a body that came near
    takes nothing from what is due to the boxes.
    """
    walls, others = clearance_along(
        field, side, origin_x, origin_y, origin_yaw, bodies, x, y, yaw,
        0.0, 0.0, 0.0, 0.0, track_width, most, dt, 1,
    )  # fmt: skip
    to_boxes = needed_clearance(need, gap_to_boxes(boxes, box_x, box_y), radius)
    to_walls, to_others = needed_clearance(need, walls, radius), needed_clearance(need, others, radius)
    for number in range(remedies.shape[0]):
        share, turn = remedies[number]
        forward, rate = share * linear, turn * angular
        if forward > fastest:
            if share == turn:
                if fastest < creep:
                    continue
                rate *= fastest / forward
            forward = fastest
        half = rate * track_width / 2
        left, right = forward - half, forward + half
        clear = True
        for told in (1, ticks):
            clear = clear and to_boxes <= path_room(
                boxes, box_x, box_y, box_yaw, left_now, right_now, left, right, track_width, most, dt, told
            )
            if clear:
                walls, others = clearance_along(
                    field, side, origin_x, origin_y, origin_yaw, bodies, x, y, yaw,
                    left_now, right_now, left, right, track_width, most, dt, told,
                )  # fmt: skip
                clear = to_walls <= walls and to_others <= others
        if clear:
            return float(number), left, right
    return -1.0, 0.0, 0.0
