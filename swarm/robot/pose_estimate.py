"""Where a robot is, and how sure it is of that: what its localiser says, bounded over time by what its wheels do.

A localiser says how good its pose is by a radius and an angle that hold in 95 % of all cases. The robot keeps BOUND and
YAW_BOUND times that. Its true pose is then within these of each pose that it is told (a fix), and from one fix to the
next it moves as the wheels say, give or take their slip. So it is in the discs around all fixes at once, and the
estimate is the smallest disc around what the last estimate and the new fix share: set-membership estimation (Schweppe
1968), here with discs. It does not tremble as fixes do, and it is never worse than one fix.

A fix that shares nothing with the estimate is a jump: one of the two is wrong. The estimate then covers both until the
robot is sure: a fix agrees with the old one only, or the fixes stay at the new one for SURE.
"""

from math import hypot, log, sqrt
from typing import Final, NamedTuple

from swarm.geometry import Pose, Twist, integrate, wrap
from swarm.messages import Sense

# standard deviations: 95 % of normal errors in the plane are within this radius
WITHIN_95: Final = sqrt(-2 * log(0.05))
YAW_WITHIN_95: Final = 1.96  # standard deviations: 95 % of normal errors of an angle are within this
BOUND: Final = 3.0 / WITHIN_95  # times what is told: three standard deviations
YAW_BOUND: Final = 3.0 / YAW_WITHIN_95
ROUNDING: Final = 1e-6  # m and rad
SLIP: Final = 0.05  # share of a way or a turn that the wheels may be wrong by (benchmarks/localisation.py: 3 to 5 %)
AWAY: Final = 0.5  # s without a sense, after which only the fix counts: nobody has seen what the wheels did
SURE: Final = 4.0  # s for which fixes stay at a new pose before it is believed


class Disc(NamedTuple):
    """A disc in the map [m]."""

    x: float
    y: float
    radius: float


class Estimate(NamedTuple):
    """A pose: the true one is within ``error`` of its place, and within ``yaw_error`` of its yaw."""

    pose: Pose
    error: float = 0.0  # m
    yaw_error: float = 0.0  # rad
    jumped: float = 0.0  # m, how far a fix is from the old pose while it is open which of them is right; else 0

    def allowance(self, way: float) -> float:
        """Return how far [m] the body may be from where it is expected after a ``way`` [m], at most.

        It is off by the error of its place, and to a side by the way times the sine of the error of its yaw.
        """
        return self.error + way * self.yaw_error


def intersect(a: Disc, b: Disc) -> Disc | None:
    """Return the smallest disc around what two discs share; None if they share nothing."""
    small, large = (a, b) if a.radius <= b.radius else (b, a)
    dx, dy = large.x - small.x, large.y - small.y
    apart = hypot(dx, dy)
    if apart > a.radius + b.radius:
        return None
    if apart == 0.0:
        return small
    along = (apart**2 + small.radius**2 - large.radius**2) / (2 * apart)  # m, from the small centre to the common chord
    if along <= 0.0:
        return small
    half_chord = sqrt(max(0.0, small.radius**2 - along**2))
    return Disc(small.x + along * dx / apart, small.y + along * dy / apart, half_chord)


def smallest_cover(a: Disc, b: Disc) -> Disc:
    """Return the smallest disc around two discs."""
    small, large = (a, b) if a.radius <= b.radius else (b, a)
    dx, dy = small.x - large.x, small.y - large.y
    apart = hypot(dx, dy)
    if apart + small.radius <= large.radius:
        return large
    radius = (apart + a.radius + b.radius) / 2
    along = (radius - large.radius) / apart
    return Disc(large.x + along * dx, large.y + along * dy, radius)


