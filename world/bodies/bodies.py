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
from world.bodies.roster import GRACE, Roster
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
    loads: dict[int, float]


class Bodies:
    """All bodies, robots by their numbers."""

    def __init__(
        self, scenario: Scenario, starts: Sequence[Pose], targets: Sequence[int], seed: int,
        external: Mapping[str, int], edits: int, roster: Roster,
    ) -> None:  # fmt: skip
        """Begin at ``starts`` with so many ``targets`` for each robot; ``edits`` is how many there were in all runs.

        The ``roster`` says what each robot is, also of those to come.
        """
        self._settings, self.roster = scenario.settings, roster
        self.dt = 1.0 / self._settings.rate
        self._drives = [DifferentialDrive(body.track_width) for body in roster.bodies]
        self._fastest = [body.top_speed for body in roster.bodies]  # m/s
        self.physics = Physics(scenario.map, roster.radii(), starts, self._fastest, self.dt)
        self._movers = [Patrol(mover) for mover in self._settings.movers]
        for mover, patrol in zip(self._settings.movers, self._movers, strict=True):
            self.physics.add_mover(patrol.pose_at(0.0), mover.radius, mover.size)
        self.wheels = [(0.0, 0.0)] * len(starts)  # rim speeds now [m/s]
        self.sensing = Sensing(roster, targets, seed)
        self.localisers = Localisers(self._settings.localisation, roster.names, seed, self.dt)
        self.external = External(external, starts, roster, self.dt)
        self.edits = edits
        self._recent: list[tuple[int, Edit]] = []  # tick, edit
        self.distances: list[FreeDistances] = []  # what robots sense at this tick

    def add_robot(self, start: Pose) -> None:
        """Put one more robot on the floor, without targets; it is in the roster already."""
        body = self.roster.bodies[len(self._drives)]
        self._drives.append(DifferentialDrive(body.track_width))
        self._fastest.append(body.top_speed)
        self.physics.add_robot(start, body.radius, body.top_speed)
        self.wheels.append((0.0, 0.0))
        self.sensing.add_robot()
        self.localisers.add_robot()

    @property
    def state(self) -> BodiesState:
        """The state, which shares its values with this object."""
        parts = self.sensing.state, self.localisers.state, self.external.state, self.physics.state
        return BodiesState(self.edits, self._recent, self.wheels, *parts, self.roster.loads)

    def restore(self, state: BodiesState) -> None:
        """Continue from a state on the same floor."""
        self.edits, self._recent, self.wheels, self.sensing.state = state[:4]
        self.localisers.state, self.external.state, physics, loads = state[4:]
        self._take_loads(loads, -GRACE)
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
        return self._drives[robot].twist(*self.wheels[robot])

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
        told = self.external.distances()
        cast = self.sensing.all_distances(self.physics)
        self.distances = [told.get(number, distances) for number, distances in enumerate(cast)]

    # --- what changes them ---

    def load(self, number: int, radius: float | None, tick: int) -> None:
        """Give a robot a load that makes it as wide as ``radius`` [m], or take its load away."""
        others = {robot: load for robot, load in self.roster.loads.items() if robot != number}
        self._take_loads(others if radius is None else others | {number: radius}, tick)
        self.measure()

    def _take_loads(self, loads: dict[int, float], tick: int) -> None:
        self.roster.take_loads(loads, tick)
        for number, radius in enumerate(self.roster.radii()):
            self.physics.set_radius(number, radius)

    def roll(self, tick: int, commands: Sequence[Command | None]) -> Moved:
        """Move all bodies from a tick to the next, by the commands in force; a robot without one brakes."""
        self._recent = [(when, edit) for when, edit in self._recent if tick - when <= self._settings.rate]
        wanted = [(command.left, command.right) if command else (0.0, 0.0) for command in commands]
        ramp = [
            ramp_wheels(wheels, speeds, fastest, body.wheel_acceleration * self.dt)
            for wheels, speeds, fastest, body in zip(
                self.wheels, wanted, self._fastest, self.roster.bodies, strict=True
            )
        ]
        reported = self.external.step(tick, self.floor)
        self.wheels = [reported.wheels.get(number, wheels) for number, wheels in enumerate(ramp)]
        twists, movers = (
            [drive.twist(*wheels) for drive, wheels in zip(self._drives, self.wheels, strict=True)],
            self.mover_poses(tick * self.dt + self.dt),
        )
        contacts = self.physics.roll(twists, movers, reported.poses, reported.jumped)
        physics = self.physics
        return Moved(self.poses(), self.wheels, contacts, physics.touching, physics.touched_at, reported.said)

    def floor_after(self, edit: Edit, *, sensed: bool) -> OccupancyMap:
        """Return the floor after an edit; say if the robots have ``sensed`` this tick.

        Raises:
            ConfigError: the edit is outside the map, or a robot stands there or could not stop before it.
        """
        bodies = zip(self.roster.names, self.poses(), self.wheels, self.roster.bodies, strict=True)
        return apply_edit(self.floor, edit, bodies, self.dt, int(sensed))

    def edit(self, edit: Edit, tick: int, *, sensed: bool) -> bool:
        """Add or remove walls. Return False if it changes nothing. For the errors see ``edited``."""
        floor = self.floor_after(edit, sensed=sensed)
        if np.array_equal(floor.cells, self.floor.cells):
            return False
        self.physics.set_floor(floor)
        self._recent.append((tick, edit))
        self.edits += 1
        if not sensed:
            self.measure()
        return True
