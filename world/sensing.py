"""What a robot's own sensors tell it: three proximity sectors and the infrared bearing of each target (section 2)."""

from math import radians
from typing import NamedTuple

import numpy as np

from swarm.geometry import Pose, bearing, wrap
from swarm.robot.sectors import sectors
from swarm.scenario.schema import SensorSettings
from world.physics import Numbers, Physics


class Distances(NamedTuple):
    """Free distances [m] from the robot's edge, 0..range."""

    left: float
    front: float
    right: float
    rays: list[float]  # of left, front, right in turn


class Sensing:
    """The sensors of all robots; the noise of each is drawn from its own generator, the same number a tick."""

    def __init__(self, settings: SensorSettings, robots: int, seed: int) -> None:
        self._settings = settings
        self._angles = np.array([angle for sector in sectors(settings) for angle in sector])
        self._noise = [np.random.default_rng([seed, 1, robot]) for robot in range(robots)]

    def distances(self, physics: Physics) -> list[Distances]:
        """Read, for every robot, the nearest hit of each sector's rays, other robots included, and the rays too."""
        settings, n = self._settings, self._settings.rays
        read = []
        for robot, rays in enumerate(physics.cast_all(self._angles, settings.range)):
            if settings.noise:
                drawn = self._noise[robot].normal(0.0, settings.noise, len(rays)).tolist()
                rays = [min(settings.range, max(0.0, ray + error)) for ray, error in zip(rays, drawn, strict=True)]
            read.append(Distances(min(rays[:n]), min(rays[n : 2 * n]), min(rays[2 * n :]), rays))
        return read

    def bearings(self, physics: Physics, robot: int, pose: Pose, targets: Numbers) -> list[float | None]:
        """Read the bearing [rad, left positive] of each target (n, 2) that no wall hides, None for the others."""
        noise = radians(self._settings.bearing_noise_deg)
        drawn = self._noise[robot].normal(0.0, noise, len(targets)).tolist() if noise else [0.0] * len(targets)
        seen = physics.sees_each((pose.x, pose.y), targets)
        return [
            wrap(bearing(pose, target) + error) if shows else None
            for target, error, shows in zip(targets.tolist(), drawn, seen, strict=True)
        ]
