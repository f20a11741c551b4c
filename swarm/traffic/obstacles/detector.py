"""Layer 0: the unexpected obstacles, which neither the map nor any robot's last record explains.

The robot stops before one that is near. It tracks those that move, and predicts where one is while it is not seen.
"""

from collections.abc import Callable, Collection, Iterable
from math import hypot
from typing import Final, NamedTuple

from swarm.geometry import Pose, distance
from swarm.maps.occupancy import Disc, Point
from swarm.messages.traffic import Moving, Record
from swarm.traffic.interface import MovingObstacle, TrafficInputs
from swarm.traffic.lattice.cell_map import CellMap
from swarm.traffic.obstacles.scan import KnownBody, Scan, body_centre, find_unexpected, ray_end
from swarm.traffic.progress_checker import ProgressChecker, make_way_length_test
from swarm.traffic.reservations.route import BESIDE, RouteProgress
from swarm.traffic.settings import TrafficConstants

HALTED: Final = 10  # ticks stopped before an unexpected obstacle, after which it is taken to stay
STILL: Final = 0.1  # m; an obstacle that moves farther in HALTED ticks does not stay: the ticks are counted again
AT_LAST: Final = 60  # ticks after which they are not counted again: a robot that turns sees other edges of a body
CLOSE: Final = 0.15  # m, from the edge; an obstacle this near is still near when the sensors have turned away from it
LINGERS: Final = 10  # ticks for which a close obstacle is assumed to be there still
ABOUT: Final = 0.15  # m, the accuracy with which a ray locates an obstacle
MOVES: Final = 1.5  # s for which a robot that is not heard is assumed to drive on
RESTS: Final = 0.6  # s for which a robot long silent is assumed to have driven on before it came to rest

# of obstacles that move
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


def robot_at(
    others: Iterable[Record], tick: int, cells: CellMap, settings: TrafficConstants
) -> Callable[[Point], bool]:
    """Return a test: True if the body of a robot that was heard may be at a point [m] at ``tick``.

    The body is near where it was heard last, in cells that it holds. If the record is old, the cells that the robot was
    about to take count too. A robot that has been silent for long has come to rest.
    """
    known = []
    for record in others:
        age = tick - record.stamp
        drove = min(age * settings.tick, MOVES if age <= settings.surmise else RESTS)
        kept = set(record.held)
        if age > 2 * settings.every:
            kept.update(record.ahead[: settings.horizon], (claim.cell for claim in record.claims))
        within = settings.radius_of(record) + ABOUT + record.error
        within += settings.reach_after(record.speed, drove, record.top)[0]
        known.append(KnownBody((record.x, record.y), within, kept))
    return lambda place: any(body.may_be_at(place, cells) for body in known)


class ProtectiveStop(NamedTuple):
    """The result of one look."""

    stopped: bool
    found: Point | None = None  # m, where an obstacle seems to stay: reported once
    threats: tuple[MovingObstacle, ...] = ()  # obstacles that move near the robot
    bodies: tuple[Disc, ...] = ()  # discs as large as this robot, whose edges are where rays end on obstacles


