"""Getting out of a threat's way: simulated ways out are compared with standing, on each course the threat may take.

A threat may go on, turn, turn back or stop. The robot takes a way out only if it is no worse than standing on every
such course, and better on the likely ones. Otherwise the robot stands.
"""

from math import cos, hypot, pi, sin
from typing import Final

import numpy as np
from numba import njit
from numpy.typing import NDArray

from swarm.geometry import Twist, wrap
from swarm.messages import Sense
from swarm.motion.drive import DifferentialDrive
from swarm.motion.sweep import Boxes, advance, clearance_along, gap
from swarm.robot.safety import SPARE, STAND, Constraints
from swarm.settings import Settings
from swarm.traffic.threat import HALF_WIDTH, Threat

SPEED: Final = 0.6  # m/s at most: the cruising speed of the scenarios
TURN: Final = 4.0  # rad/s at most
GAIN: Final = 5.0  # 1/s, yaw rate per angle between robot and way out
HEADINGS: Final = 24  # ways out that are tried, evenly all around
TIMES: Final = np.array((1.8, 1.2, 0.8, 0.4))  # s to drive before braking, longest first
AHEAD: Final = 2.5  # s of simulated motion
ENOUGH: Final = 0.3  # m of gap; a larger gap counts no more than this
LESS: Final = 0.02  # m; smallest difference of gaps between driving and standing that counts
KEEP: Final = 0.1  # m by which another way out must be better than the one under way
LOOK: Final = 0.4  # s for which the wheels get the tables' speeds, before braking
FOLLOWS: Final = 2.0  # s of that simulation: a threat that drives away may turn back
# courses of a threat: its turn [rad], and the share of its speed that it keeps
COURSES: Final = np.array(((0.0, 1.0), (0.4, 1.0), (-0.4, 1.0), (1.6, 1.0), (-1.6, 1.0), (pi, 1.0), (0.0, 0.0)))
LIKELY: Final = np.array((0.5, 0.25, 0.25, 0.0, 0.0, 0.0, 0.0))  # weights; the measured velocity is inexact
COMMIT: Final = 0.3  # s for which a way out is driven at least
STOPPED: Final = 0.9  # s; for so long, braking included, no course may bring the threat nearer than standing would
CLOSE: Final = 0.1  # m; a gap during STOPPED that is enough, even where standing keeps more
NO_WAY: Final = np.nan


@njit(
    "b1(f8, i8, i8, f8, f8, f8[:, ::1], f8[::1], f4[:, ::1], f8, f8[::1], f8[:, ::1], f8, f8[::1], f8[::1], "
    "f8, f8, f8, f8[::1], f8[::1])",
    cache=True,
)
def _gaps(
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
    pose: NDArray[np.float64],
    now: NDArray[np.float64],
    width: float,
    most: float,
    dt: float,
    threat: NDArray[np.float64],
    least: NDArray[np.float64],
) -> bool:
    """Compute the ``least`` gap [m] to the threat on each of its courses; return False if the way is not clear.

    The robot drives for ``drive`` ticks, towards a heading [rad] or, if that is NaN, at ``left`` and ``right`` [m/s].
    Then it brakes.
    """
    x, y, yaw = pose
    left_now, right_now = now
    turned = local[2] - yaw
    cos_l, sin_l = cos(turned), sin(turned)
    least[:] = np.inf
    need = 0.0
    for tick in range(ticks):
        want_left, want_right = 0.0, 0.0
        if tick < drive:
            want_left, want_right = left, right
            if not np.isnan(heading):
                off = (heading - yaw + pi) % (2 * pi) - pi
                half = max(-TURN, min(TURN, GAIN * off)) * width / 2
                forward = SPEED * max(0.0, cos(off))
                want_left, want_right = forward - half, forward + half
        dx, dy = x - pose[0], y - pose[1]
        room = min(
            gap(boxes, local[0] + cos_l * dx - sin_l * dy, local[1] + sin_l * dx + cos_l * dy),
            clearance_along(
                field, side, origin[0], origin[1], origin[2], bodies, radius, x, y, yaw,
                0.0, 0.0, 0.0, 0.0, width, most, dt, 1,
            ),
        )  # fmt: skip
        if tick == 0:
            need = min(radius + SPARE, room - 1e-3)
        if room < need:
            return False
        time = tick * dt
        for course in range(COURSES.shape[0]):
            turn, share = COURSES[course]
            vx = share * (cos(turn) * threat[2] - sin(turn) * threat[3])
            vy = share * (sin(turn) * threat[2] + cos(turn) * threat[3])
            away = hypot(threat[0] + vx * time - x, threat[1] + vy * time - y)
            least[course] = min(least[course], away - radius - HALF_WIDTH)
        x, y, yaw, left_now, right_now = advance(x, y, yaw, left_now, right_now, want_left, want_right, width, most, dt)
    return True


