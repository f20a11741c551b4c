"""The bodies of one run: what rolls, what it touches, what robots sense, and the floor under them."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from swarm.geometry import Pose, Twist
from swarm.maps.occupancy import OccupancyMap, Point
from swarm.messages import Command, Edit
from swarm.motion.drive import DifferentialDrive, ramp_wheels
from swarm.scenario.load import Scenario
from world.bodies.edits import apply_edit
from world.bodies.event_line import EventLine
from world.bodies.external import External, ExternalState
from world.bodies.localisers import Localisers, LocaliserState, ToldPose
from world.bodies.movers import Patrol
from world.bodies.physics import Numbers, Physics
from world.bodies.sensors import FreeDistances, Sensing, SensingState
from world.bodies.shapes import Contact, PhysicsState

Wheels = tuple[float, float]  # rim speeds left, right [m/s]


class Moved(NamedTuple):
    """What became of all robots in a tick."""

    poses: list[Pose]
    wheels: list[Wheels]
    contacts: list[Contact]  # that began in it
    touching: list[Contact]  # that have not ended
    where: Mapping[Contact, Point]  # m, of those that began
    said: list[EventLine]


class BodiesState(NamedTuple):
    """The state of `Bodies`."""

    edits: int
    recent: list[tuple[int, Edit]]
    wheels: list[Wheels]
    sensing: SensingState
    localisers: LocaliserState
    external: ExternalState
    physics: PhysicsState


class Bodies:
    """All bodies, robots by their numbers."""

    def __init__(
        self, scenario: Scenario, starts: Sequence[Pose], targets: Sequence[int], seed: int,
        external: Mapping[str, int], edits: int, names: Sequence[str],
    ) -> None:  # fmt: skip
        """Begin at ``starts`` with so many ``targets`` for each robot; ``edits`` is how many there were in all runs.

        ``names`` are those of the robots, also of those to come.
        """
        self._settings, robot = scenario.settings, scenario.settings.robot
        self.dt = 1.0 / self._settings.rate
        self._drive = DifferentialDrive(robot.track_width)
        self._top_speed = robot.top_speed
        self.physics = Physics(scenario.map, robot.radius, starts, self._top_speed, self.dt)
        self._movers = [Patrol(mover) for mover in self._settings.movers]
        for mover, patrol in zip(self._settings.movers, self._movers, strict=True):
            self.physics.add_mover(patrol.pose_at(0.0), mover.radius, mover.size)
        self.wheels = [(0.0, 0.0)] * len(starts)  # rim speeds now [m/s]
        self.sensing = Sensing(self._settings.sensors, targets, seed)
        self.localisers = Localisers(self._settings.localisation, names, seed, self.dt)
        self.external = External(external, starts, self._top_speed, self.dt)
        self.edits = edits
        self._recent: list[tuple[int, Edit]] = []  # tick, edit
        self.distances: list[FreeDistances] = []  # what robots sense at this tick

    def add_robot(self, start: Pose) -> None:
        """Put one more robot on the floor, without targets."""
        self.physics.add_robot(start)
        self.wheels.append((0.0, 0.0))
        self.sensing.add_robot()
        self.localisers.add_robot()

    @property
    def state(self) -> BodiesState:
        """The state, which shares its values with this object."""
        parts = self.sensing.state, self.localisers.state, self.external.state, self.physics.state
        return BodiesState(self.edits, self._recent, self.wheels, *parts)

    def restore(self, state: BodiesState) -> None:
        """Continue from a state on the same floor."""
        self.edits, self._recent, self.wheels, self.sensing.state = state[:4]
        self.localisers.state, self.external.state, physics = state[4:]
        self.physics.restore(physics)
        self.measure()

    @property
    def floor(self) -> OccupancyMap:
        """The floor as it is."""
        return self.physics.floor

    def poses(self) -> list[Pose]:
        """Return the pose of every robot."""
        return self.physics.poses()

    def mover_poses(self, time: float) -> list[Pose]:
        """Return the pose of every moving obstacle at a time [s]."""
        return [patrol.pose_at(time) for patrol in self._movers]

    # --- what robots sense ---

    def twist(self, robot: int) -> Twist:
        """Return the twist of a robot by its wheels."""
        return self._drive.twist(*self.wheels[robot])

    def bearings(self, robot: int, targets: Numbers) -> list[float | None]:
        """Return the bearings [rad] of a robot's targets, (n, 2) [m]; None for those that it does not see."""
        return self.sensing.bearings(self.physics, robot, self.physics.pose(robot), targets)

    def told_pose(self, robot: int, pose: Pose) -> ToldPose:
        """Return what a robot is told of its true ``pose``, and how good that is said to be."""
        return self.localisers.told_pose(robot, pose, self.external.state.reports.get(robot))

    def watch_poses(self) -> list[EventLine]:
        """Return a line for each robot whose pose begins to be worse than it is told."""
        return self.localisers.watch(self.poses(), self.external.state.reports)

    def recent(self, tick: int) -> list[Edit]:
        """Return the edits that robots are told of at a tick."""
        return [edit for when, edit in self._recent if tick - when <= self._settings.rate]

    @property
    def recent_edits(self) -> list[Edit]:
        """The edits that robots may not have heard of."""
        return [edit for _, edit in self._recent]

    def sense(self, targets: Sequence[int], tick: int) -> None:
        """Draw the noise of a new tick, for so many targets of each robot, and measure all distances."""
        self.sensing.draw(targets)
        self.localisers.draw(tick)
        self.measure()

    def measure(self) -> None:
        """Measure all distances as bodies and floor are now; the rays of all robots are cast at once."""
        told = self.external.distances(self._settings.sensors.rays, self._settings.sensors.range)
        cast = self.sensing.all_distances(self.physics)
        self.distances = [told.get(number, distances) for number, distances in enumerate(cast)]

    # --- what changes them ---

    def roll(self, tick: int, commands: Sequence[Command | None]) -> Moved:
        """Move all bodies from a tick to the next, by the commands in force; a robot without one brakes."""
        self._recent = [(when, edit) for when, edit in self._recent if tick - when <= self._settings.rate]
        fastest, most = self._top_speed, self._settings.robot.wheel_acceleration * self.dt
        wanted = [(command.left, command.right) if command else (0.0, 0.0) for command in commands]
        ramp = [ramp_wheels(wheels, speeds, fastest, most) for wheels, speeds in zip(self.wheels, wanted, strict=True)]
        reported = self.external.step(tick, self.floor)
        self.wheels = [reported.wheels.get(number, wheels) for number, wheels in enumerate(ramp)]
        twists, movers = (
            [self._drive.twist(*wheels) for wheels in self.wheels],
            self.mover_poses(tick * self.dt + self.dt),
        )
        contacts = self.physics.roll(twists, movers, reported.poses, reported.jumped)
        physics = self.physics
        return Moved(self.poses(), self.wheels, contacts, physics.touching, physics.touched_at, reported.said)

    def floor_after(self, edit: Edit, names: Sequence[str], *, sensed: bool) -> OccupancyMap:
        """Return the floor after an edit; ``names`` are those of the robots, and say if they have ``sensed`` this tick.

        Raises:
            ConfigError: the edit is outside the map, or a robot stands there or could not stop before it.
        """
        bodies = zip(names, self.poses(), self.wheels, strict=True)
        return apply_edit(self.floor, edit, bodies, self._settings.robot, self.dt, int(sensed))

    def edit(self, edit: Edit, names: Sequence[str], tick: int, *, sensed: bool) -> bool:
        """Add or remove walls. Return False if it changes nothing. For the errors see ``edited``."""
        floor = self.floor_after(edit, names, sensed=sensed)
        if np.array_equal(floor.cells, self.floor.cells):
            return False
        self.physics.set_floor(floor)
        self._recent.append((tick, edit))
        self.edits += 1
        if not sensed:
            self.measure()
        return True
