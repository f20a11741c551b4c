"""The world: it computes what each robot senses at a tick, and moves the robots by their commands to the next tick.

Commands at tick k take effect at tick k + 1, in the order of the robots' numbers. The world uses no bus and no wall
clock.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from swarm.errors import PeerError
from swarm.geometry import Pose
from swarm.maps.occupancy import Point
from swarm.messages import (
    COMMAND,
    Accepted,
    Activity,
    Command,
    Edit,
    Event,
    Order,
    Places,
    PoolTargets,
    RobotAction,
    Sense,
)
from swarm.motion.drive import DifferentialDrive, ramped
from swarm.scenario.load import Scenario
from swarm.scenario.starts import later_name, names
from world import ending, noticing
from world.bodies.edits import edited
from world.bodies.external import Outside
from world.bodies.movers import Patrol
from world.bodies.physics import Physics
from world.bodies.radio_model import RadioModel
from world.bodies.sensing import Distances, Sensing
from world.measure.progress import ProgressWatch
from world.measure.recorder import Recorder
from world.measure.reservation_check import TrafficWatch
from world.measure.steering import SteeringWatch
from world.measure.verdict import Verdict
from world.tasks.dispatcher import Dispatch
from world.tasks.missions import Missions
from world.tasks.places import Book, opened
from world.tasks.schedule import Planned, carry_out

PAPER_TOP_SPEED = 4.0  # m/s, the fastest rim speed of the paper's tables
REST = Command(
    run=0, tick=0, left=0.0, right=0.0, heading=0.0, activity=Activity.READY,
    reached=[], unreachable=[], sent=False, replans=0,
)  # fmt: skip


class World:
    """One run of one scenario: bodies at their starts, the clock at 0."""

    def __init__(
        self, scenario: Scenario, starts: list[Pose], seed: int, run: int = 0, edits: int = 0, identity: str = "local",
        outside: Sequence[str] = (), places: Book | None = None,
    ) -> None:  # fmt: skip
        """Begin with the scenario's robots at ``starts``, and with those for whom ``places`` were opened."""
        settings = scenario.settings
        robot = settings.robot
        self.robots = list(names(len(starts)))
        self.starts = list(starts)  # of all robots
        self.places = places or Book(starts=[], requests={})
        self.identity = identity  # the same in all runs of a fleet's world, and after it was started again
        self.run = run
        self.tick = 0
        self.due = True  # the state is to be saved
        self.dt = 1.0 / settings.rate
        self.settings = settings
        self._drive = DifferentialDrive(robot.track_width)
        self._top_speed = PAPER_TOP_SPEED * robot.speed_scale
        self.floor = scenario.map
        self.physics = Physics(scenario.map, robot.radius, starts, self._top_speed, self.dt)
        self._movers = [Patrol(mover) for mover in settings.movers]
        for mover, patrol in zip(settings.movers, self._movers, strict=True):
            self.physics.add_mover(patrol.at(0.0), mover.radius, mover.size)
        self.edits = edits  # how many there have been, in all runs
        self._recent: list[tuple[int, Edit]] = []  # tick, edit
        stops = [scenario.stops(number, (start.x, start.y)) for number, start in enumerate(starts)]
        self.sensing = Sensing(settings.sensors, [len(row) for row in stops], seed)
        self.radio = RadioModel(settings.radio, seed, self.physics.sees)
        self._first = len(starts)  # robots of the scenario
        self._number = {name: number for number, name in enumerate(self.robots)}
        self.outside = Outside({name: self._number[name] for name in outside}, starts, self._top_speed, self.dt)
        self.wheels = [(0.0, 0.0)] * len(starts)  # rim speeds now [m/s]
        self.commands = [REST] * len(starts)
        self._heard: list[list[tuple[str, int]]] = [[] for _ in starts]
        self.distances: list[Distances] = []  # what robots sense at this tick
        self.traffic = TrafficWatch(scenario.map, settings, self.robots)
        self.verdict = Verdict()
        self.planned = Planned(settings.edits)
        self.planned_orders = Planned(settings.orders)
        self.progress = ProgressWatch(len(starts))
        self.steering = SteeringWatch(scenario, starts)
        self.recorder = Recorder(scenario, starts, self.dt)
        self.missions = Missions(settings, starts, stops, self.robots, self.recorder)
        self.dispatch = Dispatch(settings, self.missions, self.robots)
        for start in self.places.starts:
            self.add_robot(start)
        self.recorder.poses(self.starts.copy())
        self.measure()

    @property
    def time(self) -> float:
        """Seconds since the run began."""
        return self.tick * self.dt

    @property
    def complete(self) -> bool:
        """True if every robot has been at all its targets, none of which was cancelled, and the pool is empty."""
        return self.missions.complete and not self.dispatch.pool.open and not self.missions.dropped

    @property
    def finished(self) -> bool:
        """True if no robot has anything left to do, or if the robots have proven that their jam has no solution."""
        return ending.finished(self)

    @property
    def unfinished(self) -> list[str]:
        """Robots that do not say that they are done, or have stops left."""
        everybody = enumerate(zip(self.robots, self.commands, strict=True))
        return [name for number, (name, command) in everybody if not self.missions.finished(number, command)]

    def untouched(self, name: str) -> bool:
        """Return True if nobody has ever taken a robot's place, and it has no stops."""
        number = self._number[name]
        return number >= self._first and self.commands[number] == REST and not self.missions.places(number).size

    @property
    def plans_matter(self) -> bool:
        """True if a request or errand waits, or an edit that may open a way to a stop given up does, or was lately."""
        return ending.plans_matter(self, [edit for _, edit in self._recent])

    def senses(self, lockstep: bool) -> dict[str, Sense]:
        """Return what every robot senses at this tick, by name; asked again, it is the same."""
        sensing, physics, found = self.sensing, self.physics, {}
        edits = [edit for tick, edit in self._recent if self.tick - tick <= self.settings.rate]
        for number, (name, pose) in enumerate(zip(self.robots, self.poses(), strict=True)):
            twist = self._drive.twist(*self.wheels[number])
            left, front, right, rays = self.distances[number]
            found[name] = Sense(
                world=self.identity, run=self.run, tick=self.tick, time=self.time, lockstep=lockstep,
                x=pose.x, y=pose.y, yaw=pose.yaw,
                linear=twist.linear, angular=twist.angular, left=left, front=front, right=right,
                bearings=sensing.bearings(physics, number, pose, self.missions.places(number)),
                hears=self._heard[number], rays=rays, edits_before=self.edits - len(edits), edits=edits,
                assigned=self.missions.to_tell(number, self.commands[number]), stopped=self.missions.stopped(number),
            )  # fmt: skip
        return found

    def measure(self) -> None:
        """Measure all distances as bodies and floor are now; the rays of all robots are cast at once."""
        told = self.outside.distances(self.settings.sensors.rays, self.settings.sensors.range)
        cast = self.sensing.all_distances(self.physics)
        self.distances = [told.get(number, distances) for number, distances in enumerate(cast)]

    def step(self, commands: Mapping[str, Command], sent: Sequence[tuple[str, int]] = ()) -> list[Event]:
        """Run one tick by the commands that came and the broadcasts (robot, tick) sent with them; return its events."""
        self.steering.sensed(self.tick, self.distances)
        self._recent = [(tick, edit) for tick, edit in self._recent if self.tick - tick <= self.settings.rate]
        events = noticing.arrivals(self)
        self.due = bool(events)
        events += self._admit(commands)
        events += noticing.traffic(self, commands)
        dt, fastest, most = self.dt, self._top_speed, self.settings.robot.wheel_acceleration * self.dt
        # a robot without a new command keeps its last one until that expires
        in_force = [c if (self.tick - c.tick) * dt <= COMMAND.timeout else None for c in self.commands]
        in_force = [None if self.missions.stopped(number) else c for number, c in enumerate(in_force)]
        wanted = [(command.left, command.right) if command else (0.0, 0.0) for command in in_force]
        pairs = zip(self.wheels, wanted, strict=True)
        self.wheels = [ramped(wheels, speeds, fastest, most) for wheels, speeds in pairs]
        movers = [patrol.at(self.time + dt) for patrol in self._movers]
        placed, jumped, said = self.outside.step(self.tick, self.floor, self.wheels)
        events += [self.event(kind, text, self.robots[number]) for number, kind, text in said]
        contacts = self.physics.roll([self._drive.twist(*wheels) for wheels in self.wheels], movers, placed, jumped)
        poses = self.poses()
        heard = self.radio.hears(poses, [(self._number[name], tick) for name, tick in sent])
        self._heard = [[(self.robots[sender], tick) for sender, tick in row] for row in heard]
        self.tick += 1
        for contact in self.recorder.contacts(contacts, self.physics.touching, self.wheels, poses):
            other = f" {self.robots[contact.other]}" if contact.other is not None else ""
            text, at = f"touches {contact.kind}{other}", self.physics.touched_at[contact]
            events.append(self.event("contact", text, self.robots[contact.robot], at))
        self.steering.look(in_force, poses)
        self.recorder.poses(poses)
        self.recorder.doing(self.commands)
        events += noticing.stalls(self, poses)
        events += [*noticing.errands(self), *carry_out(self)]  # first what was reached, then planned orders
        self.due |= self.tick % round(self.settings.rate) == 0
        if self.due:
            self.physics.settle()  # also if nobody saves: a run that was killed and one that was not are the same
        self.sensing.draw([len(self.missions.places(number)) for number in range(len(self.robots))])
        self.measure()
        return events

    def settle(self) -> None:
        """Finish what is left to compute, so that the state can be saved."""
        self.physics.settle()
        self.recorder.judge.settle()

    def _admit(self, commands: Mapping[str, Command]) -> list[Event]:
        """Take in the commands; name what they say that is not so."""
        events = []
        for name, said in sorted(commands.items()):
            number = self._number[name]
            command = self.missions.of_these_stops(number, said)
            before, self.commands[number] = self.commands[number], command
            for kind, text in self.missions.admit(number, before, command, self.physics.pose(number)):
                events.append(self.event(kind, text, name))
        return events

    def put_in(self, targets: PoolTargets) -> tuple[Accepted, list[Event]]:
        """Put targets into the pool between two ticks; for the result and errors see ``request``."""
        outcome = self.dispatch.add(targets, self.poses(), self.floor, self.traffic.watch.cells, self.time)
        self.due |= outcome.changed
        return Accepted(text=outcome.text), [self.event(kind, text) for kind, text in outcome.events]

    def request(self, name: str, request: Order | RobotAction) -> tuple[Accepted, list[Event]]:
        """Carry out a request to a robot between two ticks; return the answer, and the events if it changes anything.

        Raises:
            PeerError: there is no such robot, or the request is refused; nothing has changed.
        """
        answered = self.carry_out(name, request)
        self.sensing.draw_bearings(self._number[name], len(self.missions.places(self._number[name])))
        return answered

    def carry_out(self, name: str, request: Order | RobotAction) -> tuple[Accepted, list[Event]]:
        """Carry out a request before the noise of the next tick is drawn; for the result and errors see ``request``."""
        if name not in self._number:
            raise PeerError(f"expected one of {', '.join(self.robots)}, got {name!r}; the fleet has no such robot")
        number = self._number[name]
        here = self.physics.pose(number)[:2]
        outcome = self.missions.take(number, request, here, self.floor, self.traffic.watch.cells)
        if outcome.new_stops:
            self.commands[number] = self.missions.of_these_stops(number, self.commands[number])
        if outcome.changed:
            self.progress.begin(number, self.time)
            self.verdict.clear()
            self.due = True
        answer = Accepted(text=outcome.text, number=outcome.number)
        return answer, [self.event(kind, text, name) for kind, text in outcome.events]

    def open_places(self, request: Places) -> tuple[Accepted, list[Event]]:
        """Open places for more robots between two ticks; for the result and errors see ``request``."""
        answer, begun = opened(self, request)
        if begun:
            self.recorder.request(len(self.robots), request)
            self.measure()
            self.due = True
        return answer, [self.event("place", text, name) for name, text in begun]

    def add_robot(self, start: Pose) -> str:
        """Put one more robot on the floor, without stops; every table by numbers gets a row. Return its name."""
        name = later_name(len(self.robots), self._first)
        self._number = self._number | {name: len(self.robots)}
        self.robots.append(name)
        self.starts.append(start)
        self.sensing.add_robot()
        self.wheels.append((0.0, 0.0))
        self.commands.append(REST)
        self._heard.append([])
        self.progress.add_robot(self.time)
        for part in (self.physics, self.traffic, self.steering, self.recorder, self.missions):
            part.add_robot(start)
        return name

    def edit(self, edit: Edit, *, sensed: bool = False) -> bool:
        """Add or remove walls, also if robots have ``sensed`` this tick. Return False if it changes nothing.

        Raises:
            ConfigError: the edit is outside the map, or a robot stands there or could not stop before it.
        """
        bodies = zip(self.robots, self.poses(), self.wheels, strict=True)
        floor = edited(self.floor, edit, bodies, self.settings.robot, self.dt, int(sensed))
        if np.array_equal(floor.cells, self.floor.cells):
            return False
        self.floor = floor
        self.physics.set_floor(floor)
        self.recorder.set_floor(floor)
        self.traffic.set_floor(floor, self.settings)
        self.dispatch.pool.forgive()
        self._recent.append((self.tick, edit))
        self.edits += 1
        if not sensed:
            self.measure()
        return True

    def poses(self) -> list[Pose]:
        """Return the pose of every robot."""
        return self.physics.poses()

    def mover_poses(self) -> list[Pose]:
        """Return the pose of every moving obstacle."""
        return [patrol.at(self.time) for patrol in self._movers]

    def is_at_next_stop(self, name: str) -> bool:
        """Return True if a robot is at its next stop, which counts at the end of this tick."""
        number = self._number.get(name)
        return number is not None and self.missions.is_at_next_stop(number, self.physics.pose(number))

    def number(self, name: str) -> int:
        """Return a robot's number."""
        return self._number[name]

    def event(self, kind: str, text: str, robot: str | None = None, at: Point | None = None) -> Event:
        """Return an event of this tick; ``at`` is where it happened [m]."""
        return noticing.told(self, kind, text, robot, at)
