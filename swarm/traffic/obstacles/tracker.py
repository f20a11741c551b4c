"""Layer 0: detects an obstacle that moves towards the robot, and predicts where it is while it is not seen."""

from collections.abc import Collection, Iterable
from math import inf
from typing import Final, NamedTuple

from swarm.geometry import Pose, distance
from swarm.maps.occupancy import Point
from swarm.messages.traffic import Moving
from swarm.traffic.obstacles.scan import Scan
from swarm.traffic.progress_checker import ProgressChecker
from swarm.traffic.reservations.route import BESIDE, RouteProgress

WATCH: Final = 1.4  # m, from the edge; an obstacle seen nearer may be a threat
HALF_WIDTH: Final = 0.25  # m; a threat is taken for a disc of this radius
WIDE: Final = 0.5  # m; hits nearer to each other than this are on one obstacle
FITS: Final = 8  # steps of fitting the disc to the hits
NOTED: Final = 12  # ticks over which its velocity is measured
LATELY: Final = 6  # ticks over which its approach is measured
NEARER: Final = 0.06  # m; an obstacle that came nearer by more in LATELY ticks, by its own motion, is a threat: 0.2 m/s
COMING: Final = 100  # ticks for which a threat is assumed to come on unseen: a robot that turns away does not see it
NEAR: Final = 2.0  # m, from the robot's middle; obstacles farther away are no threat
KEPT: Final = 400  # ticks of threat without progress, after which a robot takes its next cell for occupied


class MovingObstacle(NamedTuple):
    """An obstacle that moves by itself, at one moment."""

    x: float  # m, its centre
    y: float
    vx: float  # m/s
    vy: float


class Tracker:
    """Tracks the unexpected obstacles that one robot sees, and adds those that others tell of."""

    def __init__(self, dt: float, radius: float) -> None:
        self._dt = dt  # s, a tick
        self._radius = radius  # m, the robot's
        self._tracks: list[_Track] = []

    def track(
        self, tick: int, pose: Pose, hits: Collection[Point], scan: Scan, told: Iterable[Moving] = ()
    ) -> tuple[MovingObstacle, ...]:
        """Return the threats near the robot at this tick.

        ``hits`` [m] are the points where rays of the ``scan`` hit unexpected obstacles; ``told`` is what others saw.
        """
        left = list(hits)
        while left:
            nearest = min(left, key=lambda hit: distance(hit, pose))
            self._see(tick, pose, [hit for hit in left if distance(hit, nearest) < WIDE])
            left = [hit for hit in left if distance(hit, nearest) >= WIDE]
        self._tracks = [track for track in self._tracks if self._lasts(track, tick, pose, scan)]
        found: list[MovingObstacle] = []
        for one in sorted((*self.seen(), *told), key=lambda one: -one.tick):
            now = self._at(one, tick)
            old = tick - one.tick
            if old >= COMING or distance(now, pose) >= NEAR or any(distance(now, other) < WIDE for other in found):
                continue
            if not (old and scan.sees_beyond((now.x, now.y), pose, WIDE, self._radius)):
                found.append(now)
        return tuple(found)

    def seen(self) -> tuple[Moving, ...]:
        """Return the obstacles that this robot has lately seen to move."""
        return tuple([track.moving for track in self._tracks if track.moving is not None])

    def _at(self, one: Moving, tick: int) -> MovingObstacle:
        """Return where an obstacle is at this tick if it has moved straight on."""
        age = (tick - one.tick) * self._dt
        return MovingObstacle(one.x + one.vx * age, one.y + one.vy * age, one.vx, one.vy)

    def _lasts(self, track: "_Track", tick: int, pose: Pose, scan: Scan) -> bool:
        """Return False if the obstacle was not seen for long, or if rays go through where it should be."""
        track.noted = [(then, place) for then, place in track.noted if then >= tick - NOTED]
        one = track.moving
        if one is not None and one.tick < tick and (not track.noted or track.noted[-1][0] < tick):
            now = self._at(one, tick)
            if tick - one.tick >= COMING or scan.sees_beyond((now.x, now.y), pose, WIDE, self._radius):
                track.moving = None
        return track.moving is not None or bool(track.noted)

    def _see(self, tick: int, pose: Pose, edge: list[Point]) -> None:
        """Record where an obstacle is whose ``edge`` [m] rays hit."""
        nearest = min(edge, key=lambda hit: distance(hit, pose))
        about = _beyond(nearest, pose)
        known = [
            (distance(place, about), number)
            for number, track in enumerate(self._tracks)
            if distance(place := self._place(track, tick), about) < WIDE
        ]
        if known:
            track = self._tracks[min(known)[1]]
        else:
            track = _Track()
            self._tracks.append(track)
        now = self._at(track.moving, tick) if track.moving is not None else None
        place = _middle(pose, edge, now)
        track.noted.append((tick, place))
        before = next(place for then, place in track.noted if then >= tick - LATELY)
        came = distance(before, pose) - distance(place, pose)
        long = track.noted[0][0] <= tick - LATELY
        if (long and abs(came) > NEARER) or (came > 0.0 and track.moving is not None):
            track.moving = Moving(*place, *track.velocity(self._dt), tick)

    def _place(self, track: "_Track", tick: int) -> Point:
        """Return where the obstacle of a track should be [m]."""
        if track.moving is not None:
            return self._at(track.moving, tick)[:2]
        return track.noted[-1][1]


