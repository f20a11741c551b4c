"""What the proximity sectors say about cells: a body that nobody told of, or a silent robot's cell that is empty."""

from collections.abc import Collection, Iterable
from math import cos, sin
from typing import NamedTuple

from swarm.geometry import Pose
from swarm.traffic.cells import CellMap
from swarm.traffic.settings import TrafficSettings

EDGE = 0.1  # m, a hit this near a cell may be on a body in it


class Reading(NamedTuple):
    """One sector: what it measures, and what it would if there were the map's walls alone."""

    measured: float  # m, from the robot's edge
    expected: float  # m
    bearing: float  # rad, of the sector's middle, left positive
    half_width: float  # rad


def unexplained(
    readings: Iterable[Reading], pose: Pose, cells: CellMap, theirs: Collection[int], settings: TrafficSettings
) -> int | None:
    """Find a body near by that nobody told of: give the cell it seems to be in, else None.

    ``theirs`` are the cells in which bodies are known, none of them mine. A body in one of those is where it belongs;
    anything else so near, be it a robot that was never heard or a box, is a reason not to drive.
    """
    for measured, expected, bearing, half_width in readings:
        if measured >= settings.stop_distance or measured > expected - settings.unexpected:
            continue
        hits = [_hit(pose, bearing + share * half_width, measured, settings) for share in (0.0, -0.5, 0.5, -1.0, 1.0)]
        if not any(cell in theirs for hit in hits for cell in cells.touched(*hit, EDGE)):
            return cells.cell_of(*hits[0])
    return None


def sees_through(front: Reading, side: float, radius: float, sensor_range: float) -> bool | None:
    """Tell from the middle of the next cell whether the one faced is empty; None where walls do not let one see."""
    enough = min(1.5 * side - radius, sensor_range) - 0.1
    if front.measured >= enough:
        return True
    return False if front.measured < front.expected - 0.05 else None


def _hit(pose: Pose, bearing: float, measured: float, settings: TrafficSettings) -> tuple[float, float]:
    reach = settings.radius + measured + 0.5 * settings.radius
    return pose.x + reach * cos(pose.yaw + bearing), pose.y + reach * sin(pose.yaw + bearing)
