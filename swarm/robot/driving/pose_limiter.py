"""The limits of a robot that knows its pose only nearly: it drives slower, and not at all where its cell is too small.

A robot's body has to stay inside its cells wherever in its error it is. Half a cell less the body is the room for that.
"""

from math import inf
from typing import Final, NamedTuple

from swarm.robot.pose_estimate import Estimate
from swarm.robot.tuning import POSE


class PoseLimit(NamedTuple):
    """What the error of a pose allows at one tick."""

    fastest: float  # m/s, forward
    stands: bool  # it must not drive
    notes: tuple[tuple[str, str], ...] = ()  # kind and text of what others should know


NO_LIMIT: Final = PoseLimit(inf, stands=False)


class PoseLimiter:
    """The limits of one robot with so much ``room`` [m] around its body in a cell, and this ``top_speed`` [m/s]."""

    def __init__(self, room: float, top_speed: float) -> None:
        self._room, self._top_speed = room, top_speed
        self._lost = self._jumped = False

    def check(self, estimate: Estimate) -> PoseLimit:
        """Return what an estimate allows; call it once a tick."""
        if not estimate.error and not self._lost and not self._jumped:
            return NO_LIMIT
        notes = list[tuple[str, str]]()
        share = estimate.error / self._room
        if (jumped := estimate.jumped > 0.0) and not self._jumped:
            text = f"stands: its pose jumped {estimate.jumped:.2f} m, and it is not known yet which one is right"
            notes.append(("pose_jumped", text))
        lost = not jumped and share > (POSE.goes_on if self._lost else POSE.stands)
        if lost and not self._lost:
            notes.append(("pose_lost", f"stands: its pose is known to {estimate.error:.2f} m only"))
        if (self._jumped or self._lost) and not (jumped or lost):
            notes.append(("pose_found", f"goes on: its pose is known to {estimate.error:.2f} m"))
        self._jumped, self._lost = jumped, lost
        slower = min(1.0, max(0.0, (POSE.stands - share) / (POSE.stands - POSE.slows)))
        return PoseLimit(self._top_speed * slower if slower < 1.0 else inf, jumped or lost, tuple(notes))
