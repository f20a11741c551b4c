"""The sensors of a robot: three proximity sectors and the infrared bearing of each target (the paper's section 2)."""

from collections.abc import Sequence
from math import radians
from typing import NamedTuple

import numpy as np

from swarm.geometry import Pose, bearing, wrap
from swarm.maps.occupancy import OccupancyMap, Point
from swarm.robot.sectors import sectors
from swarm.settings import SensorSettings
from world.bodies.physics import Numbers, Physics


class Distances(NamedTuple):
    """Free distances [m] from the robot's edge, 0..range."""

    left: float
    front: float
    right: float
    rays: list[float]  # of the left, front and right sector in turn


class Shown(NamedTuple):
    """The last bearings of a robot, with the pose, targets and floor that they belong to."""

    pose: Pose
    targets: Sequence[Point] | Numbers
    floor: OccupancyMap
    bearings: list[float | None]


class Sensing:
    """The sensors of all robots. Each robot has its own noise generator, with the same number of draws each tick."""

    def __init__(self, settings: SensorSettings, robots: int, seed: int) -> None:
        self._settings = settings
        self._angles = np.array([angle for sector in sectors(settings) for angle in sector])
        self._seed = seed
        self._noise: list[np.random.Generator] = []
        for _ in range(robots):
            self.add_robot()
        self._shown: dict[int, Shown] = {}  # a robot that stands sees the same bearings again

    def add_robot(self) -> None:
        """Give one more robot its noise generator."""
        self._noise.append(np.random.default_rng([self._seed, 1, len(self._noise)]))

    def distances(self, physics: Physics, robot: int) -> Distances:
        """Return the nearest hit of each sector's rays, other robots included, and all the rays."""
        return self._read(robot, physics.cast(robot, self._angles, self._settings.range))

    def all_distances(self, physics: Physics) -> list[Distances]:
        """Return the distances of every robot; all rays are cast at once."""
        found = physics.cast_all(self._angles, self._settings.range)
        return [self._read(robot, rays) for robot, rays in enumerate(found.tolist())]

    def _read(self, robot: int, rays: list[float]) -> Distances:
        settings, n = self._settings, self._settings.rays
        if settings.noise:
            drawn = self._noise[robot].normal(0.0, settings.noise, len(rays)).tolist()
            rays = [min(settings.range, max(0.0, ray + error)) for ray, error in zip(rays, drawn, strict=True)]
        return Distances(min(rays[:n]), min(rays[n : 2 * n]), min(rays[2 * n :]), rays)

    def bearings(
        self, physics: Physics, robot: int, pose: Pose, targets: Sequence[Point] | Numbers
    ) -> list[float | None]:
        """Return the bearing [rad, left positive] of each target that no wall hides, None for the others."""
        noise = radians(self._settings.bearing_noise_deg)
        last = self._shown.get(robot)
        if last and not noise and last.pose == pose and last.targets is targets and last.floor is physics.floor:
            return last.bearings
        places = np.asarray(targets, np.float64).reshape(-1, 2)
        drawn = self._noise[robot].normal(0.0, noise, len(targets)).tolist() if noise else [0.0] * len(targets)
        seen = physics.sees_each((pose.x, pose.y), places)
        found = [
            wrap(bearing(pose, target) + error) if shows else None
            for target, error, shows in zip(map(tuple, places.tolist()), drawn, seen, strict=True)
        ]
        self._shown[robot] = Shown(pose, targets, physics.floor, found)
        return found