class ObstacleDetector:
    """Finds the obstacles that rays show and that neither the map nor a robot's record explains."""

    def __init__(self, settings: TrafficConstants) -> None:
        self._settings = settings
        self._since: int | None = None  # tick at which it stopped
        self._still: tuple[int, Point] = (0, (0.0, 0.0))  # since when an obstacle is at one place [tick, m]
        self._lingers_until = 0
        self._found: list[tuple[int, Point]] = []  # tick until which an obstacle is remembered, and its place [m]
        self._tracker = Tracker(settings.tick, settings.radius)

    def detect(
        self, inputs: TrafficInputs, others: Collection[Record], mine: Collection[int], cells: CellMap
    ) -> ProtectiveStop:
        """Judge what the rays show. ``others`` are the newest records; no other robot is in the cells ``mine``."""
        tick, settings = inputs.tick, self._settings
        self._found = [(until, place) for until, place in self._found if until > tick]
        seen = inputs.scan.body_readings(settings, WATCH)
        robots = self._list_visible_robots(inputs, others, mine) if seen else []
        near = tuple(find_unexpected(seen, inputs.pose, cells, robots, settings))
        hits = [ray_end(inputs.pose, one, settings.radius) for one in near]  # what was found to stay may move again
        close = [one for one in near if one.measured < settings.stop_distance]
        bodies = [(*ray_end(inputs.pose, one, 2 * settings.radius), settings.radius) for one in close]
        off = ABOUT + inputs.uncertainty
        found = [KnownBody(place, off + settings.radius, nearest=CLOSE) for _, place in self._found]
        first = next(find_unexpected(close, inputs.pose, cells, found, settings), None)
        halt = self._decide_stop(inputs, None if first is None else body_centre(inputs.pose, first, settings.radius))
        told = [one for record in others for one in record.moving]
        threats = self._tracker.track_threats(tick, inputs.pose, hits, inputs.scan, told)
        return halt._replace(threats=threats, bodies=tuple(bodies))

    def _decide_stop(self, inputs: TrafficInputs, place: Point | None) -> ProtectiveStop:
        """Return whether to stop for an obstacle that seems to be near, at ``place`` [m], and where it stays."""
        tick = inputs.tick
        if place is None:
            self._since = None
            return ProtectiveStop(tick < self._lingers_until)
        if inputs.scan.nearest < CLOSE:
            self._lingers_until = tick + LINGERS
        if self._since is None:
            self._since, self._still = tick, (tick, place)
        elif distance(place, self._still[1]) > STILL and tick - self._since < AT_LAST:
            self._still = (tick, place)
        if tick - self._still[0] != HALTED:
            return ProtectiveStop(stopped=True)
        self._found.append((tick + self._settings.obstacle, place))
        return ProtectiveStop(stopped=True, found=place)

    def moving_obstacles(self) -> tuple[Moving, ...]:
        """Return the obstacles that this robot has lately seen to move."""
        return self._tracker.moving_obstacles()

    def obstacle_places(self, tick: int) -> tuple[Point, ...]:
        """Return where obstacles stay that were found lately [m]."""
        return tuple([place for until, place in self._found if until > tick])

    def _list_visible_robots(
        self, inputs: TrafficInputs, others: Iterable[Record], mine: Collection[int]
    ) -> list[KnownBody]:
        """List the robots that may be seen, near where they were last heard."""
        (x, y, _), tick, settings = inputs.pose, inputs.tick, self._settings
        farthest = WATCH + 2 * settings.radius  # m, from my middle to what I look at
        known = []
        for record in others:
            age = (tick - record.stamp) * settings.tick
            off = ABOUT + record.error + inputs.uncertainty
            radius = (
                settings.widest if record.radius is None else record.radius
            )  # inlined: for each robot near, each tick
            within = radius + off + settings.reach_after(record.speed, age, record.top)[0]
            if hypot(record.x - x, record.y - y) > farthest + within:
                continue
            silent = tick - record.stamp > settings.fresh  # it came to rest somewhere near: do not drive close to it
            known.append(
                KnownBody((record.x, record.y), within, set(record.held).difference(mine), CLOSE if silent else 0.0)
            )
        return known


