"""What stands between the fuzzy tables and the wheels: it slows, tightens a turn, stops.

The fuzzy controller steers; this never chooses where to. The two speeds pass unchanged where the way they lead is
clear. Where it is not, the mildest of ``REMEDIES`` is taken that keeps clear: first the same arc, slower; then the same
turn, with less way on; then none. As the footprint is round, turning on the spot is always clear, so there is always a
safe answer. Where the tables do not turn out of a place without a way ahead (rules 22 and 25 cancel each other between
medium and far), it turns to the freer side until there is one. None of this knows the target: a robot whose tables do
not steer gets nowhere.
"""

from collections.abc import Callable, Sequence
from math import inf
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm.geometry import Pose, Twist
from swarm.maps.occupancy import Point
from swarm.messages import Sense
from swarm.planning.grid import Grid
from swarm.robot.kinematics import DifferentialDrive
from swarm.robot.lookahead import least_clearance
from swarm.scenario.schema import Settings

SPARE: Final = 0.03  # m, kept between the footprint and a wall
LOOK: Final = 0.4  # s, that far the way is looked ahead before the brake
GAP: Final = 0.1  # m, kept to whatever the front sector sees
BODY_SPARE: Final = 0.07  # m, kept beyond SPARE from another robot's last known place
STANDS: Final = 0.02  # m/s; slower than that a robot has come to a stand
PATIENCE: Final = 0.5  # s without a way ahead: the tables have had the time to turn out of it
CREEPS: Final = 0.1  # share of the forward speed that gets nowhere
HALTED: Final = 6  # times as long, where something unexplained is near: that may go away by itself
ESCAPE: Final = 1.0  # rad/s, turn on the spot then, to the side with more room,
ESCAPED: Final = 0.4  # m, until that much is free ahead
STRAIGHT: Final = 0.3  # m/s, and driving on straight at that speed would keep clear

# share of the forward speed, share of the yaw rate
REMEDIES: Final = ((1.0, 1.0), (0.7, 0.7), (0.45, 0.45), (0.25, 0.25), (0.3, 1.0), (0.1, 1.0), (0.0, 1.0))


RimSpeeds = tuple[float, float]  # left, right [m/s]
Room = Callable[[RimSpeeds, RimSpeeds], float]  # from those now and those wanted to the least distance [m]


class WheelSpeeds(NamedTuple):
    """Rim speeds [m/s]."""

    left: float
    right: float


class Supervisor:
    """Keeps one robot clear of what its map, its sensors and the radio show."""

    def __init__(self, settings: Settings) -> None:
        robot = settings.robot
        self._drive = DifferentialDrive(robot.track_width, robot.wheel_radius)
        self._radius = robot.radius
        self._acceleration = robot.wheel_acceleration
        self._dt = 1.0 / settings.rate
        self._ticks = max(1, round(LOOK / self._dt))
        self._patience = round(PATIENCE / self._dt)
        self._held = 0  # ticks in a row without a way ahead
        self._escape = 0.0  # rad/s, the turn on the spot it is in the middle of

    def check(
        self,
        sense: Sense,
        grid: Grid,
        others: Sequence[Point],
        halt: bool,
        left: float,
        right: float,
        beside: Room = lambda now, wanted: inf,
    ) -> WheelSpeeds:
        """Let the tables' speeds pass, or take the mildest remedy that keeps clear of walls and ``others``.

        ``halt``: something unexplained is near; there is no driving on, only turning. ``beside`` measures the room to
        whatever else is to be kept clear of, from the rim speeds now and those wanted.
        """
        pose = Pose(sense.x, sense.y, sense.yaw)
        wanted = self._drive.twist(left, right)
        now = self._drive.rim_speeds(Twist(sense.linear, sense.angular))
        bodies = np.array(others, np.float64).reshape(-1, 2)

        def room(now: RimSpeeds, wanted: RimSpeeds) -> float:
            return min(self._room(grid, pose, now, wanted, bodies), beside(now, wanted))

        if halt and abs(sense.linear) > STANDS:
            return WheelSpeeds(0.0, 0.0)  # to turn at once would take longer to come to a stand
        need = min(self._radius + SPARE, room((0.0, 0.0), (0.0, 0.0)) - 1e-3)
        if self._escape:
            ahead = sense.front >= ESCAPED and room(now, (STRAIGHT, STRAIGHT)) >= need
            if not ahead:
                return self._turn(self._escape)
            self._escape = 0.0
        for forward, turn in REMEDIES:
            linear = wanted.linear * forward
            if halt and linear > 0.0:
                continue
            if linear > self._fastest(sense.front):
                continue
            speeds = self._drive.rim_speeds(Twist(linear, wanted.angular * turn))
            if room(now, speeds) >= need:
                self._held = self._held + 1 if forward <= CREEPS else max(0, self._held - 2)
                if self._held > self._patience * (HALTED if halt else 1):
                    self._held, self._escape = 0, ESCAPE if sense.left >= sense.right else -ESCAPE
                return WheelSpeeds(*speeds)
        return self.stop()

    def stop(self) -> WheelSpeeds:
        """Stand."""
        return WheelSpeeds(0.0, 0.0)

    def _turn(self, rate: float) -> WheelSpeeds:
        return WheelSpeeds(*self._drive.rim_speeds(Twist(0.0, rate)))

    def _room(
        self,
        grid: Grid,
        pose: Pose,
        now: RimSpeeds,
        wanted: RimSpeeds,
        bodies: NDArray[np.float64],
    ) -> float:
        return least_clearance(
            grid, pose, now, wanted, bodies, body_radius=self._radius + BODY_SPARE,
            track_width=self._drive.track_width, acceleration=self._acceleration, dt=self._dt, ticks=self._ticks,
        )  # fmt: skip

    def _fastest(self, front: float) -> float:
        """Speed [m/s] from which the brake stops ``GAP`` before what the front sector sees: v = sqrt(2 a s)."""
        free = front - GAP
        return (2 * self._acceleration * free) ** 0.5 if free > 0 else 0.0
