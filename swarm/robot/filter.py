"""What stands between the fuzzy tables and the wheels: it slows, tightens a turn, stops.

The fuzzy controller steers; this never chooses where to. The two speeds pass unchanged where the way they lead is
clear. Where it is not, the mildest of ``REMEDIES`` is taken that keeps clear: first the same arc, slower; then the same
turn, with less way on; then none. As the footprint is round, turning on the spot is always clear, so there is always a
safe answer. Where that gets nowhere for a while, it turns to the freer side until there is a way ahead. None of this
knows the target: a robot whose tables do not steer gets nowhere.
"""

from math import copysign, hypot, inf, pi, sqrt
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm.geometry import Twist
from swarm.maps.occupancy import ORIGIN
from swarm.messages import Sense, Steering
from swarm.planning.grid import Grid
from swarm.robot.kinematics import DifferentialDrive
from swarm.scenario.schema import Settings
from swarm.traffic.sweep import first_clear

SPARE: Final = 0.03  # m, kept between the footprint and whatever it must not touch
TIGHT: Final = 0.01  # m, enough where it has been pushed nearer
LOOK: Final = 0.4  # s, that far a command is looked ahead before the brake
GAP: Final = 0.1  # m, kept to whatever the front sector sees
SLOW_BRAKE: Final = 0.6  # share of the braking power planned with when coming to a stop
STANDS: Final = 0.02  # m/s; slower than that a robot has come to a stand
PATIENCE: Final = 3.0  # s without a way ahead: the tables have had the time to turn out of it
PROGRESS: Final = 0.1  # m in that time are some
CREEP: Final = 0.05  # m/s; slower is not driving
FAR_ENOUGH: Final = 0.4  # m straight on end an escape
ESCAPE: Final = 1.5  # rad/s, turn on the spot then, to the side with more room
STRAIGHT: Final = 0.3  # m/s, and driving on straight at that speed would keep clear
DIRECTIONS: Final = 12  # tried to either side

# share of the forward speed, share of the yaw rate
REMEDIES: Final = np.array((
    (1.0, 1.0), (0.7, 0.7), (0.45, 0.45), (0.6, 1.0), (0.3, 1.0), (0.25, 0.25), (0.1, 1.0), (0.0, 1.0),
))  # fmt: skip
AHEAD: Final = np.array(((1.0, 1.0),))
TURNS: Final = np.array(((0.0, 1.0),))


class WheelSpeeds(NamedTuple):
    """Rim speeds [m/s] and whose they are."""

    left: float
    right: float
    steering: Steering


class Limits(NamedTuple):
    """What the wheels must heed."""

    grid: Grid  # walls
    shut: NDArray[np.float64]  # (n, 4): cells that are not granted, low x, low y, high x, high y [m, lattice frame]
    local: tuple[float, float, float]  # the pose in the lattice's frame
    bodies: NDArray[np.float64]  # (n, 2): m, others and what was found
    fastest: float = inf  # m/s forward
    may_drive: bool = True  # False: turning only