class Flight:
    """The ways out of one robot."""

    def __init__(self, settings: Settings) -> None:
        robot = settings.robot
        self._drive = DifferentialDrive(robot.track_width, robot.wheel_radius)
        self._robot = robot
        self._dt = 1.0 / settings.rate
        self._heading: float | None = None  # rad, of the way out under way

    def threatens(self, sense: Sense, tables: tuple[float, float], constraints: Constraints, threat: Threat) -> bool:
        """Return True if the tables' rim speeds [m/s] lead too near to the threat."""
        driving = self._gaps(sense, constraints, threat, NO_WAY, LOOK, FOLLOWS, tables)
        standing = self._gaps(sense, constraints, threat, NO_WAY, 0.0, FOLLOWS)
        return driving is None or standing is None or bool((driving < np.minimum(standing, ENOUGH) - LESS).any())

    def way_out(self, sense: Sense, constraints: Constraints, wished: Boxes, threat: Threat) -> Twist | None:
        """Return the speeds that lead out of the threat's way; None: standing is as good.

        ``wished`` is like the constraints' ``shut``, for the cells that are neither granted nor claimed.
        """
        standing = self._gaps(sense, constraints, threat, NO_WAY, 0.0)
        stopped = self._gaps(sense, constraints, threat, NO_WAY, 0.0, STOPPED)
        if stopped is None or standing is None or _likely(standing) >= ENOUGH - LESS:
            self._heading = None
            return None
        best, heading = _likely(standing) + LESS, None
        for shut in (constraints.shut, wished):
            for number in range(HEADINGS):
                tried = wrap(sense.yaw + (number + 1) // 2 * (-1) ** number * 2 * pi / HEADINGS)
                if number == 0 and self._heading is not None:
                    tried = self._heading
                gaps = self._longest(sense, constraints._replace(shut=shut), threat, tried)
                if gaps is None:
                    continue
                begun = self._gaps(sense, constraints._replace(shut=shut), threat, tried, COMMIT, STOPPED)
                if begun is None or (begun < np.minimum(stopped, CLOSE) - LESS).any():
                    continue
                score = _likely(gaps) + (KEEP if tried == self._heading else 0.0)
                if score > best + 1e-6:
                    best, heading = score, tried
            if heading is not None and best >= ENOUGH:
                break
        self._heading = heading
        if heading is None:
            return None
        off = wrap(heading - sense.yaw)
        return Twist(SPEED * max(0.0, cos(off)), max(-TURN, min(TURN, GAIN * off)))

    def _longest(
        self, sense: Sense, constraints: Constraints, threat: Threat, heading: float
    ) -> NDArray[np.float64] | None:
        """Return the gaps [m] on the longest clear way at a heading; None: no way is clear."""
        tried = (self._gaps(sense, constraints, threat, heading, time) for time in TIMES)
        return next((gaps for gaps in tried if gaps is not None), None)

    def _gaps(
        self,
        sense: Sense,
        constraints: Constraints,
        threat: Threat,
        heading: float,
        time: float,
        ahead: float = AHEAD,
        speeds: tuple[float, float] = STAND,
    ) -> NDArray[np.float64] | None:
        """Return the least gap [m] to the threat on each of its courses; None: the way is not clear."""
        grid, robot = constraints.grid, self._robot
        least = np.empty(len(COURSES))
        pose, now = (sense.x, sense.y, sense.yaw), self._drive.rim_speeds(Twist(sense.linear, sense.angular))
        clear = _gaps(
            heading, round(time / self._dt), round(ahead / self._dt), *speeds,
            constraints.shut, np.array(constraints.local), grid.clearance, grid.resolution, np.array(grid.origin),
            constraints.bodies, robot.radius, np.array(pose), np.array(now),
            robot.track_width, robot.wheel_acceleration * self._dt, self._dt, np.array(threat), least,
        )  # fmt: skip
        return least if clear else None


def _likely(gaps: NDArray[np.float64]) -> float:
    """Return the weighted mean gap [m] on the likely courses; a gap above ``ENOUGH`` counts as ``ENOUGH``."""
    return float((np.minimum(gaps, ENOUGH) * LIKELY).sum())
