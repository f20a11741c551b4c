"""The safety filter between the fuzzy tables and the wheels: it slows the robot, tightens a turn, or stops.

The fuzzy controller steers; the filter never chooses a direction. The two rim speeds pass unchanged if the way that
they lead is clear. Otherwise the filter takes the first of ``SAFETY.remedies`` that keeps clear: the same arc, slower;
then the same yaw rate with less forward speed; then a turn in place. The footprint is round, so a turn in place is
always clear and there is always a safe answer. The check knows no target and begins no turn: a robot whose tables do
not steer gets nowhere.

Where wheels answer late, what brakes and what stops before a body reckon with the commands that ``Lateness`` says are
still on their way.
"""

from collections.abc import Sequence
from math import copysign, hypot, inf, isfinite, pi, sqrt
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm.geometry import Pose, Twist, integrate
from swarm.messages import Sense
from swarm.motion.drive import NO_COMMANDS, DifferentialDrive, braking_points, first_clear, ramp
from swarm.planning.grid import Grid
from swarm.robot.tuning import SAFETY
from swarm.settings import Settings
from swarm.traffic.interface import MovingObstacle

AS_IT_IS: Final = np.array(((1.0, 1.0),))
NO_BODIES: Final = np.empty((0, 3))
AT_REST: Final = np.empty((0, 2))  # m; a standing body has no braking path

RimSpeeds = tuple[float, float]  # left, right [m/s]


class WheelSpeeds(NamedTuple):
    """Rim speeds [m/s]."""

    left: float
    right: float


STAND: Final = WheelSpeeds(0.0, 0.0)


class DriveState(NamedTuple):
    """A robot's pose and rim speeds."""

    pose: Pose
    left: float  # m/s, rim speed
    right: float  # m/s, rim speed


class Constraints(NamedTuple):
    """The limits on the wheel speeds at one tick."""

    grid: Grid  # walls
    shut: NDArray[np.float64]  # (n, 4): cells not granted, low x, low y, high x, high y [m, in the lattice's frame]
    local: Pose  # the robot's pose in the lattice's frame
    bodies: NDArray[np.float64]  # (n, 3): m, centre and radius of known bodies nearby
    stop_within: float = inf  # m, distance within which it has to stop
    slowly: bool = False  # it slows down all the way, to stop exactly there
    may_drive: bool = True  # False: an unexpected obstacle is near; the robot may only turn
    fastest: float = inf  # m/s, forward speed near threats while commands reach the wheels late
    uncertainty: float = 0.0  # m, how far the body may be from where it is expected
    front_gap: float = SAFETY.front_gap  # m, to everything that the front sector sees


