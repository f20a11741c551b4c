"""Getting out of the threats' way: simulated ways out are compared with standing, on each course threats may take.

Threats may go on, turn, turn back or stop, all alike. The robot takes a way out only if it is no worse than standing on
every such course, and better on the likely ones. Otherwise the robot stands.
"""

from collections.abc import Callable, Sequence
from math import cos, hypot, pi, sin
from typing import Final

import numpy as np
from numba import njit
from numpy.typing import NDArray

from swarm.geometry import Twist, wrap
from swarm.messages import Sense
from swarm.motion.drive import GRAZE, Boxes, DifferentialDrive, advance, clearance_along, gap_to_boxes
from swarm.robot.driving.safety import STAND, Constraints
from swarm.robot.tuning import EVASION, SAFETY, EvasionTuning
from swarm.settings import Settings
from swarm.traffic.interface import MovingObstacle
from swarm.traffic.obstacles.detector import HALF_WIDTH

NO_WAY: Final = np.nan


def _compile_gaps(evasion: EvasionTuning, graze: float, half_width: float) -> Callable[..., bool]:
    """Return the kernel with these values compiled in; ``half_width`` [m] is the radius of a threat.

    A way keeps ``spare`` [m] besides the robot's radius to cells, walls and bodies; where it has less of one of them at
    the start, it may lose ``graze`` [m].

    The kernel computes the ``least`` gap [m] to the threats on each of their courses; it returns False if the way is
    not clear. The robot drives for ``drive`` ticks, towards a heading [rad] or, if that is NaN, at ``left`` and
    ``right`` [m/s]. Then it brakes.
    """

    @njit(
        "b1(f8, i8, i8, f8, f8, f8[:, ::1], f8[::1], f4[:, ::1], f8, f8[::1], f8[:, ::1], f8, f8, f8[::1], f8[::1], "
        "f8, f8, f8, f8[:, ::1], f8[::1])",
        cache=True,
    )
    def gaps(
        heading: float,
        drive: int,
        ticks: int,
        left: float,
        right: float,
        boxes: Boxes,
        local: NDArray[np.float64],
        field: NDArray[np.float32],
        side: float,
        origin: NDArray[np.float64],
        bodies: NDArray[np.float64],
        radius: float,
        spare: float,
        pose: NDArray[np.float64],
        now: NDArray[np.float64],
        width: float,
        most: float,
        dt: float,
        threats: NDArray[np.float64],
        least: NDArray[np.float64],
    ) -> bool:
        x, y, yaw = pose
        left_now, right_now = now
        turned = local[2] - yaw
        cos_l, sin_l = cos(turned), sin(turned)
        least[:] = np.inf
        to_boxes = to_walls = to_others = 0.0
        for tick in range(ticks):
            want_left, want_right = 0.0, 0.0
            if tick < drive:
                want_left, want_right = left, right
                if not np.isnan(heading):
                    off = (heading - yaw + pi) % (2 * pi) - pi
                    half = max(-evasion.turn_rate, min(evasion.turn_rate, evasion.gain * off)) * width / 2
                    forward = evasion.speed * max(0.0, cos(off))
                    want_left, want_right = forward - half, forward + half
            dx, dy = x - pose[0], y - pose[1]
            room = gap_to_boxes(boxes, local[0] + cos_l * dx - sin_l * dy, local[1] + sin_l * dx + cos_l * dy)
            walls, others = clearance_along(
                field, side, origin[0], origin[1], origin[2], bodies, x, y, yaw,
                0.0, 0.0, 0.0, 0.0, width, most, dt, 1,
            )  # fmt: skip
            if tick == 0:
                to_boxes, to_walls = min(radius + spare, room - graze), min(radius + spare, walls - graze)
                to_others = min(radius + spare, others - graze)
            if room < to_boxes or walls < to_walls or others < to_others:
                return False
            time = tick * dt
            for course in range(evasion.courses.shape[0]):
                turn, share = evasion.courses[course]
                for threat in threats:
                    vx = share * (cos(turn) * threat[2] - sin(turn) * threat[3])
                    vy = share * (sin(turn) * threat[2] + cos(turn) * threat[3])
                    away = hypot(threat[0] + vx * time - x, threat[1] + vy * time - y)
                    least[course] = min(least[course], away - radius - half_width)
            x, y, yaw, left_now, right_now = advance(
                x, y, yaw, left_now, right_now, want_left, want_right, width, most, dt
            )
        return True

    compiled: Callable[..., bool] = gaps
    return compiled


_gaps: Final = _compile_gaps(EVASION, GRAZE, HALF_WIDTH)


