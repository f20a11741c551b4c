"""A scan of ROS as the rays of the contract: from the robot's edge, in the directions of its sectors. Pure."""

from math import hypot, inf, pi
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm.bridge.body.readings import Beams
from swarm.geometry import Pose
from swarm.robot.sectors import sectors
from swarm.settings import Settings

NEAR: Final = 0.06  # rad, 3.4 degrees: how far from a ray its beam may be; at the end of a usual ray that is 0.1 m


class Rays(NamedTuple):
    """What a scan says of all rays, or why it says nothing."""

    free: list[float]  # m, from the robot's edge, in the order of ``Sense.rays``; empty if not all are known
    lacks: str = ""  # why they are not


def rays(scan: Beams, mounted: Pose, settings: Settings, *, zero_is_far: bool = False) -> Rays:
    """Return the free distances that a scan shows; ``mounted`` is the scanner's pose on the robot.

    A ray has the distance of the beam whose end is nearest to its direction, seen from the robot's centre, and at most
    ``NEAR`` from it. By REP-117 infinity means that nothing is in reach, and minus infinity that something is nearer
    than the scanner can measure; NaN and what is outside the scanner's limits are no measurements. With ``zero_is_far``
    0 means that nothing is in reach. A scanner that does not reach as far as rays do would tell its own end for an
    obstacle, so it tells nothing. Rays without a measurement cannot be told by the contract, so none is.
    """
    radius, reach = settings.robot.radius, settings.sensors.range
    if scan.farthest < (need := radius + reach + hypot(mounted.x, mounted.y)):
        return Rays([], f"reaches {scan.farthest:g} m, and sensors.range of the scenario wants {need:g} m")
    bearings, distances, measured = seen(scan, mounted, zero_is_far=zero_is_far)
    free = []
    for number, angle in enumerate(angle for sector in sectors(settings.sensors) for angle in sector):
        off = np.abs((bearings - angle + pi) % (2 * pi) - pi)
        if not (off <= NEAR).any():
            return Rays([], f"has no beam in the direction of ray {number} ({np.degrees(angle):.0f} degrees)")
        best = int(np.where(measured, off, inf).argmin())
        if not measured[best] or off[best] > NEAR:
            return Rays([], f"has measured nothing in the direction of ray {number} ({np.degrees(angle):.0f} degrees)")
        free.append(min(reach, max(0.0, float(distances[best]) - radius)))
    return Rays(free)


def seen(
    scan: Beams, mounted: Pose, *, zero_is_far: bool
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]:
    """Return where beams end as seen from the robot's centre, bearings [rad] and distances [m], and which measured."""
    ranges = scan.ranges.astype(np.float64)
    if zero_is_far:
        ranges[ranges == 0.0] = inf
    measured = np.isinf(ranges) | ((scan.nearest <= ranges) & (ranges <= scan.farthest))
    along = np.where(measured, np.clip(ranges, 0.0, scan.farthest), scan.farthest)
    angles = mounted.yaw + scan.first + scan.step * np.arange(len(ranges))
    x, y = mounted.x + along * np.cos(angles), mounted.y + along * np.sin(angles)
    # a beam that ends at the centre, for something is at the scanner there, still points somewhere
    return np.where(along > 0.0, np.arctan2(y, x), angles), np.hypot(x, y), measured
