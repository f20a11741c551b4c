"""What the proximity sectors say about cells: a body that nobody told of, or a silent robot's cell that is empty."""

from collections.abc import Collection, Iterable
from enum import Enum
from math import cos, sin
from typing import NamedTuple

from swarm.geometry import Pose, bearing, distance, wrap
from swarm.maps.occupancy import Point
from swarm.traffic.cells import CellMap
from swarm.traffic.settings import TrafficSettings

SHORT = 0.05  # m, readings differ by less
EDGE = 0.1  # m, a hit this near a cell may be on a body in it


class Reading(NamedTuple):
    """One sector: what it measures, and what it would if there were the map's walls alone."""

    measured: float  # m, from the robot's edge
    expected: float  # m
    bearing: float  # rad, of the sector's middle, left positive
    half_width: float  # rad

    def is_body(self, settings: TrafficSettings) -> bool:
        """Tell whether it shows something near that is not on the map."""
        return self.measured < settings.stop_distance and self.measured <= self.expected - settings.unexpected


class Known(NamedTuple):
    """A body that was told of, or found before: somewhere about a point."""

    at: Point  # m, its centre
    within: float  # m, how far off that it may be seen
    cells: Collection[int] | None = None  # and only in these; None: anywhere
    nearest: float = 0.0  # m, from my edge: nearer than that it is none of what is known


def unexplained(
    bodies: Iterable[Reading], pose: Pose, cells: CellMap, known: Collection[Known], settings: TrafficSettings
) -> Point | None:
    """Find, among ``bodies`` that the sectors show, one that nobody told of: give where it seems to be [m], else None.

    Anything so near that is not where a ``known`` body can be, be it a robot that was never heard or a box, is a reason
    not to drive.
    """
    for measured, _, middle, half_width in bodies:
        hits = [_hit(pose, middle + share * half_width, measured, settings) for share in (0.0, -0.5, 0.5, -1.0, 1.0)]
        if not any(_is(body, hit, cells) for body in known if measured >= body.nearest for hit in hits):
            return hits[0]
    return None


def _is(body: Known, hit: Point, cells: CellMap) -> bool:
    if distance(body.at, hit) > body.within:
        return False
    return body.cells is None or any(cell in body.cells for cell in cells.touched(*hit, EDGE))


class View(Enum):
    """What a robot sees of the next cell."""

    EMPTY = "empty"
    OCCUPIED = "occupied"
    HIDDEN = "hidden"  # walls are nearer than the cell's far edge: what is behind them does not show


def view(front: Reading, far_edge: float, radius: float) -> View:
    """Judge the cell ahead by the front sector, ``far_edge`` [m] being how far off the cell ends."""
    if front.measured >= far_edge - radius - SHORT:
        return View.EMPTY
    return View.OCCUPIED if front.measured < front.expected - SHORT else View.HIDDEN


def has_gone(body: Point, pose: Pose, readings: Iterable[Reading], radius: float) -> bool:
    """Return True if a sector looks at where a body [m, its centre] was, and sees beyond it."""
    near_edge = distance(pose, body) - 2 * radius
    return any(
        abs(wrap(bearing(pose, body) - reading.bearing)) <= reading.half_width
        and reading.measured > near_edge + 2 * SHORT
        for reading in readings
    )


def _hit(pose: Pose, off: float, measured: float, settings: TrafficSettings) -> tuple[float, float]:
    reach = settings.radius + measured + 0.5 * settings.radius
    return pose.x + reach * cos(pose.yaw + off), pose.y + reach * sin(pose.yaw + off)
