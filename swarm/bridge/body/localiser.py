"""Where a robot is in the map: the last localisation, and from there on its odometry, as AMCL's map -> odom. Pure."""

from collections import deque
from math import pi
from typing import Final, NamedTuple

from swarm.bridge.body.readings import Localisation, Odometry
from swarm.geometry import Pose, Twist, distance, from_frame, integrate, to_frame, wrap

KEPT: Final = 100  # odometries, to find that of the time of a localisation
SLACK: Final = 0.1  # m that a pose may move beyond the top speed: localisation corrects itself by centimetres
TURN_SLACK: Final = 0.35  # rad, 20 degrees, likewise
AHEAD: Final = 0.3  # s; the longest time that the last twist is believed to go on


class SpeedLimits(NamedTuple):
    """How fast a robot can be."""

    linear: float  # m/s
    angular: float  # rad/s


class StampedOdometry(NamedTuple):
    """An odometry and when it came."""

    at: float  # s, of this process's clock
    odometry: Odometry


class Localiser:
    """The pose of one robot.

    Without localisations the robot is where ``begin_at`` says, and odometry counts from its message of that moment.
    """

    def __init__(self, limits: SpeedLimits) -> None:
        self._limits = limits
        self._correction: Pose | None = None  # odom in map; None: not known
        self._heard: deque[StampedOdometry] = deque(maxlen=KEPT)
        self._early: Localisation | None = None  # came without odometry: AMCL says it only once while the robot stands
        self.lost = ""  # why it is not known any more where the robot is
        self.alone = 0.0  # m, driven since the last localisation

    @property
    def last_odometry_time(self) -> float | None:
        """When the last odometry came [s]; None: never."""
        return self._heard[-1].at if self._heard else None

    @property
    def twist(self) -> Twist:
        """The last twist that was measured."""
        return self._heard[-1].odometry.twist if self._heard else Twist(0.0, 0.0)

    @property
    def is_known(self) -> bool:
        """True if the pose is known."""
        return self._correction is not None and bool(self._heard)

    def set_pose(self, pose: Pose) -> None:
        """Take a pose in the map for that of now."""
        self._correction = odom_in_map(pose, self._heard[-1].odometry.pose)
        self.lost = ""

    def take_odometry(self, odometry: Odometry, now: float) -> str:
        """Take in an odometry that came at ``now`` [s]; return how it jumped, or nothing.

        By REP-105 odometry is continuous. If it is not, nobody knows how the robot moved, but a localisation will.
        """
        jump = ""
        if self._heard:
            before = self._heard[-1]
            time = max(odometry.stamp - before.odometry.stamp, now - before.at)
            jump = describe_jump(before.odometry.pose, odometry.pose, self._limits, time)
            self.alone += distance(before.odometry.pose, odometry.pose)
        if jump:
            self._heard.clear()
            self._correction = None
            self.lost = f"its odometry {jump}"
        self._heard.append(StampedOdometry(now, odometry))
        if self._early is not None:
            early, self._early = self._early, None
            self.take_localisation(early, now)
        return jump

    def take_localisation(self, found: Localisation, now: float) -> str:
        """Take in a localisation that came at ``now`` [s]; return how the robot jumped by it, or nothing."""
        if not self._heard or now - self._heard[-1].at > AHEAD:
            self._early = found
            return ""
        then = min(self._heard, key=lambda heard: abs(heard.odometry.stamp - found.stamp)).odometry
        later = found.stamp - then.stamp
        if abs(later) > AHEAD:  # no stamp, that of another clock, or kept for who comes late: it counts for now
            then, later = self._heard[-1].odometry, 0.0
        before = self.pose_at(now)
        at_that_time = integrate(then.pose, then.twist, later)
        self._correction = odom_in_map(found.pose, at_that_time)
        self.lost, self.alone = "", 0.0
        after = self.pose_at(now)
        assert after is not None, "it has been corrected"
        return "" if before is None else describe_jump(before, after, self._limits, 0.0)

    def pose_at(self, now: float) -> Pose | None:
        """Return where the robot is in the map at ``now`` [s], if it goes on as it did; None: nobody knows."""
        if self._correction is None or not self._heard:
            return None
        last = self._heard[-1]
        x, y, yaw = integrate(last.odometry.pose, last.odometry.twist, min(AHEAD, max(0.0, now - last.at)))
        return Pose(*from_frame(self._correction, x, y), wrap(self._correction.yaw + yaw))


def odom_in_map(in_map: Pose, in_odom: Pose) -> Pose:
    """Return the pose of ``odom`` in ``map``, from a robot's pose in both."""
    yaw = wrap(in_map.yaw - in_odom.yaw)
    x, y = to_frame(Pose(0.0, 0.0, -yaw), in_odom.x, in_odom.y)
    return Pose(in_map.x - x, in_map.y - y, yaw)


def describe_jump(before: Pose, after: Pose, limits: SpeedLimits, time: float) -> str:
    """Return how a pose changed if a robot cannot have moved so in a time [s], else nothing."""
    moved, turned = distance(before, after), abs(wrap(after.yaw - before.yaw))
    if moved > limits.linear * time + SLACK:
        return f"jumped {moved:.2f} m in {time:.2f} s"
    if turned > min(pi, limits.angular * time + TURN_SLACK):
        return f"turned {turned:.2f} rad in {time:.2f} s"
    return ""
