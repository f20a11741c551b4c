"""Which contacts a robot could have avoided by stopping. The exit status and the laws of storms count these alone.

A robot that stands cannot stop, and neither can one that a moving obstacle runs into or pushes.
"""

from collections.abc import Sequence
from math import atan2, cos, hypot, sin
from typing import Final

from swarm.geometry import Pose
from swarm.settings import MoverSettings
from world.bodies.movers import Patrol
from world.bodies.roster import Roster
from world.bodies.shapes import Contact
from world.measure.state import RecorderState

MOVES: Final = 0.01  # m/s, forward or backward; a robot that is not faster counts as standing
SPAN: Final = 2  # ticks over which the motions of a robot and a moving obstacle are compared
EXACT: Final = 1e-6  # m


class Blame:
    """The verdict on contacts: it needs where the robots were, and which of them are being pushed."""

    def __init__(self, movers: Sequence[MoverSettings], roster: Roster, counts: RecorderState, dt: float) -> None:
        self._movers = [(mover, Patrol(mover)) for mover in movers]
        self._roster = roster
        self._dt = dt
        self.state = counts
        counts.before = [counts.last] * SPAN

    def look(
        self,
        tick: int,
        begun: Sequence[Contact],
        touching: Sequence[Contact],
        wheels: Sequence[tuple[float, float]],
        poses: Sequence[Pose],
    ) -> list[bool]:
        """Return for each contact that began by a tick, whether its robot could have avoided it by stopping.

        ``touching`` are the contacts that have not ended, ``wheels`` the rim speeds [m/s], and ``poses`` those at the
        tick. It is to be called at every tick.
        """
        touched = {contact.robot for contact in touching}
        state = self.state
        state.pushed &= touched
        verdicts = [
            not (
                stands(wheels[contact.robot])
                or contact.robot in state.pushed
                or (contact.kind == "obstacle" and self._was_caught(tick, contact.robot, poses[contact.robot]))
            )
            for contact in begun
        ]
        state.pushed |= {contact.robot for contact in (*begun, *touching) if contact.kind == "obstacle"}
        state.before = [*state.before[1:], poses]
        return verdicts

    def add_robot(self, start: Pose) -> None:
        """Remember one more robot from now on."""
        self.state.before = [[*poses, start] for poses in self.state.before]

    def _was_caught(self, tick: int, robot: int, pose: Pose) -> bool:
        """Return True if a moving obstacle closed the gap to a robot at least as fast as the robot did."""
        was = self.state.before[0][robot]
        now, then = (max(0, when) * self._dt for when in (tick, tick - SPAN))
        for mover, patrol in self._movers:
            its, its_before = patrol.pose_at(now), patrol.pose_at(then)
            x, y = _nearest_core(mover, its, pose)
            apart = hypot(x - pose.x, y - pose.y)
            if apart - (mover.radius or 0.0) > 2 * self._roster.radius(robot):
                continue  # it is too far away to touch
            towards = atan2(y - pose.y, x - pose.x)
            ux, uy = cos(towards), sin(towards)
            mine = (pose.x - was.x) * ux + (pose.y - was.y) * uy
            if (its_before.x - its.x) * ux + (its_before.y - its.y) * uy >= mine - EXACT:
                return True
        return False


def stands(wheels: tuple[float, float]) -> bool:
    """Return True for rim speeds [m/s] at which a robot drives neither forward nor backward."""
    return abs(sum(wheels)) / 2 <= MOVES


def _nearest_core(mover: MoverSettings, its: Pose, pose: Pose) -> tuple[float, float]:
    """Return the centre of a disc, or the point of a box that is nearest to a pose."""
    if mover.size is None:
        return its.x, its.y
    c, s = cos(its.yaw), sin(its.yaw)
    dx, dy = pose.x - its.x, pose.y - its.y
    along, across = (
        max(-size / 2, min(size / 2, offset))
        for size, offset in zip(mover.size, (dx * c + dy * s, dy * c - dx * s), strict=True)
    )
    return its.x + along * c - across * s, its.y + along * s + across * c