class SafetyFilter:
    """The safety filter of one robot: it keeps clear of walls, bodies and cells that the robot does not hold."""

    def __init__(self, settings: Settings) -> None:
        robot = settings.robot
        self._drive = DifferentialDrive(robot.track_width)
        self._radius = robot.radius
        self._acceleration = robot.wheel_acceleration
        self._dt = 1.0 / settings.rate
        self._ticks = max(1, round(SAFETY.look / self._dt))
        self._side = 0.0  # sign of the last turn to face a point, left positive; 0: none

    def check(self, sense: Sense, tables: tuple[float, float], constraints: Constraints) -> WheelSpeeds:
        """Return the tables' rim speeds [m/s], changed by the first remedy that keeps clear; stand if they are NaN."""
        wanted = self._drive.twist(*tables)
        if not (isfinite(wanted.linear) and isfinite(wanted.angular)):
            return STAND  # the kernel's comparisons would accept NaN as clear
        if not constraints.may_drive and abs(sense.linear) > SAFETY.stands:
            return STAND  # a turn at once would lengthen the braking
        fastest = self._fastest(sense.front, constraints)
        gently = sqrt(2 * SAFETY.gentle * self._acceleration * max(0.0, constraints.stop_within))
        if constraints.slowly:
            gently = min(gently, SAFETY.nearing * constraints.stop_within)
        wanted = Twist(min(wanted.linear, gently), wanted.angular)
        number, speeds = self._first(SAFETY.remedies, sense, wanted, constraints, fastest)
        return STAND if number < 0 else speeds

    def limit_way_out(self, sense: Sense, wanted: Twist, constraints: Constraints) -> WheelSpeeds:
        """Return the rim speeds [m/s] of a way out: as wanted, or slower if that is not clear."""
        if constraints.fastest < sense.linear:
            return STAND  # a turn at once would lengthen the braking
        number, speeds = self._first(SAFETY.turns, sense, wanted, constraints, self._fastest(sense.front, constraints))
        return STAND if number < 0 else speeds

    def face(self, body: DriveState, error: float) -> WheelSpeeds:
        """Return rim speeds for a turn in place by ``error`` [rad]: brake first, then at most sqrt(2 a e) [rad/s]."""
        if abs(body.left + body.right) > 2 * SAFETY.stands:
            return STAND
        if abs(error) > SAFETY.half_turn and self._side * error < 0.0:
            error = -error  # keep the direction of turn; the wheels' speeds may come from an old command
        self._side = copysign(1.0, error)
        angular_brake = 2 * SAFETY.gentle * self._acceleration / (self._drive.track_width / 2)
        rate = min(SAFETY.turn_rate, sqrt(angular_brake * max(0.0, abs(error) - SAFETY.turn_until / 2)))
        return WheelSpeeds(*self._drive.rim_speeds(Twist(0.0, copysign(rate, error))))

    def braking(self, body: DriveState, under_way: Sequence[tuple[float, float]] = ()) -> NDArray[np.float64]:
        """Return the points (n, 2) [m] that the body passes while it brakes; the robot keeps the cells under them.

        ``under_way`` are the newest commands [m/s], oldest first; the wheels may still carry out any number of them.
        """
        if body.left == body.right == 0.0 and not any(map(any, under_way)):
            return AT_REST
        commands = np.array(under_way, np.float64) if under_way else NO_COMMANDS
        most = self._acceleration * self._dt
        points: NDArray[np.float64] = braking_points(
            *body.pose, body.left, body.right, self._drive.track_width, most, self._dt, commands
        )
        return points

    def state_after(self, body: DriveState, late: Sequence[tuple[float, float]]) -> DriveState:
        """Return where the body is, and how fast, when the wheels have carried out the ``late`` commands [m/s]."""
        pose, left, right = body
        most = self._acceleration * self._dt
        for wanted in late:
            left, right = ramp(left, wanted[0], most), ramp(right, wanted[1], most)
            pose = integrate(pose, self._drive.twist(left, right), self._dt)
        return DriveState(pose, left, right)

    def near_threats(
        self, body: DriveState, late: Sequence[tuple[float, float]], threats: Sequence[MovingObstacle], nearest: float
    ) -> float:
        """Return the forward speed [m/s] from which a robot stops before a body that it sees, ``nearest`` [m] away.

        ``late`` are the commands [m/s] that the wheels carry out before the next one, oldest first. Meanwhile the robot
        drives on and turns, so no body ahead counts as beside its way; and the fastest of the ``threats`` comes nearer,
        also while the robot brakes. If no command is late, there is no limit here: that of the front sector is enough.
        """
        if not late or not threats:
            return inf
        left, right, nearer, most = body.left, body.right, 0.0, self._acceleration * self._dt
        for wanted in late:
            left, right = ramp(left, wanted[0], most), ramp(right, wanted[1], most)
            nearer += max(0.0, left + right) / 2 * self._dt
        comes = max(hypot(threat.vx, threat.vy) for threat in threats)
        return self._fastest_within(nearest - nearer - comes * len(late) * self._dt - SAFETY.front_gap, comes)

    def way_ahead(self, sense: Sense, constraints: Constraints) -> bool:
        """Return True if the way straight ahead is clear."""
        fastest = self._fastest(sense.front, constraints)
        return fastest >= SAFETY.straight and self._clear_ahead(sense, constraints)

    def freer_side(self, sense: Sense, constraints: Constraints) -> int:
        """Return the side on which a clear way ahead needs the smaller turn: 1 left, -1 right."""
        first = 1 if sense.left >= sense.right else -1
        for step in range(1, SAFETY.directions + 1):
            for side in (first, -first):
                off = side * step * pi / SAFETY.directions
                if self._clear_ahead(sense, constraints, off):
                    return side
        return first

    def _clear_ahead(self, sense: Sense, constraints: Constraints, off: float = 0.0) -> bool:
        return self._first(AS_IT_IS, sense, Twist(SAFETY.straight, 0.0), constraints, inf, off)[0] >= 0

    def _first(
        self,
        remedies: NDArray[np.float64],
        sense: Sense,
        wanted: Twist,
        constraints: Constraints,
        fastest: float,
        off: float = 0.0,
    ) -> tuple[int, WheelSpeeds]:
        """Return the index of the first clear remedy (-1: none) and its rim speeds [m/s].

        With ``off`` [rad] the robot is taken to stand, turned by that angle.
        """
        grid, (x, y, yaw) = constraints.grid, constraints.local
        now = (0.0, 0.0) if off else self._drive.rim_speeds(Twist(sense.linear, sense.angular))
        keeps = self._radius + SAFETY.gap + constraints.uncertainty
        number, left, right = first_clear(
            remedies, *wanted, fastest, SAFETY.creep, keeps, constraints.shut, x, y, yaw + off,
            grid.clearance, grid.resolution, *grid.origin, constraints.bodies, self._radius,
            sense.x, sense.y, sense.yaw + off, *now,
            self._drive.track_width, self._acceleration * self._dt, self._dt, self._ticks,
        )  # fmt: skip
        return int(number), WheelSpeeds(left, right)

    def _fastest(self, front: float, constraints: Constraints) -> float:
        """Return the forward speed [m/s] from which the robot can stop before what it sees ahead."""
        if not constraints.may_drive:
            return 0.0
        return min(self._fastest_within(front - constraints.front_gap), constraints.fastest)

    def _fastest_within(self, room: float, comes: float = 0.0) -> float:
        """Return the speed [m/s] from which the robot stops within ``room`` [m].

        v = sqrt(2 a s), or a little less if what is ahead ``comes`` nearer [m/s] meanwhile: s = v^2 / 2a + comes v / a.
        """
        return sqrt(comes**2 + 2 * self._acceleration * max(0.0, room)) - comes
