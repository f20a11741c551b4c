"""The fuzzy tables at work: what they are told, what they answer, and where they would drive the robot.

They are told the sensed distances, shrunk by a scale, and a heading: that of the aim, or on a detour that of a side.
"""

from collections.abc import Callable
from math import atan2, degrees, hypot, pi
from typing import Final

import numpy as np
from numba import njit
from numpy.typing import NDArray

from swarm.fuzzy import Controller
from swarm.fuzzy.kernel import TABLES, Floats, Integers, infer_into, scratch_size
from swarm.geometry import distance
from swarm.maps.occupancy import Point
from swarm.messages import Sense
from swarm.motion.drive import advance
from swarm.robot.driving.safety import Constraints, DriveState, SafetyFilter
from swarm.robot.tuning import DETOUR, PILOT, ROLLOUT, SAFETY, SCALE, RolloutTuning
from swarm.settings import RobotSettings, Settings
from swarm.traffic.interface import TrafficOutputs
from swarm.traffic.progress_checker import ProgressChecker, make_movement_test
from swarm.traffic.settings import is_lane


def fuzzy_speeds(
    controller: Controller,
    robot: RobotSettings,
    sense: Sense,
    heading: float,
    scale: float = 1.0,
    *,
    straight: bool = False,
) -> tuple[float, float]:
    """Return the rim speeds (left, right) [m/s] of the tables for a ``heading`` error [rad], left positive.

    ``scale`` shrinks the paper's near, medium and far: the tables get the distances divided by it. A robot that must
    drive ``straight`` to its aim gets other speeds where the tables turn away from it: see ``speeds_towards``.
    """
    unit = robot.distance_scale * scale
    left, right = controller.wheel_speeds(sense.left / unit, sense.front / unit, sense.right / unit, -degrees(heading))
    speeds = left * robot.speed_scale, right * robot.speed_scale
    return speeds_towards(speeds, heading, robot) if straight else speeds


def must_drive_straight(granted: TrafficOutputs, settings: Settings) -> bool:
    """Return True if the tables could drive round the robot's place for ever: their circle is wider than the reach.

    It turns on the spot first, then. The circle grows with the track width.
    """
    if granted.threats:
        return False
    in_cell = len(granted.held) == 1 and granted.exactly and not granted.looks
    return granted.docks or (in_cell and settings.reach < PILOT.circle * settings.robot.track_width)


def speeds_towards(tables: tuple[float, float], heading: float, robot: RobotSettings) -> tuple[float, float]:
    """Return the tables' rim speeds (left, right) [m/s], or others if they turn away from the heading, left positive.

    The tables turn away from whatever is near, such as a robot that stands beside the place.
    """
    left, right = tables
    if (right - left) * heading >= 0.0:
        return tables
    turn = PILOT.docks_turning * heading * robot.track_width / 2
    forward = (left + right) / 2
    return forward - turn, forward + turn


def scale_of(granted: TrafficOutputs, room: float, heading: float, nowhere: float, *, lane: bool = False) -> float:
    """Return the scale of the sensed distances for a granted ``room`` [m] and a ``heading`` error [rad].

    In a ``lane`` between others the wall of a hall is always near on one side: it counts as far, and the tables turn to
    the aim, not to the edge of the lane.

    A robot that gets ``nowhere`` for long [s] has the least scale. In some corners the tables turn left and right
    for ever; if all obstacles count as far, the tables turn to the aim. After twice that time nearly everything
    counts as far.
    """
    if nowhere > 2 * PILOT.nowhere_after:
        return SCALE.detour
    if nowhere > PILOT.nowhere_after or granted.docks or (granted.exactly and len(granted.held) == 1):
        return SCALE.turning
    if granted.unconstrained:
        return 1.0
    scale = SCALE.lane if lane else min(1.0, max(SCALE.tight, room / SCALE.roomy))
    return scale * (1.0 - SCALE.behind * abs(heading) / pi)


class LaneTurn:
    """The turns of one robot on the spot, in cells too small for the tables' arcs.

    There a wall beside the robot and its aim on the same side balance each other in the tables, and it would stand.
    """

    def __init__(self, side: float, radius: float) -> None:
        self.is_lane = is_lane(side, radius)
        self._turns = False

    def check(self, sense: Sense, heading: float, *, between_others: bool) -> bool:
        """Return True if the robot stands and has to turn by its ``heading`` error [rad], until it is small.

        A robot that is not ``between_others``, in its own cells, has room for the tables' arcs.
        """
        if not self.is_lane or not between_others or abs(sense.linear) > SAFETY.stands:
            self._turns = False
        else:
            self._turns = abs(heading) > (SAFETY.turn_until if self._turns else PILOT.docks_straight)
        return self._turns


class Detour:
    """The detours of one robot that gets nowhere: the tables get an aim on the freer side until the way ahead is clear.

    Obstacle avoidance and goal seeking can pull to opposite sides and hold a robot in a corner for ever. A detour
    changes only the inputs of the tables. It commands no wheel, so it does not help tables that do not turn to a
    heading.
    """

    def __init__(self, safety: SafetyFilter) -> None:
        self._filter = safety
        self._progress = ProgressChecker(make_movement_test(DETOUR.progress))
        self._since = 0.0  # s, time of the detour's last phase
        self._from: tuple[float, float] | None = None  # m, where the detour began
        self._heading = 0.0  # rad, given to the tables; 0 once the way ahead is clear

    def end(self) -> None:
        """Forget progress and detour, because the robot must not drive on now."""
        self._progress.forget()
        self._from = None

    def heading(self, sense: Sense, constraints: Constraints) -> float | None:
        """Return the heading error [rad] for the tables; None: no detour is under way.

        A detour begins when the robot makes no progress for ``DETOUR.patience`` and has no way ahead. A robot before a
        body also begins one, because the body may stay. A robot that has no cells to drive on has to wait and begins
        none.
        """
        if constraints.stop_within <= 0.0:
            self.end()
            return None
        here = (sense.x, sense.y)
        if self._from is None:
            still = self._progress.check(here, sense.time)
            if still <= DETOUR.patience or self._filter.way_ahead(sense, constraints):
                return None
            self._from, self._since = here, sense.time
            self._heading = DETOUR.aside * self._filter.freer_side(sense, constraints)
        if self._heading and self._filter.way_ahead(sense, constraints):
            self._heading, self._since = 0.0, sense.time
        if sense.time - self._since > DETOUR.patience or distance(here, self._from) > DETOUR.done:
            self.end()
            return None
        return self._heading


def _compile_rollout(rollout: RolloutTuning) -> Callable[..., NDArray[np.float64]]:
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


_roll: Final = _compile_rollout(ROLLOUT)


class Rollout:
    """A simulation of where the tables would drive one robot in the next seconds if all the floor were granted."""

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
