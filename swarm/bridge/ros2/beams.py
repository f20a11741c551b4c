"""A robot's rays as a scan of ROS: on which beam each ray is."""

from collections.abc import Sequence
from math import inf, pi
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm.bridge.cdr import layouts
from swarm.robot.sectors import sectors
from swarm.settings import SensorSettings, Settings

TURN: Final = 720  # beams around a robot, 0.5 degrees apart: the usual rays are on beams, others within 0.25 degrees
STEP: Final = 2 * pi / TURN  # rad
FIRST: Final = -pi  # rad, where beam 0 points: backwards; left is positive


class BeamLayout(NamedTuple):
    """The beams of a scan, from the first to the last that has a ray."""

    first: int  # the number of its first beam
    width: int  # beams
    places: NDArray[np.intp]  # of each ray in it, in the order of ``Sense.rays``


def build_beam_layout(sensors: SensorSettings) -> BeamLayout:
    """Return the beams of a scan with these sensors.

    >>> fan = build_beam_layout(SensorSettings(rays=3, side_deg=60, side_half_width_deg=20, front_half_width_deg=10))
    >>> fan.first, fan.width, fan.places.tolist()
    (200, 321, [240, 280, 320, 140, 160, 180, 0, 40, 80])
    """
    numbers = [round((angle - FIRST) / STEP) % TURN for sector in sectors(sensors) for angle in sector]
    first = min(numbers)
    return BeamLayout(first, max(numbers) - first + 1, np.array(numbers, np.intp) - first)


class Scanner:
    """Makes the scans of robots with these settings, whose ``edge`` is so far from their centre [m]."""

    def __init__(self, settings: Settings, edge: float) -> None:
        self.settings, self.edge = settings, edge
        self._fan = fan = build_beam_layout(settings.sensors)
        self._reach = settings.sensors.range
        self._shared = len({*fan.places.tolist()}) < len(fan.places)  # two rays have one beam
        self._empty: NDArray[np.float32] = np.full(fan.width, np.nan, np.float32)
        first = FIRST + fan.first * STEP
        last = first + (fan.width - 1) * STEP
        far = edge + self._reach
        self._about = layouts.BEAMS.pack(first, last, STEP, 0.0, 1 / settings.rate, edge, far)

    def write_scan(self, at: int, frame: str, rays: Sequence[float]) -> bytes:
        """Return rays [m] as a scan: ranges from the robot's centre, +inf where a ray met nothing (REP-117).

        A scan of ROS has evenly spaced beams and our rays have gaps: a beam without a ray is NaN, which REP-117 has for
        what is no measurement. Of two rays on one beam, the shorter counts.
        """
        ranges = self._empty.copy()
        met = [self.edge + free if free < self._reach else inf for free in rays[: len(self._fan.places)]]
        places = self._fan.places[: len(met)]
        if self._shared:
            np.fmin.at(ranges, places, met)
        else:
            ranges[places] = met
        return layouts.write_laser_scan(at, frame, self._about, ranges)
