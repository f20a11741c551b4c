"""What stands between the fuzzy tables and the wheels: it slows, tightens a turn, stops.

The fuzzy controller steers; this never chooses where to. The two speeds pass unchanged where the way they lead is
clear. Where it is not, the mildest of ``REMEDIES`` is taken that keeps clear: first the same arc, slower; then the same
turn, with less way on; then none. As the footprint is round, turning on the spot is always clear, so there is always a
safe answer. The check knows no target and begins no turn: a robot whose tables do not steer gets nowhere.
"""

from collections.abc import Sequence
from math import copysign, inf, isfinite, pi, sqrt
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm.geometry import Pose, Twist
from swarm.messages import Sense
from swarm.motion.drive import DifferentialDrive
from swarm.motion.sweep import NO_COMMANDS, braking_points, first_clear
from swarm.planning.grid import Grid
from swarm.settings import Settings

SPARE: Final = 0.03  # m, kept between the footprint and whatever it must not touch
LOOK: Final = 0.4  # s, that far a command is looked ahead before the brake
GAP: Final = 0.1  # m, kept to whatever the front sector sees
SLOW_BRAKE: Final = 0.6  # share of the braking power planned with when coming to a stop
NEARING: Final = 0.8  # 1/s, and speed per distance to there: so it turns round it ever more tightly
STANDS: Final = 0.02  # m/s; slower than that a robot has come to a stand
CREEP: Final = 0.05  # m/s; slower than that is no driving
STRAIGHT: Final = 0.3  # m/s; where driving straight on at that speed keeps clear there is a way ahead
DIRECTIONS: Final = 12  # tried to either side

TURN_UNTIL: Final = 0.07  # rad off the place to face
TURN_RATE: Final = 2.5  # rad/s at most on the spot
ABOUT: Final = 2.6  # rad off it: to turn either way is as good

# share of the forward speed, share of the yaw rate
REMEDIES: Final = np.array(((1.0, 1.0), (0.6, 0.6), (0.3, 0.3), (0.6, 1.0), (0.3, 1.0), (0.1, 1.0), (0.0, 1.0)))
AS_IT_IS: Final = np.array(((1.0, 1.0),))
TURNS: Final = np.array(((1.0, 1.0), (0.6, 1.0), (0.3, 1.0), (0.0, 1.0)))  # of a way out
NO_BODIES: Final = np.empty((0, 2))
AT_REST: Final = np.empty((0, 2))  # m; a body that stands needs no way to come to rest


class WheelSpeeds(NamedTuple):
    """Rim speeds [m/s]."""

    left: float
    right: float


STAND: Final = WheelSpeeds(0.0, 0.0)


class Body(NamedTuple):
    """Where a robot is and how its wheels turn now."""

    pose: Pose
    left: float  # m/s, rim speed
    right: float


class Constraints(NamedTuple):
    """What the wheels have to heed at one tick."""

    grid: Grid  # walls
    shut: NDArray[np.float64]  # (n, 4): cells not granted, low x, low y, high x, high y [m, in the lattice's frame]
    local: Pose  # the robot's, in the lattice's frame
    bodies: NDArray[np.float64]  # (n, 2): m, those near that are known
    stop_within: float = inf  # m, so far ahead it has to stand at the latest
    slowly: bool = False  # and more and more slowly, to stand in the very place
    may_drive: bool = True  # False: something unexplained is near; it may only turn