class _Track:
    """One obstacle that is seen or was seen lately."""

    def __init__(self) -> None:
        self.noted: list[tuple[int, Point]] = []  # when and where it was seen
        self.moving: Moving | None = None  # what it did when it was last seen to move

    def velocity(self, dt: float) -> Point:
        """Return the slope of the least-squares line through the places [m/s]."""
        ticks, places = zip(*self.noted, strict=True)
        middle = sum(ticks) / len(ticks)
        spread = sum((tick - middle) ** 2 for tick in ticks) * dt or 1.0
        vx, vy = (
            sum((tick - middle) * place[axis] for tick, place in zip(ticks, places, strict=True)) / spread
            for axis in (0, 1)
        )
        return vx, vy


class BlockedByObstacle:
    """Detects that moving obstacles have long kept a robot from its goal, although it holds the next cell."""

    def __init__(self) -> None:
        self._goal: int | None = None  # cell
        self._progress_checker = ProgressChecker(inf)

    def check(self, progress: RouteProgress, body: int, goal: int, *, threatened: bool) -> int | None:
        """Return the next cell if it is time to give it up, or None; call it once a tick.

        Only ticks under a threat count, and a longer way is not a new one: to flee and come back is not to get on.
        """
        held = list(zip(progress.reservations.held, progress.steps, strict=True))[progress.place(body) + 1 :]
        ahead = [cell for cell, step in held if step != BESIDE]
        left = len(ahead) + len(progress.route)
        ticks = self._progress_checker.check(left, counts=threatened and bool(ahead), new=goal != self._goal)
        self._goal = goal
        if ticks < KEPT or not ahead:
            return None
        self._progress_checker = ProgressChecker(inf)
        return ahead[0]


def _middle(pose: Pose, edge: Collection[Point], known: MovingObstacle | None) -> Point:
    """Fit a disc to an obstacle's edge; return its centre [m].

    One ray does not tell how far to the side the centre is: the fit begins where it is ``known`` to be.
    """
    x, y = _beyond(min(edge, key=lambda hit: distance(hit, pose)), pose)
    if known is not None and distance(known, (x, y)) < WIDE:
        x, y, _, _ = known
    for _ in range(FITS):
        middles = [_beyond(hit, (2 * hit[0] - x, 2 * hit[1] - y)) for hit in edge]
        x, y = (sum(values) / len(edge) for values in zip(*middles, strict=True))
    return x, y


def _beyond(hit: Point, origin: tuple[float, ...]) -> Point:
    """Return the point [m] half a width behind a hit, as seen from ``origin``."""
    share = HALF_WIDTH / (distance(hit, origin) or 1.0)
    return hit[0] + share * (hit[0] - origin[0]), hit[1] + share * (hit[1] - origin[1])