class Belief(NamedTuple):
    """One answer to where the robot is."""

    disc: Disc
    yaw: float  # rad
    yaw_error: float  # rad

    def predict(self, twist: Twist, dt: float, unseen: Twist) -> "Belief":
        """Return the belief ``dt`` [s] later, after a twist that may have been off by ``unseen`` all the time."""
        (x, y, radius), yaw, yaw_error = self
        pose = integrate(Pose(x, y, yaw), twist, dt)
        way, turn = abs(twist.linear) * dt, SLIP * abs(twist.angular) * dt
        turn += unseen.angular * dt
        grown = radius + way * (SLIP + yaw_error + turn) + unseen.linear * dt
        return Belief(Disc(pose.x, pose.y, grown), pose.yaw, yaw_error + turn)

    def correct(self, fix: "Belief") -> "Belief | None":
        """Return what holds if this belief and a fix both hold; None if they cannot."""
        disc = intersect(self.disc, fix.disc)
        off = wrap(fix.yaw - self.yaw)
        low, high = max(-self.yaw_error, off - fix.yaw_error), min(self.yaw_error, off + fix.yaw_error)
        if disc is None or low > high:
            return None
        return Belief(disc, wrap(self.yaw + (low + high) / 2), (high - low) / 2)


class PoseEstimator:
    """The pose estimate of one robot. Poses that are told to be exact pass unchanged.

    ``dt`` [s] is a tick, ``acceleration`` [m/s2] that of the wheels, ``track_width`` [m] is between them. ``start`` is
    where the robot stands when its run begins; None: it was not there then, or nobody knows.
    """

    def __init__(self, dt: float, acceleration: float, track_width: float, start: Pose | None = None) -> None:
        self._dt, self._acceleration, self._track_width = dt, acceleration, track_width
        self._belief = None if start is None else Belief(Disc(start.x, start.y, 0.0), start.yaw, 0.0)
        self._doubt: Belief | None = None  # the new pose after a jump
        self._tick: int | None = None  # of the last fix
        self._jumped_at = 0  # tick
        self._against = 0  # fixes since then that speak against the old belief

    def update(self, sense: Sense) -> Estimate:
        """Return the estimate at the tick of a sense; call it once for each."""
        told = Pose(sense.x, sense.y, sense.yaw)
        if not sense.pose_error and not sense.yaw_error:
            self._belief = self._doubt = None
            return Estimate(told)
        radius, yaw_error = BOUND * sense.pose_error + ROUNDING, YAW_BOUND * sense.yaw_error + ROUNDING
        fix = Belief(Disc(told.x, told.y, radius), told.yaw, yaw_error)
        old, new = self._belief, self._doubt
        if old is None:
            old = fix
        elif self._tick is None:
            old = old.correct(fix) or fix
        else:
            time = (sense.tick - self._tick) * self._dt
            faster = self._acceleration * (time - self._dt)  # m/s, that the wheels may have been between two senses
            twist, unseen = Twist(sense.linear, sense.angular), Twist(faster, 2 * faster / self._track_width)
            old = old.predict(twist, time, unseen) if time < AWAY else fix
            new = new.predict(twist, time, unseen) if new is not None and time < AWAY else None
            old, new = self._judge(old, new, fix, sense.tick)
        self._belief, self._doubt, self._tick = old, new, sense.tick
        return _estimate_of(old, new)

    def _judge(self, old: Belief, new: Belief | None, fix: Belief, tick: int) -> tuple[Belief, Belief | None]:
        """Return the belief after a fix, and the one that it is doubted for.

        A fix that only one of the two can hold with ends the doubt if it is the old one. Else the doubt lasts for SURE;
        then the new one is right, unless a single fix spoke against the old one. After a jump some fixes may agree with
        both, and leave an old belief that is wrong and has no room left: it agrees with every second fix.
        """
        agreed, again = old.correct(fix), None if new is None else new.correct(fix)
        if again is None and agreed is not None:
            return agreed, None
        if again is None:
            self._jumped_at, self._against = tick, 1
            return old, fix
        self._against += agreed is None
        if (tick - self._jumped_at) * self._dt < SURE:
            return agreed or old, again
        return again if self._against > 1 else agreed or old, None


def _estimate_of(old: Belief, new: Belief | None) -> Estimate:
    """Return the estimate that covers a belief and the one that it is doubted for."""
    (x, y, radius), yaw, yaw_error = old
    if new is None:
        return Estimate(Pose(x, y, yaw), radius, yaw_error)
    both, off = smallest_cover(old.disc, new.disc), wrap(new.yaw - yaw)
    low, high = min(-yaw_error, off - new.yaw_error), max(yaw_error, off + new.yaw_error)
    jumped = hypot(new.disc.x - x, new.disc.y - y)
    return Estimate(Pose(both.x, both.y, wrap(yaw + (low + high) / 2)), both.radius, (high - low) / 2, jumped)