class SafetyFilter:
    """Keeps one robot clear."""

    def __init__(self, settings: Settings) -> None:
        robot = settings.robot
        self._drive = DifferentialDrive(robot.track_width, robot.wheel_radius)
        self._radius = robot.radius
        self._acceleration = robot.wheel_acceleration
        self._dt = 1.0 / settings.rate
        self._ticks = max(1, round(LOOK / self._dt))
        self._side = 0.0  # of the turn to face something that it was last told to make; 0: none

    def check(self, sense: Sense, tables: tuple[float, float], constraints: Constraints) -> WheelSpeeds:
        """Let the tables' rim speeds [m/s] pass, or take the mildest remedy that keeps clear; stand if they are NaN."""
        wanted = self._drive.twist(*tables)
        if not (isfinite(wanted.linear) and isfinite(wanted.angular)):
            return STAND  # the kernel's comparisons would call it clear
        if not constraints.may_drive and abs(sense.linear) > STANDS:
            return STAND  # to turn at once would take longer to come to a stand
        fastest = self._fastest(sense.front, constraints)
        gently = sqrt(2 * SLOW_BRAKE * self._acceleration * max(0.0, constraints.stop_within))
        if constraints.slowly:
            gently = min(gently, NEARING * constraints.stop_within)
        wanted = Twist(min(wanted.linear, gently), wanted.angular)
        number, speeds = self._first(REMEDIES, sense, wanted, constraints, fastest)
        return STAND if number < 0 else speeds

    def out(self, sense: Sense, wanted: Twist, constraints: Constraints) -> WheelSpeeds:
        """Return the speeds of a way out: as wanted, or slower where that is not clear."""
        number, speeds = self._first(TURNS, sense, wanted, constraints, self._fastest(sense.front, constraints))
        return STAND if number < 0 else speeds

    def face(self, body: Body, error: float) -> WheelSpeeds:
        """Turn on the spot by ``error`` [rad]: brake first, then as fast as can be stopped in time, sqrt(2 a e)."""
        if abs(body.left + body.right) > 2 * STANDS:
            return STAND
        if abs(error) > ABOUT and self._side * error < 0.0:
            error = -error  # as good a way round, and the one it is on; what the wheels do now may be an old command's
        self._side = copysign(1.0, error)
        angular_brake = 2 * SLOW_BRAKE * self._acceleration / (self._drive.track_width / 2)
        rate = min(TURN_RATE, sqrt(angular_brake * max(0.0, abs(error) - TURN_UNTIL / 2)))
        return WheelSpeeds(*self._drive.rim_speeds(Twist(0.0, copysign(rate, error))))

    def braking(self, body: Body, under_way: Sequence[tuple[float, float]] = ()) -> NDArray[np.float64]:
        """Return the points ((n, 2), m) on which the body would come to rest, to keep the cells under them.

        ``under_way`` are the newest commands, oldest first, of which any number may still be carried out.
        """
        if body.left == body.right == 0.0 and not any(map(any, under_way)):
            return AT_REST
        commands = np.array(under_way, np.float64) if under_way else NO_COMMANDS
        most = self._acceleration * self._dt
        points: NDArray[np.float64] = braking_points(
            *body.pose, body.left, body.right, self._drive.track_width, most, self._dt, commands
        )
        return points

    def way_ahead(self, sense: Sense, constraints: Constraints) -> bool:
        """Return True if the robot can drive straight on."""
        fastest = self._fastest(sense.front, constraints)
        return fastest >= STRAIGHT and self._clear_ahead(sense, constraints)

    def freer_side(self, sense: Sense, constraints: Constraints) -> int:
        """Return 1 for left, -1 for right: where it has to turn less until there is a way ahead."""
        first = 1 if sense.left >= sense.right else -1
        for step in range(1, DIRECTIONS + 1):
            for side in (first, -first):
                off = side * step * pi / DIRECTIONS
                if self._clear_ahead(sense, constraints, off):
                    return side
        return first

    def _clear_ahead(self, sense: Sense, constraints: Constraints, off: float = 0.0) -> bool:
        return self._first(AS_IT_IS, sense, Twist(STRAIGHT, 0.0), constraints, inf, off)[0] >= 0

    def _first(
        self,
        remedies: NDArray[np.float64],
        sense: Sense,
        wanted: Twist,
        constraints: Constraints,
        fastest: float,
        off: float = 0.0,
    ) -> tuple[int, WheelSpeeds]:
        """Find the first remedy that keeps clear, -1 for none; from a stand ``off`` [rad] the heading where that is."""
        grid, (x, y, yaw) = constraints.grid, constraints.local
        now = (0.0, 0.0) if off else self._drive.rim_speeds(Twist(sense.linear, sense.angular))
        number, left, right = first_clear(
            remedies, *wanted, fastest, CREEP, self._radius + SPARE, constraints.shut, x, y, yaw + off,
            grid.clearance, grid.resolution, *grid.origin, constraints.bodies, self._radius,
            sense.x, sense.y, sense.yaw + off, *now,
            self._drive.track_width, self._acceleration * self._dt, self._dt, self._ticks,
        )  # fmt: skip
        return int(number), WheelSpeeds(left, right)

    def _fastest(self, front: float, constraints: Constraints) -> float:
        """Return the forward speed [m/s] from which the brake stops in time: v = sqrt(2 a s).

        That is ``GAP`` before what the front sector sees.
        """
        return sqrt(2 * self._acceleration * max(0.0, front - GAP)) if constraints.may_drive else 0.0
