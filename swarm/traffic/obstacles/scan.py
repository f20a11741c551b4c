"""What the proximity rays show: bodies, and which of them no known body explains."""

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from functools import cached_property
from math import cos, inf, pi, sin
from typing import Final, NamedTuple

from swarm.geometry import Pose, bearing, distance, wrap
from swarm.maps.occupancy import Point
from swarm.traffic.lattice.cell_map import CellMap
from swarm.traffic.settings import TrafficConstants

TO_A_SIDE: Final = pi / 6  # rad; the robot drives past what is farther to a side, not into it
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

    def body_readings(self, settings: TrafficConstants, within: float) -> list[Reading]:
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
        return self.cells is None or any(cell in self.cells for cell in cells.cells_under_disc(*place, EDGE))


def find_unexpected(
    bodies: Iterable[Reading], pose: Pose, cells: CellMap, known: Collection[KnownBody], settings: TrafficConstants
) -> Iterator[Reading]:
    """Yield those of ``bodies`` that are not where a ``known`` one can be: a box, or a robot that was never heard."""
    for reading in bodies:
        hit = body_centre(pose, reading, settings.radius)
        beside = abs(reading.bearing) > TO_A_SIDE
        if not any(body.may_be_at(hit, cells) for body in known if beside or reading.measured >= body.nearest):
            yield reading


def ray_end(pose: Pose, reading: Reading, radius: float) -> Point:
    """Return where a ray ends [m]; ``radius`` [m] is the robot's."""
    reach, heading = radius + reading.measured, pose.yaw + reading.bearing
    return pose.x + reach * cos(heading), pose.y + reach * sin(heading)


def body_centre(pose: Pose, reading: Reading, radius: float) -> Point:
    """Return where the body that a ray shows has its middle [m], if its radius is half a robot's."""
    return ray_end(pose, reading, 1.5 * radius)
