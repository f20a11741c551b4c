"""What a robot's own sensors tell it: three proximity sectors and the infrared bearing of each target (section 2)."""

from collections.abc import Sequence
from math import radians

import numpy as np

from swarm.geometry import Pose, bearing, wrap
from swarm.maps.occupancy import Point
from swarm.scenario.schema import SensorSettings
from world.physics import Physics, fan


class Sensing:
    """The sensors of all robots; the noise of each is drawn from its own generator, the same number a tick."""

    def __init__(self, settings: SensorSettings, robots: int, seed: int) -> None:
        self._settings = settings
        side, half = radians(settings.side_deg), radians(settings.side_half_width_deg)
        self._sectors = (
            fan(side, half, settings.rays),
            fan(0.0, radians(settings.front_half_width_deg), settings.rays),
            fan(-side, half, settings.rays),
        )
        self._noise = [np.random.default_rng([seed, 1, robot]) for robot in range(robots)]

    def distances(self, physics: Physics, robot: int) -> tuple[float, float, float]:
        """Read left, front, right [m]: 0..range, the nearest hit of each sector's rays, other robots included."""
        reach = self._settings.range
        left, front, right = (physics.nearest(robot, sector, reach) for sector in self._sectors)
        if self._settings.noise:
            drawn = self._noise[robot].normal(0.0, self._settings.noise, 3).tolist()
            left, front, right = (min(reach, max(0.0, d + e)) for d, e in zip((left, front, right), drawn, strict=True))
        return left, front, right

    def bearings(self, physics: Physics, robot: int, pose: Pose, targets: Sequence[Point]) -> list[float | None]:
        """Read the bearing [rad, left positive] of each target that no wall hides, None for the others."""
        noise = radians(self._settings.bearing_noise_deg)
        drawn = self._noise[robot].normal(0.0, noise, len(targets)).tolist() if noise else [0.0] * len(targets)
        here = (pose.x, pose.y)
        return [
            wrap(bearing(pose, target) + error) if physics.sees(here, target) else None
            for target, error in zip(targets, drawn, strict=True)
        ]
