"""What stands between the fuzzy tables and the wheels: it slows, tightens a turn, stops; it never chooses where to.

The fuzzy controller steers. Its two speeds pass unchanged where the way they lead is clear. Where it is not, the mildest
of ``REMEDIES`` is taken that keeps clear: first the same arc, slower; then the same turn, with less way on; then none.
As the footprint is round, turning on the spot is always clear, so there is always a safe answer; as no remedy invents a
turn, a robot whose tables do not steer gets nowhere.
"""

from typing import Final, NamedTuple

from swarm.geometry import Pose, Twist
from swarm.messages import Sense, Steering
from swarm.planning.grid import Grid
from swarm.robot.kinematics import DifferentialDrive
from swarm.robot.lookahead import least_clearance
from swarm.scenario.schema import Settings

SPARE: Final = 0.03  # m, kept between the footprint and a wall
LOOK: Final = 0.4  # s, that far the way is looked ahead before the brake
GAP: Final = 0.1  # m, kept to whatever the front sector sees

# share of the forward speed, share of the yaw rate
REMEDIES: Final = ((1.0, 1.0), (0.7, 0.7), (0.45, 0.45), (0.25, 0.25), (0.3, 1.0), (0.1, 1.0), (0.0, 1.0))


class WheelSpeeds(NamedTuple):
    """Rim speeds [m/s] and whose they are."""

    left: float
    right: float
    steering: Steering


class Supervisor:
    """Keeps one robot clear of what its map and its sensors show."""

    def __init__(self, settings: Settings) -> None:
        robot = settings.robot
        self._drive = DifferentialDrive(robot.track_width, robot.wheel_radius)
        self._radius = robot.radius
        self._acceleration = robot.wheel_acceleration
        self._dt = 1.0 / settings.rate
        self._ticks = max(1, round(LOOK / self._dt))

    def check(self, sense: Sense, grid: Grid, left: float, right: float) -> WheelSpeeds:
        """Let the tables' speeds pass, or take the mildest remedy that keeps clear."""
        pose = Pose(sense.x, sense.y, sense.yaw)
        wanted = self._drive.twist(left, right)
        now = self._drive.rim_speeds(Twist(sense.linear, sense.angular))
        here = least_clearance(
            grid, pose, (0.0, 0.0), (0.0, 0.0), track_width=1.0, acceleration=1.0, dt=self._dt, ticks=1
        )
        need = min(self._radius + SPARE, here - 1e-3)  # one that stands too near already may still get away
        for forward, turn in REMEDIES:
            linear = wanted.linear * forward
            if linear > self._fastest(sense.front):
                continue
            speeds = self._drive.rim_speeds(Twist(linear, wanted.angular * turn))
            room = least_clearance(
                grid, pose, now, speeds, track_width=self._drive.track_width, acceleration=self._acceleration,
                dt=self._dt, ticks=self._ticks,
            )  # fmt: skip
            if room >= need:
                return WheelSpeeds(*speeds, Steering.FUZZY if forward == turn else Steering.SUPERVISOR)
        return self.stop()

    def stop(self) -> WheelSpeeds:
        """Stand."""
        return WheelSpeeds(0.0, 0.0, Steering.REST)

    def _fastest(self, front: float) -> float:
        """Speed [m/s] from which the brake stops the robot ``GAP`` before what the front sector sees: v = sqrt(2 a s)."""
        free = front - GAP
        return (2 * self._acceleration * free) ** 0.5 if free > 0 else 0.0
