"""The sensors of a robot: three proximity sectors and the infrared bearing of each target (the paper's section 2)."""

from collections.abc import Sequence
from math import radians
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm.geometry import Pose, bearing, wrap
from swarm.maps.occupancy import OccupancyMap, Point
from swarm.robot.sectors import sectors
from swarm.settings import SensorSettings, Settings
from world.bodies.physics import Numbers, Physics
from world.bodies.roster import Roster


class FreeDistances(NamedTuple):
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


class Errors(NamedTuple):
    """The noise of one robot's sensors until the next draw; empty without noise."""

    rays: list[float]  # m
    bearings: list[float]  # rad


class SensingState(NamedTuple):
    """The state of `Sensing`, which changes its values."""

    noise: list[np.random.Generator]
    errors: list[Errors]


class SensorGroup(NamedTuple):
    """The rays of all robots of a kind."""

    robots: NDArray[np.int64]
    sensors: SensorSettings
    angles: Numbers  # rad, from the heading

    @classmethod
    def of(cls, settings: Settings, robots: Sequence[int]) -> "SensorGroup":
        """Return the rays of robots that have these settings."""
        sensors = settings.sensors
        angles = np.array([angle for sector in sectors(sensors) for angle in sector])
        return cls(np.array(robots, np.int64), sensors, angles)


class Sensing:
    """The sensors of all robots. Readings draw nothing: the same bodies on the same floor give the same readings.

    Each robot has its own noise generator, with the same number of draws each tick.
    """

    def __init__(self, roster: Roster, targets: Sequence[int], seed: int) -> None:
        """Begin with the robots of the roster, that have so many ``targets``, and draw their first noise."""
        self._roster = roster
        self._sensors: list[SensorSettings] = []  # of each robot
        self._rays: list[SensorGroup] = []  # of each kind
        self._grouped = 0  # robots that these are of
        self._seed = seed
        self.state = SensingState([], [])
        for count in targets:
            self.add_robot(count)
        self._shown: dict[int, Shown] = {}  # a robot that stands sees the same bearings again

    def add_robot(self, targets: int = 0) -> None:
        """Add the noise generator of one more robot, and draw its first noise."""
        robot = len(self.state.noise)
        self._sensors.append(self._roster.settings(robot).sensors)
        self.state.noise.append(np.random.default_rng([self._seed, 1, robot]))
        self.state.errors.append(self._draw_errors(robot, targets))

    def draw(self, targets: Sequence[int]) -> None:
        """Draw the noise of the next tick; ``targets`` is how many each robot has."""
        self.state.errors[:] = [self._draw_errors(robot, count) for robot, count in enumerate(targets)]

    def draw_bearings(self, robot: int, targets: int) -> None:
        """Draw what lacks for the bearings of a robot that was given other targets after the last draw."""
        errors = self.state.errors[robot].bearings
        errors += self._bearing_errors(robot, targets - len(errors))

    def _draw_errors(self, robot: int, targets: int) -> Errors:
        sensors = self._sensors[robot]
        rays = self.state.noise[robot].normal(0.0, sensors.noise, 3 * sensors.rays).tolist() if sensors.noise else []
        return Errors(rays, self._bearing_errors(robot, targets))

    def _bearing_errors(self, robot: int, count: int) -> list[float]:
        noise = radians(self._sensors[robot].bearing_noise_deg)
        drawn: list[float] = self.state.noise[robot].normal(0.0, noise, count).tolist() if noise and count > 0 else []
        return drawn

    def all_distances(self, physics: Physics) -> list[FreeDistances]:
        """Return the distances of every robot; all rays of a kind are cast at once."""
        if len(self._roster) != self._grouped:
            self._grouped, self._rays = len(self._roster), [SensorGroup.of(*group) for group in self._roster.groups()]
        read: dict[int, FreeDistances] = {}
        for robots, sensors, angles in self._rays:
            found = physics.cast_all(robots, angles, sensors.range).tolist()
            read |= {robot: self._read(robot, sensors, row) for robot, row in zip(robots.tolist(), found, strict=True)}
        return [read[robot] for robot in range(len(read))]

    def _read(self, robot: int, sensors: SensorSettings, rays: list[float]) -> FreeDistances:
        n = sensors.rays
        if sensors.noise:
            errors = self.state.errors[robot].rays
            rays = [min(sensors.range, max(0.0, ray + error)) for ray, error in zip(rays, errors, strict=True)]
        return FreeDistances(min(rays[:n]), min(rays[n : 2 * n]), min(rays[2 * n :]), rays)

    def bearings(
        self, physics: Physics, robot: int, pose: Pose, targets: Sequence[Point] | Numbers
    ) -> list[float | None]:
        """Return the bearing [rad, left positive] of each target that no wall hides, None for the others."""
        noise = self._sensors[robot].bearing_noise_deg
        last = self._shown.get(robot)
        if last and not noise and last.pose == pose and last.targets is targets and last.floor is physics.floor:
            return last.bearings
        places = np.asarray(targets, np.float64).reshape(-1, 2)
        errors = self.state.errors[robot].bearings[: len(targets)] if noise else [0.0] * len(targets)
        seen = physics.sees_each((pose.x, pose.y), places)
        found = [
            wrap(bearing(pose, target) + error) if shows else None
            for target, error, shows in zip(map(tuple, places.tolist()), errors, seen, strict=True)
        ]
        self._shown[robot] = Shown(pose, targets, physics.floor, found)
        return found
