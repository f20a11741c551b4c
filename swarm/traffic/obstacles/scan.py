"""What the proximity rays show of cells: an unexpected obstacle, or that the cell of a silent robot is empty."""

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from enum import Enum
from functools import cached_property
from math import cos, inf, pi, sin, sqrt
from typing import Final, NamedTuple

from swarm.geometry import Pose, bearing, distance, wrap
from swarm.maps.occupancy import Point
from swarm.traffic.lattice.cell_map import CellMap
from swarm.traffic.settings import TrafficConstants

SHORT: Final = 0.05  # m; readings that differ by less count as equal
TO_A_SIDE: Final = pi / 6  # rad; the robot drives past what is farther to a side, not into it
HIT: Final = 0.8  # of a body's radius; a ray that passes its middle nearer hits it for sure
EDGE: Final = 0.1  # m; a hit this near a cell may be on a body in it


class Reading(NamedTuple):
    """One ray: what it measures, and what it would measure if there were only the map's walls."""

    measured: float  # m, from the robot's edge
    expected: float  # m
    bearing: float  # rad, left positive

    def is_body(self, settings: TrafficConstants) -> bool:
        """Return True if it shows something that is not on the map."""
        return self.measured <= self.expected - settings.unexpected


class Scan:
    """The rays of one tick. The distances that the map predicts are computed only for rays that are asked for."""

    def __init__(
        self,
        bearings: Sequence[float] = (),
        measured: Sequence[float] = (),
        expected: Callable[[Sequence[float]], Sequence[float]] = tuple,
    ) -> None:
        self._bearings = bearings
        self._measured = measured
        self._expected = expected
        self.nearest = min(measured, default=inf)  # m

    @cached_property
    def readings(self) -> tuple[Reading, ...]:
        """All rays."""
        return tuple(map(Reading, self._measured, self._expected(self._bearings), self._bearings))

    def sees_beyond(self, place: Point, pose: Pose, within: float, radius: float) -> bool:
        """Return True if rays pass a place [m] on both sides, ``within`` [m] of it, and none of them ends before it."""
        away, direction = distance(pose, place), bearing(pose, place)
        sides = set()
        for measured, angle in zip(self._measured, self._bearings, strict=True):
            off = wrap(direction - angle)
            if abs(off) < pi / 2 and away * abs(sin(off)) < within:
                if radius + measured < away * cos(off):
                    return False
                sides.add(off > 0)
        return len(sides) > 1

    def bodies(self, settings: TrafficConstants, within: float) -> list[Reading]:
        """Return the rays that show something nearer than ``within`` [m] that is not on the map."""
        if self.nearest >= within:
            return []
        near = [(read, angle) for read, angle in zip(self._measured, self._bearings, strict=True) if read < within]
        measured, bearings = zip(*near, strict=True)
        readings = map(Reading, measured, self._expected(bearings), bearings)
        return [reading for reading in readings if reading.is_body(settings)]


class KnownBody(NamedTuple):
    """A body that was reported, or found before: somewhere around a point."""

    at: Point  # m, its centre
    within: float  # m, how far from there it may be seen
    cells: Collection[int] | None = None  # it is only in these cells; None: anywhere
    nearest: float = 0.0  # m, from my edge; what is nearer than this, and ahead, is another body

    def may_be_at(self, place: Point, cells: CellMap) -> bool:
        """Return True if what a ray shows at a point [m] can be this body."""
        if distance(self.at, place) > self.within:
            return False
        return self.cells is None or any(cell in self.cells for cell in cells.touched(*place, EDGE))


def strange(
    bodies: Iterable[Reading], pose: Pose, cells: CellMap, known: Collection[KnownBody], settings: TrafficConstants
) -> Iterator[Reading]:
    """Yield those of ``bodies`` that are not where a ``known`` one can be: a box, or a robot that was never heard."""
    for reading in bodies:
        hit = body_at(pose, reading, settings.radius)
        beside = abs(reading.bearing) > TO_A_SIDE
        if not any(body.may_be_at(hit, cells) for body in known if beside or reading.measured >= body.nearest):
            yield reading


class View(Enum):
    """What a robot sees of the next cell."""

    EMPTY = "empty"
    OCCUPIED = "occupied"
    HIDDEN = "hidden"  # something stands before it


def view(readings: Iterable[Reading], pose: Pose, cell: int, cells: CellMap, radius: float) -> View:
    """Judge a cell by the rays that cross it. ``radius`` [m] is the robot's: rays begin at its edge."""
    through = hidden = 0
    for reading in readings:
        enters, leaves = _crossing(pose, reading.bearing, cells.centre(cell), cells.side)
        wall = radius + reading.expected
        if leaves <= enters or wall <= enters:
            continue  # the ray misses the cell, or a wall of the map is in front of the cell
        hit = radius + reading.measured
        if hit >= min(leaves, wall) - SHORT:
            through += 1
        elif hit >= enters - EDGE:
            return View.OCCUPIED
        else:
            hidden += 1
    return View.EMPTY if through > hidden else View.HIDDEN


def has_gone(body: Point, pose: Pose, readings: Iterable[Reading], radius: float) -> bool:
    """Return True if a ray points at where a body was [m, its centre], and sees beyond its near edge."""
    away, direction = distance(pose, body), bearing(pose, body)
    for reading in readings:
        off = wrap(direction - reading.bearing)
        beside = away * abs(sin(off))
        if abs(off) > pi / 2 or beside > HIT * radius:
            continue
        near_edge = away * cos(off) - sqrt(radius**2 - beside**2) - radius
        if reading.measured > near_edge + 2 * SHORT:
            return True
    return False


def is_out_of_range(body: Point, pose: Pose, settings: TrafficConstants) -> bool:
    """Return True if a body [m, its centre] is so far away that no ray shows whether it has gone."""
    near_edge = distance(pose, body) - (1 + sqrt(1 - HIT**2)) * settings.radius  # m, the farthest hit on it
    return near_edge + 2 * SHORT > settings.sensor_range


def _crossing(pose: Pose, off: float, centre: Point, side: float) -> tuple[float, float]:
    """Return how far [m] from the robot's centre a ray enters a square, and how far it leaves it."""
    enters, leaves = 0.0, inf
    heading = pose.yaw + off
    for start, middle, slope in ((pose.x, centre[0], cos(heading)), (pose.y, centre[1], sin(heading))):
        low, high = middle - side / 2 - start, middle + side / 2 - start
        if abs(slope) < 1e-9:
            if not low <= 0.0 <= high:
                return inf, 0.0
            continue
        near, far = sorted((low / slope, high / slope))
        enters, leaves = max(enters, near), min(leaves, far)
    return enters, leaves


def hit_by(pose: Pose, reading: Reading, radius: float) -> Point:
    """Return where a ray ends [m]; ``radius`` [m] is the robot's."""
    reach, heading = radius + reading.measured, pose.yaw + reading.bearing
    return pose.x + reach * cos(heading), pose.y + reach * sin(heading)


def body_at(pose: Pose, reading: Reading, radius: float) -> Point:
    """Return where the body that a ray shows has its middle [m], if its radius is half a robot's."""
    return hit_by(pose, reading, 1.5 * radius)
