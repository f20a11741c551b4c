"""A simulation of where the tables would drive a robot in the next seconds if all the floor were granted."""

from math import atan2, hypot, pi
from typing import Final

import numpy as np
from numba import njit
from numpy.typing import NDArray

from swarm.fuzzy import Controller
from swarm.fuzzy.kernel import TABLES, Floats, Integers, infer_into, scratch_size
from swarm.maps.occupancy import Point
from swarm.messages import Sense
from swarm.motion.sweep import advance
from swarm.robot.safety import Body
from swarm.settings import Settings

AHEAD: Final = 2.5  # s of simulated motion
THERE: Final = 0.1  # m from the aim, where it counts as reached
ROUND: Final = 1.3  # m; the tables may circle around a nearer aim for ever, because they turn in a larger circle
NEARER: Final = 0.7  # share of the first distance; a robot near its aim that stays farther away than this circles


@njit(f"f8[:, ::1](f8[::1], {TABLES})", cache=True)
def _roll(
    given: Floats,
    universes: Floats,
    terms: Floats,
    rules: Integers,
    yields: Integers,
    pieces: Integers,
    areas: Floats,
    slowing: Floats,
) -> NDArray[np.float64]:
    x, y, yaw, left_now, right_now, left, front, right, aim_x, aim_y, speed, width, most, dt, ticks = given
    scratch = np.empty(scratch_size(terms, pieces))
    points = np.empty((int(ticks), 2))
    before = hypot(aim_x - x, aim_y - y)
    count = 0
    while count < ticks and hypot(aim_x - x, aim_y - y) > THERE:
        error = (atan2(aim_y - y, aim_x - x) - yaw + pi) % (2 * pi) - pi
        want_left, want_right, _ = infer_into(
            left, front, right, -error * 180.0 / pi, universes, terms, rules, yields, pieces, areas, slowing, scratch
        )
        x, y, yaw, left_now, right_now = advance(
            x, y, yaw, left_now, right_now, speed * want_left, speed * want_right, width, most, dt
        )
        points[count] = x, y
        count += 1
    circles = count == ticks and before < ROUND and hypot(aim_x - x, aim_y - y) > NEARER * before
    return points[: 0 if circles else count].copy()


class Rollout:
    """A simulator of one controller on one robot."""

    def __init__(self, controller: Controller, settings: Settings) -> None:
        self._controller = controller
        self._robot = settings.robot
        self._dt = 1.0 / settings.rate

    def __call__(self, sense: Sense, body: Body, aim: Point, scale: float) -> NDArray[np.float64]:
        """Return the points (n, 2) [m] that the robot's centre would pass on its way to an aim, one for each tick.

        The sensed distances stay constant; ``scale`` is that of ``fuzzy_speeds``. There are no points if the robot
        would circle around the aim.
        """
        robot = self._robot
        unit = robot.distance_scale * scale
        given = np.array((
            *body.pose, body.left, body.right, sense.left / unit, sense.front / unit, sense.right / unit, *aim,
            robot.speed_scale, robot.track_width, robot.wheel_acceleration * self._dt, self._dt, AHEAD / self._dt,
        ), np.float64)  # fmt: skip
        points: NDArray[np.float64] = _roll(given, *self._controller.tables)
        return points