class Filter:
    """One robot's safety filter. It remembers how long there was no way ahead, and an escape it is in the middle of."""

    def __init__(self, settings: Settings) -> None:
        robot = settings.robot
        self._drive = DifferentialDrive(robot.track_width, robot.wheel_radius)
        self._radius = robot.radius
        self._acceleration = robot.wheel_acceleration
        self._dt = 1.0 / settings.rate
        self._ticks = max(1, round(LOOK / self._dt))
        self._anchor = (inf, inf, 0.0)  # where it last got on, and when
        self._leaving: tuple[float, float, float] | None = None  # from where it escapes
        self._escape = 0.0  # rad/s, the turn on the spot that an escape begins with

    def check(self, sense: Sense, tables: tuple[float, float], limits: Limits) -> WheelSpeeds:
        """Let the tables' rim speeds [m/s] pass, or take the mildest remedy that keeps clear."""
        if not limits.may_drive and abs(sense.linear) > STANDS:
            return WheelSpeeds(0.0, 0.0, Steering.SUPERVISOR)  # to turn at once would take longer to come to a stand
        fastest = min(limits.fastest, self._fastest(sense.front)) if limits.may_drive else 0.0
        wanted = self._drive.twist(*tables)
        if self._leaving is not None:
            ahead = self._first(AHEAD, sense, Twist(STRAIGHT, 0.0), limits, min(STRAIGHT, fastest))
            clear = ahead[0] >= 0 and fastest >= CREEP
            if self._escape and not (clear and fastest >= STRAIGHT):
                return self.turn(self._escape)
            self._escape = 0.0
            if clear and hypot(sense.x - self._leaving[0], sense.y - self._leaving[1]) < FAR_ENOUGH:
                return WheelSpeeds(ahead[1], ahead[2], Steering.SUPERVISOR)
            self._leaving = None
        number, left, right = self._first(REMEDIES, sense, wanted, limits, fastest)
        if number < 0:
            return WheelSpeeds(0.0, 0.0, Steering.SUPERVISOR)
        self._watch(sense, limits)
        share, turn = REMEDIES[int(number)]
        return WheelSpeeds(left, right, Steering.FUZZY if share == turn else Steering.SUPERVISOR)

    def _watch(self, sense: Sense, limits: Limits) -> None:
        """Begin to escape where it has got nowhere for long."""
        x, y, since = self._anchor
        if hypot(sense.x - x, sense.y - y) > PROGRESS or not limits.may_drive:
            self._anchor = sense.x, sense.y, sense.time
        elif sense.time - since > PATIENCE:
            self._anchor = self._leaving = sense.x, sense.y, sense.time
            self._escape = copysign(ESCAPE, self._freer_side(sense, limits))

    def turn(self, rate: float) -> WheelSpeeds:
        """Turn on the spot."""
        return WheelSpeeds(*self._drive.rim_speeds(Twist(0.0, rate)), Steering.SUPERVISOR)

    def stop(self) -> WheelSpeeds:
        """Stand."""
        self._anchor, self._leaving, self._escape = (inf, inf, 0.0), None, 0.0
        return WheelSpeeds(0.0, 0.0, Steering.REST)

    def _freer_side(self, sense: Sense, limits: Limits) -> float:
        """Return 1 for left, -1 for right: where it has to turn less until there is a way ahead."""
        first = 1 if sense.left >= sense.right else -1
        x, y, yaw = limits.local
        for step in range(1, DIRECTIONS + 1):
            for side in (first, -first):
                off = side * step * pi / DIRECTIONS
                turned = limits._replace(local=(x, y, yaw + off))
                if self._first(AHEAD, sense, Twist(STRAIGHT, 0.0), turned, inf, off)[0] >= 0:
                    return side
        return first

    def _first(
        self, remedies: NDArray[np.float64], sense: Sense, wanted: Twist, limits: Limits, fastest: float, off: float = 0.0
    ) -> tuple[float, float, float]:
        grid = limits.grid
        now = self._drive.rim_speeds(Twist(sense.linear, sense.angular)) if not off else (0.0, 0.0)
        found: tuple[float, float, float] = first_clear(
            remedies, *wanted, fastest, self._need(sense, limits), limits.shut, *limits.local,
            grid.clearance, grid.resolution, *grid.origin, limits.bodies, self._radius, sense.x, sense.y,
            sense.yaw + off, *now, self._drive.track_width, self._acceleration * self._dt, self._dt, self._ticks,
        )  # fmt: skip
        return found

    def _need(self, sense: Sense, limits: Limits) -> float:
        """Return the room the centre has to keep [m]: no more than there is where it stands."""
        need = self._radius + SPARE
        stands = TURNS, sense, Twist(0.0, 0.0)
        from swarm.robot.lookahead import least_clearance
        from swarm.traffic.sweep import path_room
        here = path_room(limits.shut, *limits.local, 0.0, 0.0, 0.0, 0.0, self._drive.track_width, 1.0, self._dt, 1)
        from swarm.geometry import Pose
        here = min(here, least_clearance(limits.grid, Pose(sense.x, sense.y, sense.yaw), (0.0, 0.0), (0.0, 0.0), limits.bodies, body_radius=self._radius, track_width=self._drive.track_width, acceleration=self._acceleration, dt=self._dt, ticks=1))
        return min(need, here - 1e-3)

    def _fastest(self, front: float) -> float:
        """Speed [m/s] from which the brake stops ``GAP`` before what the front sector sees: v = sqrt(2 a s)."""
        free = front - GAP
        return sqrt(2 * self._acceleration * free) if free > 0 else 0.0
