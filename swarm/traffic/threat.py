"""Layer 0: detects an obstacle that moves towards the robot, and predicts where it is while it is not seen."""

from collections import deque
from collections.abc import Collection
from typing import Final, NamedTuple

from swarm.geometry import Pose, distance
from swarm.maps.occupancy import Point
from swarm.traffic.route_progress import BESIDE, RouteProgress

WATCH: Final = 1.4  # m, from the edge; an obstacle seen nearer may be a threat
HALF_WIDTH: Final = 0.25  # m; a threat is taken for a disc of this radius
WIDE: Final = 0.5  # m; hits nearer to each other than this are on one obstacle
FITS: Final = 8  # steps of fitting the disc to the hits
NOTED: Final = 12  # ticks over which its velocity is measured
LATELY: Final = 6  # ticks over which its approach is measured
NEARER: Final = 0.06  # m; an obstacle that came nearer by more in LATELY ticks, by its own motion, is a threat: 0.2 m/s
COMING: Final = 40  # ticks for which a threat is assumed to come on unseen: a robot that turns away does not see it
OTHER: Final = 2  # cells; a way that is longer than the shortest so far by more than this is another way
KEPT: Final = 400  # ticks of threat without progress, after which a robot takes its next cell for occupied


class Threat(NamedTuple):
    """An obstacle that moves by itself, at one moment."""

    x: float  # m, its centre
    y: float
    vx: float  # m/s
    vy: float


class Threats:
    """Tracks the nearest unexpected obstacle, for one robot."""

    def __init__(self, dt: float) -> None:
        self._dt = dt  # s, a tick
        self._noted: deque[tuple[int, Point]] = deque()  # when and where the obstacle was seen
        self._last: tuple[int, Threat] | None = None  # when the threat was last seen, and its state then

    def look(self, tick: int, pose: Pose, hits: Collection[Point]) -> Threat | None:
        """Return the threat at this tick. ``hits`` [m] are the points where rays hit unexpected obstacles."""
        while self._noted and self._noted[0][0] < tick - NOTED:
            self._noted.popleft()
        known = self._now(tick)
        if hits:
            place = self._middle(pose, hits, known)
            if known is None or distance(place, known) < WIDE or distance(place, pose) < distance(known, pose):
                known = self._note(tick, pose, place) or known
        return known

    def _note(self, tick: int, pose: Pose, place: Point) -> Threat | None:
        """Record where the obstacle is; return the threat if it moves by itself."""
        if self._noted and distance(place, self._noted[-1][1]) > WIDE:
            self._noted.clear()  # this is another obstacle
        self._noted.append((tick, place))
        before = next(place for then, place in self._noted if then >= tick - LATELY)
        came = distance(before, pose) - distance(place, pose)
        if abs(came) <= NEARER and (came <= 0.0 or self._now(tick) is None):
            return None
        self._last = tick, Threat(*place, *self._velocity())
        return self._last[1]

    def _now(self, tick: int) -> Threat | None:
        """Return the threat as it moves on unseen, for COMING ticks."""
        if self._last is None or tick - self._last[0] >= COMING:
            return None
        (x, y, vx, vy), age = self._last[1], (tick - self._last[0]) * self._dt
        return Threat(x + vx * age, y + vy * age, vx, vy)

    def _middle(self, pose: Pose, hits: Collection[Point], known: Threat | None) -> Point:
        """Fit a disc to the hits on the nearest obstacle; return its centre [m]. Each hit is on its edge.

        One ray does not tell how far to the side the centre is: the fit begins where it is ``known`` to be.
        """
        nearest = min(hits, key=lambda hit: distance(hit, pose))
        edge = [hit for hit in hits if distance(hit, nearest) < WIDE]
        x, y = _beyond(nearest, pose)
        if known is not None and distance(known, (x, y)) < WIDE:
            x, y, _, _ = known
        for _ in range(FITS):
            middles = [_beyond(hit, (2 * hit[0] - x, 2 * hit[1] - y)) for hit in edge]
            x, y = (sum(values) / len(edge) for values in zip(*middles, strict=True))
        return x, y

    def _velocity(self) -> Point:
        """Return the slope of the least-squares line through the places [m/s]."""
        ticks, places = zip(*self._noted, strict=True)
        middle = sum(ticks) / len(ticks)
        spread = sum((tick - middle) ** 2 for tick in ticks) * self._dt or 1.0
        vx, vy = (
            sum((tick - middle) * place[axis] for tick, place in zip(ticks, places, strict=True)) / spread
            for axis in (0, 1)
        )
        return vx, vy


class Kept:
    """Detects that a threat has long kept the robot from its next cell, though the robot holds that cell."""

    def __init__(self) -> None:
        self._fewest = 0  # cells left of its way, the fewest so far
        self._ticks = 0  # ticks of threat since then

    def look(self, progress: RouteProgress, body: int, *, threatened: bool) -> int | None:
        """Return that cell, or None; call it once a tick."""
        held = list(zip(progress.reservations.held, progress.steps, strict=True))[progress.place(body) + 1 :]
        ahead = [cell for cell, step in held if step != BESIDE]
        left = len(ahead) + len(progress.route)
        if not ahead or left < self._fewest or left > self._fewest + OTHER:
            self._fewest, self._ticks = left, 0
        self._ticks += threatened
        if not ahead or self._ticks < KEPT:
            return None
        self._ticks = 0
        return ahead[0]


def _beyond(hit: Point, origin: tuple[float, ...]) -> Point:
    """Return the point [m] half a width behind a hit, as seen from ``origin``."""
    share = HALF_WIDTH / (distance(hit, origin) or 1.0)
    return hit[0] + share * (hit[0] - origin[0]), hit[1] + share * (hit[1] - origin[1])