class Evasion:
    """The ways by which one robot gets out of a moving obstacle's way."""

    def __init__(self, settings: Settings) -> None:
        robot = settings.robot
        self._drive = DifferentialDrive(robot.track_width)
        self._robot = robot
        self._dt = 1.0 / settings.rate
        self._heading: float | None = None  # rad, of the way out under way

    def threatens(
        self, sense: Sense, tables: tuple[float, float], constraints: Constraints, threats: Sequence[MovingObstacle]
    ) -> bool:
        """Return True if the tables' rim speeds [m/s] lead too near to a threat."""
        driving = self.gaps(sense, constraints, threats, NO_WAY, EVASION.tables_for, EVASION.turns_back, tables)
        standing = self.gaps(sense, constraints, threats, NO_WAY, 0.0, EVASION.turns_back)
        if driving is None or standing is None:
            return True
        return bool((driving < np.minimum(standing, EVASION.enough) - EVASION.differs).any())

    def way_out(
        self, sense: Sense, constraints: Constraints, wished: Boxes, threats: Sequence[MovingObstacle]
    ) -> Twist | None:
        """Return the speeds that lead out of the threats' way; None: standing is as good.

        ``wished`` is like the constraints' ``shut``, for the cells that are neither granted nor claimed.
        """
        standing = self.gaps(sense, constraints, threats, NO_WAY, 0.0)
        stopped = self.gaps(sense, constraints, threats, NO_WAY, 0.0, EVASION.stopped)
        if stopped is None or standing is None or _likely(standing) >= EVASION.enough - EVASION.differs:
            self._heading = None
            return None
        best, heading = _likely(standing) + EVASION.differs, None
        for shut in (constraints.shut, wished):
            for number in range(EVASION.headings):
                tried = wrap(sense.yaw + (number + 1) // 2 * (-1) ** number * 2 * pi / EVASION.headings)
                if number == 0 and self._heading is not None:
                    tried = self._heading
                gaps = self._longest(sense, constraints._replace(shut=shut), threats, tried)
                if gaps is None:
                    continue
                begun = self.gaps(
                    sense, constraints._replace(shut=shut), threats, tried, EVASION.commit, EVASION.stopped
                )
                if begun is None or (begun < np.minimum(stopped, EVASION.stopped_gap) - EVASION.differs).any():
                    continue
                score = _likely(gaps) + (EVASION.keep if tried == self._heading else 0.0)
                if score > best + 1e-6:
                    best, heading = score, tried
            if heading is not None and best >= EVASION.enough:
                break
        self._heading = heading
        if heading is None:
            return None
        off = wrap(heading - sense.yaw)
        most = EVASION.turn_rate
        return Twist(EVASION.speed * max(0.0, cos(off)), max(-most, min(most, EVASION.gain * off)))

    def _longest(
        self, sense: Sense, constraints: Constraints, threats: Sequence[MovingObstacle], heading: float
    ) -> NDArray[np.float64] | None:
        """Return the gaps [m] on the longest clear way at a heading; None: no way is clear."""
        tried = (self.gaps(sense, constraints, threats, heading, time) for time in EVASION.times)
        return next((gaps for gaps in tried if gaps is not None), None)

    def gaps(
        self,
        sense: Sense,
        constraints: Constraints,
        threats: Sequence[MovingObstacle],
        heading: float,
        time: float,
        ahead: float = EVASION.ahead,
        speeds: tuple[float, float] = STAND,
    ) -> NDArray[np.float64] | None:
        """Return the least gap [m] to the threats on each of their courses; None: the way is not clear."""
        grid, robot = constraints.grid, self._robot
        least = np.empty(len(EVASION.courses))
        pose, now = (sense.x, sense.y, sense.yaw), self._drive.rim_speeds(Twist(sense.linear, sense.angular))
        clear = _gaps(
            heading, round(time / self._dt), round(ahead / self._dt), *speeds,
            constraints.shut, np.array(constraints.local), grid.clearance, grid.resolution, np.array(grid.origin),
            constraints.bodies, robot.radius, SAFETY.gap + constraints.uncertainty, np.array(pose), np.array(now),
            robot.track_width, robot.wheel_acceleration * self._dt, self._dt, np.array(threats), least,
        )  # fmt: skip
        return least if clear else None


def _likely(gaps: NDArray[np.float64]) -> float:
    """Return the weighted mean gap [m] on the likely courses; no gap counts more than ``EVASION.enough``."""
    return float((np.minimum(gaps, EVASION.enough) * EVASION.likely).sum())
