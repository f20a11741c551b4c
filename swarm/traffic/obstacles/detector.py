"""Layer 0: stops before an unexpected obstacle, which neither the map nor any robot's last record explains."""

from collections.abc import Callable, Collection, Iterable
from math import hypot
from typing import Final, NamedTuple

from swarm.geometry import distance
from swarm.maps.occupancy import Point
from swarm.messages.traffic import Moving, Record
from swarm.traffic.interface import TrafficInputs
from swarm.traffic.lattice.cell_map import CellMap
from swarm.traffic.obstacles.scan import KnownBody, Reading, hit_by, strange, unexplained
from swarm.traffic.obstacles.tracker import WATCH, MovingObstacle, Tracker
from swarm.traffic.settings import TrafficConstants

HALTED: Final = 10  # ticks stopped before an unexpected obstacle, after which it is taken to stay
STILL: Final = 0.1  # m; an obstacle that moves farther in HALTED ticks does not stay: the ticks are counted again
AT_LAST: Final = 60  # ticks after which they are not counted again: a robot that turns sees other edges of a body
CLOSE: Final = 0.15  # m, from the edge; an obstacle this near is still near when the sensors have turned away from it
LINGERS: Final = 10  # ticks for which a close obstacle is assumed to be there still
ABOUT: Final = 0.15  # m, the accuracy with which a ray locates an obstacle
MOVES: Final = 1.5  # s for which a robot that is not heard is assumed to drive on
RESTS: Final = 0.6  # s for which a robot long silent is assumed to have driven on before it came to rest


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
        within = settings.radius + ABOUT + settings.driven(record.speed, drove)[0]
        known.append(KnownBody((record.x, record.y), within, kept))
    return lambda place: any(body.may_be_at(place, cells) for body in known)


class ProtectiveStop(NamedTuple):
    """The result of one look."""

    stopped: bool
    found: Point | None = None  # m, where an obstacle seems to stay: reported once
    threats: tuple[MovingObstacle, ...] = ()  # obstacles that move near the robot
    bodies: tuple[
        Point, ...
    ] = ()  # m, centres of discs as large as a robot, whose edges are where rays end on obstacles


class ObstacleDetector:
    """The obstacle detector of one robot."""

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
        seen = inputs.scan.bodies(settings, WATCH)
        robots = self._robots(inputs, others, mine) if seen else []
        near = tuple(strange(seen, inputs.pose, cells, robots, settings))
        hits = [hit_by(inputs.pose, one, settings.radius) for one in near]  # what was found to stay may move again
        bodies = [
            hit_by(inputs.pose, one, 2 * settings.radius) for one in near if one.measured < settings.stop_distance
        ]
        known = [*[KnownBody(place, ABOUT + settings.radius, nearest=CLOSE) for _, place in self._found], *robots]
        halt = self._stop(inputs, [one for one in seen if one.measured < settings.stop_distance], known, cells)
        told = [one for record in others for one in record.moving]
        threats = self._tracker.track(tick, inputs.pose, hits, inputs.scan, told)
        return halt._replace(threats=threats, bodies=tuple(bodies))

    def _stop(
        self, inputs: TrafficInputs, seen: Iterable[Reading], known: Collection[KnownBody], cells: CellMap
    ) -> ProtectiveStop:
        """Return whether to stop for what is near, and where it stays."""
        tick, settings = inputs.tick, self._settings
        place = unexplained(seen, inputs.pose, cells, known, settings)
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
        self._found.append((tick + settings.obstacle, place))
        return ProtectiveStop(stopped=True, found=place)

    def moving(self) -> tuple[Moving, ...]:
        """Return the obstacles that this robot has lately seen to move."""
        return self._tracker.seen()

    def places(self, tick: int) -> tuple[Point, ...]:
        """Return where obstacles stay that were found lately [m]."""
        return tuple([place for until, place in self._found if until > tick])

    def _robots(self, inputs: TrafficInputs, others: Iterable[Record], mine: Collection[int]) -> list[KnownBody]:
        """List the robots that may be seen, near where they were last heard."""
        (x, y, _), tick, settings = inputs.pose, inputs.tick, self._settings
        farthest = WATCH + 2 * settings.radius  # m, from my middle to what I look at
        known = []
        for record in others:
            age = (tick - record.stamp) * settings.tick
            within = settings.radius + ABOUT + settings.driven(record.speed, age)[0]
            if hypot(record.x - x, record.y - y) > farthest + within:
                continue
            silent = tick - record.stamp > settings.fresh  # it came to rest somewhere near: do not drive close to it
            known.append(
                KnownBody((record.x, record.y), within, set(record.held).difference(mine), CLOSE if silent else 0.0)
            )
        return known
