"""The simple rule: of two that would meet, the one nearer the end of its mission goes first.

More stops done goes first (who leaves a target is let out before the next one goes in), then the shorter way to the
target, then the id: a total order, so that no ring of robots waits for itself. Who may go plans around those who stand.
It promises nothing in narrow places.
"""

from collections.abc import Iterable, Sequence
from typing import Final, NamedTuple

from swarm.geometry import distance
from swarm.maps.occupancy import Point
from swarm.messages import Activity, Broadcast

HORIZON: Final = 3.0  # m of path that others must know
STEP: Final = 0.25  # m between its points
STOP_BEFORE: Final = 1.2  # m: give way when the place of meeting is nearer than that along the own path
ROOM: Final = 0.3  # m, wanted between two footprints that pass
BRUSH: Final = 0.1  # m, a standing robot nearer to the path than that is in the way
STILL: Final = frozenset({Activity.READY, Activity.GIVE_WAY, Activity.BLOCKED, Activity.DONE})


class Rank(NamedTuple):
    """Who goes first: the smaller one."""

    stops_done: int  # negative
    left: float  # m, to the target along the path
    robot: str


class Verdict(NamedTuple):
    """Whom to let pass, and who stands in the way."""

    yield_to: tuple[str, ...]
    standing: tuple[Point, ...]


def decide(rank: Rank, ahead: Sequence[Point], others: Iterable[Broadcast], radius: float, waiting: bool) -> Verdict:
    """Compare the own path ahead with what others broadcast, oldest news excluded by the caller.

    ``ahead`` is the own path each STEP [m]; ``waiting`` says that the robot
    already gives way: it then wants a little more room before it goes on, so that it does not dither.
    """
    room = 2 * radius + ROOM + (0.15 if waiting else 0.0)
    near = ahead[: int(STOP_BEFORE / STEP) + 1]
    yields, standing = [], []
    for other in sorted(others, key=lambda broadcast: broadcast.robot):
        place = (other.x, other.y)
        if not ahead or distance(ahead[0], place) > STOP_BEFORE + HORIZON + room:
            continue  # no point of its way can be near one of mine
        if other.activity in STILL:
            if _near(ahead, (place,), 2 * radius + BRUSH):
                standing.append(place)
        elif Rank(-other.target, other.distance, other.robot) < rank and _near(near, (place, *other.ahead), room):
            yields.append(other.robot)
    return Verdict(tuple(yields), tuple(standing))


def _near(some: Sequence[Point], others: Sequence[Point], apart: float) -> bool:
    """Tell whether any two points are nearer than that [m]."""
    limit = apart * apart
    return any((ax - bx) ** 2 + (ay - by) ** 2 < limit for ax, ay in some for bx, by in others)
