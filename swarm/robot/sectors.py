"""The three proximity sectors: the angles of their rays, for the world that casts them and robots that read them."""

from math import radians
from typing import NamedTuple

from swarm.geometry import wrap
from swarm.settings import SensorSettings

Angles = tuple[float, ...]  # rad, in base_link


class Sectors(NamedTuple):
    """Body angles of the rays of each sector."""

    left: Angles
    front: Angles
    right: Angles


def sectors(settings: SensorSettings) -> Sectors:
    """Return the angles of the rays that a scenario defines."""
    side, half = radians(settings.side_deg), radians(settings.side_half_width_deg)
    return Sectors(
        ray_angles(side, half, settings.rays),
        ray_angles(0.0, radians(settings.front_half_width_deg), settings.rays),
        ray_angles(-side, half, settings.rays),
    )


def ray_angles(middle: float, half_width: float, rays: int) -> Angles:
    """Return body angles [rad] of rays spread evenly over a sector, from right to left.

    >>> [round(a, 2) for a in ray_angles(0.0, 0.5, 3)]
    [-0.5, 0.0, 0.5]
    """
    if rays == 1:
        return (middle,)
    return tuple(wrap(middle - half_width + 2 * half_width * k / (rays - 1)) for k in range(rays))