class Tracker:
    """Tracks the unexpected obstacles that one robot sees, and adds those that others tell of."""

    def __init__(self, dt: float, radius: float) -> None:
        self._dt = dt  # s, a tick
        self._radius = radius  # m, the robot's
        self._tracks: list[_Track] = []

    def track_threats(
        self, tick: int, pose: Pose, hits: Collection[Point], scan: Scan, told: Iterable[Moving] = ()
    ) -> tuple[MovingObstacle, ...]:
        """Return the threats near the robot at this tick.

        ``hits`` [m] are the points where rays of the ``scan`` hit unexpected obstacles; ``told`` is what others saw.
        """
        left = list(hits)
        while left:
            nearest = min(left, key=lambda hit: distance(hit, pose))
            self._record_obstacle(tick, pose, [hit for hit in left if distance(hit, nearest) < WIDE])
            left = [hit for hit in left if distance(hit, nearest) >= WIDE]
        self._tracks = [track for track in self._tracks if self._is_track_alive(track, tick, pose, scan)]
        found: list[MovingObstacle] = []
        for one in sorted((*self.moving_obstacles(), *told), key=lambda one: -one.tick):
            now = self._predict_place(one, tick)
            old = tick - one.tick
            if old >= COMING or distance(now, pose) >= NEAR or any(distance(now, other) < WIDE for other in found):
                continue
            if not (old and scan.sees_beyond((now.x, now.y), pose, WIDE, self._radius)):
                found.append(now)
        return tuple(found)

    def moving_obstacles(self) -> tuple[Moving, ...]:
        """Return the obstacles that this robot has lately seen to move."""
        return tuple([track.moving for track in self._tracks if track.moving is not None])

    def _predict_place(self, one: Moving, tick: int) -> MovingObstacle:
        """Return where an obstacle is at this tick if it has moved straight on."""
        age = (tick - one.tick) * self._dt
        return MovingObstacle(one.x + one.vx * age, one.y + one.vy * age, one.vx, one.vy)

    def _is_track_alive(self, track: "_Track", tick: int, pose: Pose, scan: Scan) -> bool:
        """Return False if the obstacle was not seen for long, or if rays go through where it should be."""
        track.noted = [(then, place) for then, place in track.noted if then >= tick - NOTED]
        one = track.moving
        if one is not None and one.tick < tick and (not track.noted or track.noted[-1][0] < tick):
            now = self._predict_place(one, tick)
            if tick - one.tick >= COMING or scan.sees_beyond((now.x, now.y), pose, WIDE, self._radius):
                track.moving = None
        return track.moving is not None or bool(track.noted)

    def _record_obstacle(self, tick: int, pose: Pose, edge: list[Point]) -> None:
        """Record where an obstacle is whose ``edge`` [m] rays hit."""
        nearest = min(edge, key=lambda hit: distance(hit, pose))
        about = _point_behind_hit(nearest, pose)
        known = [
            (distance(place, about), number)
            for number, track in enumerate(self._tracks)
            if distance(place := self._track_place(track, tick), about) < WIDE
        ]
        if known:
            track = self._tracks[min(known)[1]]
        else:
            track = _Track()
            self._tracks.append(track)
        now = self._predict_place(track.moving, tick) if track.moving is not None else None
        place = _fit_disc(pose, edge, now)
        track.noted.append((tick, place))
        before = next(place for then, place in track.noted if then >= tick - LATELY)
        came = distance(before, pose) - distance(place, pose)
        long = track.noted[0][0] <= tick - LATELY
        if (long and abs(came) > NEARER) or (came > 0.0 and track.moving is not None):
            track.moving = Moving(*place, *track.velocity(self._dt), tick)

    def _track_place(self, track: "_Track", tick: int) -> Point:
        """Return where the obstacle of a track should be [m]."""
        if track.moving is not None:
            return self._predict_place(track.moving, tick)[:2]
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


def _fit_disc(pose: Pose, edge: Collection[Point], known: MovingObstacle | None) -> Point:
    """Fit a disc to an obstacle's edge; return its centre [m].

    One ray does not tell how far to the side the centre is: the fit begins where it is ``known`` to be.
    """
    x, y = _point_behind_hit(min(edge, key=lambda hit: distance(hit, pose)), pose)
    if known is not None and distance(known, (x, y)) < WIDE:
        x, y, _, _ = known
    for _ in range(FITS):
        middles = [_point_behind_hit(hit, (2 * hit[0] - x, 2 * hit[1] - y)) for hit in edge]
        x, y = (sum(values) / len(edge) for values in zip(*middles, strict=True))
    return x, y


def _point_behind_hit(hit: Point, origin: tuple[float, ...]) -> Point:
    """Return the point [m] half a width behind a hit, as seen from ``origin``."""
    share = HALF_WIDTH / (distance(hit, origin) or 1.0)
    return hit[0] + share * (hit[0] - origin[0]), hit[1] + share * (hit[1] - origin[1])


class BlockageChecker:
    """Detects that moving obstacles have long kept a robot from its goal, although it holds the next cell."""

    def __init__(self) -> None:
        self._goal: int | None = None  # cell
        self._progress = ProgressChecker(
            make_way_length_test()
        )  # a longer way is no new one: to flee and come back is none
        self._threatened = 0  # ticks under a threat, with a cell to drive into

    def check(self, progress: RouteProgress, body: int, goal: int, *, threatened: bool) -> int | None:
        """Return the next cell if it is time to give it up, or None; call it once a tick."""
        held = list(zip(progress.reservations.held, progress.steps, strict=True))[progress.body_index(body) + 1 :]
        ahead = [cell for cell, step in held if step != BESIDE]
        left = len(ahead) + len(progress.route)
        self._threatened += threatened and bool(ahead)
        if goal != self._goal:
            self._goal = goal
            self._progress.forget()
        if self._progress.check(left, self._threatened) < KEPT or not ahead:
            return None
        self._progress.forget()
        return ahead[0]
