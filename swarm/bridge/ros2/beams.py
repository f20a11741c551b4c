"""On which beam of a scan each ray of a robot is."""

from functools import lru_cache
from math import pi
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm.robot.sectors import sectors
from swarm.settings import SensorSettings

TURN: Final = 720  # beams around a robot, 0.5 degrees apart: the usual rays are on beams, others within 0.25 degrees
STEP: Final = 2 * pi / TURN  # rad
FIRST: Final = -pi  # rad, where beam 0 points: backwards; left is positive


class Fan(NamedTuple):
    """The beams of a scan, from the first to the last that has a ray."""

    first: int  # the number of its first beam
    width: int  # beams
    places: NDArray[np.intp]  # of each ray in it, in the order of ``Sense.rays``


@lru_cache(maxsize=16)
def beams(sensors: SensorSettings) -> Fan:
    """Return the beams of a scan with these sensors.

    >>> fan = beams(SensorSettings(rays=3, side_deg=60, side_half_width_deg=20, front_half_width_deg=10))
    >>> fan.first, fan.width, fan.places.tolist()
    (200, 321, [240, 280, 320, 140, 160, 180, 0, 40, 80])
    """
    numbers = [round((angle - FIRST) / STEP) % TURN for sector in sectors(sensors) for angle in sector]
    first = min(numbers)
    return Fan(first, max(numbers) - first + 1, np.array(numbers, np.intp) - first)
