"""A simulation of where the tables would drive a robot in the next seconds if all the floor were granted."""

from collections.abc import Callable
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
from swarm.robot.driving.safety import DriveState
from swarm.robot.tuning import ROLLOUT, RolloutTuning
from swarm.settings import Settings


def _compiled(rollout: RolloutTuning) -> Callable[..., NDArray[np.float64]]:
    """Return the kernel with these values compiled in."""

    @njit(f"f8[:, ::1](f8[::1], {TABLES})", cache=True)
    def roll(
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
        while count < ticks and hypot(aim_x - x, aim_y - y) > rollout.there:
            error = (atan2(aim_y - y, aim_x - x) - yaw + pi) % (2 * pi) - pi
            want_left, want_right, _ = infer_into(
                left, front, right, -error * 180.0 / pi,
                universes, terms, rules, yields, pieces, areas, slowing, scratch,
            )  # fmt: skip
            x, y, yaw, left_now, right_now = advance(
                x, y, yaw, left_now, right_now, speed * want_left, speed * want_right, width, most, dt
            )
            points[count] = x, y
            count += 1
        circles = count == ticks and before < rollout.round and hypot(aim_x - x, aim_y - y) > rollout.nearer * before
        return points[: 0 if circles else count].copy()

    compiled: Callable[..., NDArray[np.float64]] = roll
    return compiled


_roll: Final = _compiled(ROLLOUT)


class Rollout:
    """A simulator of one controller on one robot."""

    def __init__(self, controller: Controller, settings: Settings) -> None:
        self._controller = controller
        self._robot = settings.robot
        self._dt = 1.0 / settings.rate

    def __call__(self, sense: Sense, body: DriveState, aim: Point, scale: float) -> NDArray[np.float64]:
        """Return the points (n, 2) [m] that the robot's centre would pass on its way to an aim, one for each tick.

        The sensed distances stay constant; ``scale`` is that of ``fuzzy_speeds``. There are no points if the robot
        would circle around the aim.
        """
        robot, dt = self._robot, self._dt
        unit = robot.distance_scale * scale
        given = np.array((
            *body.pose, body.left, body.right, sense.left / unit, sense.front / unit, sense.right / unit, *aim,
            robot.speed_scale, robot.track_width, robot.wheel_acceleration * dt, dt, ROLLOUT.ahead / dt,
        ), np.float64)  # fmt: skip
        return _roll(given, *self._controller.tables)
