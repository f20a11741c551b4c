"""A scan of ROS as the rays of the contract: from the robot's edge, in the directions of its sectors. Pure."""

from math import hypot, inf, pi
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm.bridge.body.readings import Beams
from swarm.geometry import Pose, wrap
from swarm.robot.sectors import sectors
from swarm.settings import Settings

NEAR: Final = 0.06  # rad, 3.4 degrees: how far from a ray its beam may be; at the end of a usual ray that is 0.1 m


class Rays(NamedTuple):
    """What a scan says of all rays, or why it says nothing."""

    free: list[float]  # m, from the robot's edge, in the order of ``Sense.rays``; empty if not all are known
    lacks: str = ""  # why they are not


def compute_rays(scan: Beams, mounted: Pose, settings: Settings, *, zero_is_far: bool = False) -> Rays:
    """Return the free distances that a scan shows; ``mounted`` is the scanner's pose on the robot.

    A ray has the distance of the beam whose end is nearest to its direction, seen from the robot's centre, and at most
    ``NEAR`` from it. A scanner that is not at the centre sees past the edge of a near thing to a far one, in the same
    direction from the centre, or with none of its beams ending near the ray. So the nearer of two neighbouring beams
    that end on either side of the ray counts too.

    By REP-117 infinity means that nothing is in reach, and minus infinity that something is nearer than the scanner can
    measure; NaN and what is outside the scanner's limits are no measurements. With ``zero_is_far`` 0 means that nothing
    is in reach. A scanner that does not reach as far as rays do would tell its own end for an obstacle, so it tells
    nothing. Rays without a measurement cannot be told by the contract, so none is.
    """
    radius, reach = settings.robot.radius, settings.sensors.range
    if scan.farthest < (need := radius + reach + hypot(mounted.x, mounted.y)):
        return Rays([], f"reaches {scan.farthest:g} m, and sensors.range of the scenario wants {need:g} m")
    bearings, distances, measured = beam_ends(scan, mounted, zero_is_far=zero_is_far)
    free = []
    for number, angle in enumerate(angle for sector in sectors(settings.sensors) for angle in sector):
        off = (bearings - angle + pi) % (2 * pi) - pi
        near = np.abs(off) <= NEAR
        pairs = _neighbours_across(off, scan.step)
        if not near.any() and not len(pairs):
            return Rays([], f"has no beam in the direction of ray {number} ({np.degrees(angle):.0f} degrees)")
        pairs = pairs[measured[pairs].all(axis=1)]
        if (near & measured).any():
            best = np.where(near & measured, np.abs(off), inf).argmin()
            least = min([distances[best], *distances[pairs[(pairs != best).all(axis=1)]].min(axis=1)])
        elif not near.any() and len(pairs):
            least = distances[pairs].min()
        else:
            return Rays([], f"has measured nothing in the direction of ray {number} ({np.degrees(angle):.0f} degrees)")
        free.append(min(reach, max(0.0, float(least) - radius)))
    return Rays(free)


def _neighbours_across(off: NDArray[np.float64], step: float) -> NDArray[np.intp]:
    """Return the pairs of beams (n, 2) that end on either side of a ray and are next to each other at the scanner.

    ``off`` (n,) are the bearings of their ends from the ray, ``step`` is the angle between two beams [rad]. Beams that
    are more than twice ``NEAR`` apart at the scanner leave a gap in which anything may be.
    """
    if abs(step) > 2 * NEAR:
        return np.empty((0, 2), np.intp)
    ahead = np.abs(off) < pi / 2
    across = ahead & np.roll(ahead, -1) & (np.sign(off) != np.sign(np.roll(off, -1)))
    if abs(wrap(len(off) * step)) > NEAR:
        across[-1] = False  # the last beam and the first are no neighbours
    first = np.flatnonzero(across)
    return np.stack((first, (first + 1) % len(off)), axis=1)


def beam_ends(
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
