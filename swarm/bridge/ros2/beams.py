"""On which beam of a scan each ray of a robot is."""

from functools import lru_cache
from math import pi
from typing import Final

from swarm.robot.sectors import sectors
from swarm.settings import SensorSettings

TURN: Final = 720  # beams around a robot, 0.5 degrees apart: the usual rays are on beams, others within 0.25 degrees
STEP: Final = 2 * pi / TURN  # rad
FIRST: Final = -pi  # rad, where beam 0 points: backwards; left is positive


@lru_cache(maxsize=16)
def beams(sensors: SensorSettings) -> tuple[int, ...]:
    """Return the number of each ray's beam, in the order of ``Sense.rays``.

    >>> beams(SensorSettings(rays=3, side_deg=60, side_half_width_deg=20, front_half_width_deg=10))
    (440, 480, 520, 340, 360, 380, 200, 240, 280)
    """
    return tuple(round((angle - FIRST) / STEP) % TURN for sector in sectors(sensors) for angle in sector)
