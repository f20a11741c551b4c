"""The world: it computes what each robot senses at a tick, and moves the robots by their commands to the next tick.

Commands at tick k take effect at tick k + 1, in the order of the robots' numbers. The world uses no bus and no wall
clock.
"""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from swarm.errors import ConfigError
from swarm.geometry import Pose, distance
from swarm.maps.occupancy import Point
from swarm.messages import COMMAND, Activity, Command, Edit, Event, Sense
from swarm.motion.drive import DifferentialDrive, ramp
from swarm.robot.mission import LEAST
from swarm.scenario.load import Scenario
from swarm.scenario.starts import names
from world.edits import Planned, edited
from world.movers import Patrol
from world.physics import Contact, Physics
from world.progress import STALLED, ProgressWatch
from world.radio_model import RadioModel
from world.recorder import WAITING, Recorder
from world.sensing import Distances, Sensing
from world.steering import SteeringWatch
from world.traffic_watch import TrafficWatch
from world.verdict import Verdict

PAPER_TOP_SPEED = 4.0  # m/s, the fastest rim speed of the paper's tables
REST = Command(
    run=0, tick=0, left=0.0, right=0.0, heading=0.0, activity=Activity.READY,
    reached=[], unreachable=[], sent=False, replans=0,
)  # fmt: skip


class World:
    """One run of one scenario: bodies at their starts, the clock at 0."""

    def __init__(
        self,
        scenario: Scenario,
        starts: list[Pose],
        seed: int,
        run: int = 0,
        edits: int = 0,
        identity: str = "local",
    ) -> None:
        settings = scenario.settings
        robot = settings.robot
        self.robots = names(len(starts))
        self.starts = starts
        self.identity = identity  # the same in all runs of a fleet's world, and after it was started again
        self.run = run
        self.tick = 0
        self.due = True  # the state is to be saved
        self.dt = 1.0 / settings.rate
        self.returns, self._patrols = settings.return_home, settings.patrol
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
        self.sensing = Sensing(settings.sensors, len(starts), seed)
        self.radio = RadioModel(settings.radio, seed, self.physics.sees)
        self._stops = [scenario.stops(number, (start.x, start.y)) for number, start in enumerate(starts)]
        self._left: list[int | None] = [0 for _ in starts]  # the first stop neither reached nor given up
        self._stop_places = [np.array(stops, np.float64).reshape(-1, 2) for stops in self._stops]
        self._number = {name: number for number, name in enumerate(self.robots)}
        self.wheels = [(0.0, 0.0)] * len(starts)  # rim speeds now [m/s]
        self.commands = [REST] * len(starts)
        self._heard: list[list[tuple[str, int]]] = [[] for _ in starts]
        self.distances = [Distances(0.0, 0.0, 0.0, [])] * len(starts)
        self.traffic = TrafficWatch(scenario.map, settings, self.robots)
        self.verdict = Verdict()
        self.planned = Planned(settings.edits)
        self.progress = ProgressWatch(len(starts))
        self.steering = SteeringWatch(scenario, starts)
        self.recorder = Recorder(scenario, starts, self._stops, self.dt)
        self.recorder.poses(starts)

    @property
    def time(self) -> float:
        """Seconds since the run began."""
        return self.tick * self.dt

    @property
    def complete(self) -> bool:
        """True if every robot has been at all its stops."""
        return self.recorder.complete

    @property
    def finished(self) -> bool:
        """True if no robot has anything left to do, or if the robots have proven that their jam has no solution."""
        if not self.unfinished:
            return True
        standing = dict(zip(self.robots, self.progress.standing(self.time), strict=True))
        waiting = [
            name for name, command in zip(self.robots, self.commands, strict=True) if command.activity in WAITING
        ]
        return self.verdict.ends(self.time, standing, waiting)

    @property
    def unfinished(self) -> list[str]:
        """Robots that do not say that they are done, or have stops left."""
        everybody = zip(self.robots, self.commands, self._left, strict=True)
        return [name for name, command, stop in everybody if command.activity is not Activity.DONE or stop is not None]

    def senses(self, lockstep: bool) -> dict[str, Sense]:
        """Return what every robot senses at this tick, by name."""
        return dict(self.each_sense(lockstep))

    def each_sense(self, lockstep: bool) -> Iterator[tuple[str, Sense]]:
        """Yield what each robot senses, one after the other; the rays of all are cast at once."""
        sensing, physics = self.sensing, self.physics
        self._recent = [(tick, edit) for tick, edit in self._recent if self.tick - tick <= self.settings.rate]
        edits = [edit for _, edit in self._recent]
        self.distances = sensing.all_distances(physics)
        for number, (name, pose) in enumerate(zip(self.robots, self.poses(), strict=True)):
            twist = self._drive.twist(*self.wheels[number])
            left, front, right, rays = self.distances[number]
            sense = Sense(
                world=self.identity, run=self.run, tick=self.tick, time=self.time, lockstep=lockstep,
                x=pose.x, y=pose.y, yaw=pose.yaw,
                linear=twist.linear, angular=twist.angular, left=left, front=front, right=right,
                bearings=sensing.bearings(physics, number, pose, self._stop_places[number]), hears=self._heard[number],
                rays=rays, edits_before=self.edits - len(edits), edits=edits,
            )  # fmt: skip
            self.steering.sensed(number, sense)
            yield name, sense

    def step(self, commands: Mapping[str, Command]) -> list[Event]:
        """Run one tick and return its events; a robot without a new command keeps its last until it expires."""
        events = self._tick_off_stops()
        self.due = bool(events)
        events += self._admit(commands)
        events += self._watch_traffic(commands)
        dt, fastest, most = self.dt, self._top_speed, self.settings.robot.wheel_acceleration * self.dt
        in_force = [c if (self.tick - c.tick) * dt <= COMMAND.timeout else None for c in self.commands]
        for number, command in enumerate(in_force):
            wanted = (command.left, command.right) if command else (0.0, 0.0)
            left, right = self.wheels[number]
            self.wheels[number] = (
                ramp(left, max(-fastest, min(fastest, wanted[0])), most),
                ramp(right, max(-fastest, min(fastest, wanted[1])), most),
            )
        movers = [patrol.at(self.time + dt) for patrol in self._movers]
        contacts = self.physics.roll([self._drive.twist(*wheels) for wheels in self.wheels], movers)
        senders = [self._number[name] for name, command in sorted(commands.items()) if command.sent]
        poses = self.poses()
        heard = self.radio.hears(poses, senders)
        self._heard = [[(self.robots[sender], self.tick) for sender in row] for row in heard]
        self.tick += 1
        for contact in self.recorder.contacts(contacts, self.physics.touching, self.wheels):
            other = f" {self.robots[contact.other]}" if contact.other is not None else ""
            events.append(self.event("contact", f"touches {contact.kind}{other}", self.robots[contact.robot]))
        self.steering.look(in_force, poses)
        self.recorder.poses(poses)
        self.recorder.doing(self.commands)
        self._watch_progress(poses, events)
        self._make_edits(events)
        self.due |= self.tick % round(self.settings.rate) == 0
        if self.due:
            self.physics.settle()  # also if nobody saves: a run that was killed and one that was not are the same
        return events

    def settle(self) -> None:
        """Finish what is left to compute, so that the state can be saved."""
        self.physics.settle()
        self.recorder.judge.settle()

    def _watch_progress(self, poses: Sequence[Pose], events: list[Event]) -> None:
        """Report robots that have stops left and make no progress for long, whatever the cause."""
        for number in self.progress.look(self.time, poses, self._left):
            name, command = self.robots[number], self.commands[number]
            stop = self._label(number, self._left[number] or 0)
            waits = f", waits for {' and '.join(command.waits)}" if command.waits else ""
            events.append(self.event("stalled", f"made no progress towards {stop} for {STALLED:g} s{waits}", name))

    def _make_edits(self, events: list[Event]) -> None:
        """Make the scenario's own edits whose time has come; an edit that is refused becomes an event."""
        for edit in self.planned.due(self.time):
            try:
                changed = self.edit(edit)
            except ConfigError as fault:
                events.append(self.event("edit_refused", str(fault)))
            else:
                text = f"{edit.kind.value} from {edit.low} to {edit.high}{'' if changed else '; it changes nothing'}"
                events.append(self.event("edit", text))

    def _watch_traffic(self, commands: Mapping[str, Command]) -> list[Event]:
        events = []
        for name, command in sorted(commands.items()):
            for kind, text in command.notes:
                self.verdict.take(name, kind, text, self.time)
                events.append(self.event(kind, text, name))
        for fault in self.traffic.look(self.tick, self.poses(), commands, self.commands):
            cells = ", ".join(map(str, fault.where))
            said = f"{fault.kind} of {' and '.join(fault.robots)} in cell {cells}"
            events.append(self.event("traffic_fault", said, fault.robots[0]))
        return events

    def _tick_off_stops(self) -> list[Event]:
        """Record the stops that robots are at: by their poses, whatever they say."""
        events = []
        for number, pose in enumerate(self.poses()):
            while (stop := self._left[number]) is not None:
                if distance(pose, self._stops[number][stop]) > self.settings.reach:
                    break
                self.recorder.reached(number, stop, self.time)
                given_up = self.commands[number].unreachable
                self._left[number] = self.recorder.next_stop(number, given_up)
                self.verdict.clear()  # the jam did not stop the whole fleet
                events.append(self.event("reached", f"is at {self._label(number, stop)}", self.robots[number]))
                if self._left[number] is None and self._patrols and len(self._stops[number]) - len(given_up) >= LEAST:
                    self.recorder.begin_lap(number)
                    self._left[number] = self.recorder.next_stop(number, given_up)
                    break
        return events

    def _label(self, number: int, stop: int) -> str:
        return stop_label(stop, len(self._stops[number]), self.returns)

    def _admit(self, commands: Mapping[str, Command]) -> list[Event]:
        """Take in the commands; name what they say that is not so."""
        events = []
        for name, command in sorted(commands.items()):
            number = self._number[name]
            before, self.commands[number] = self.commands[number], command
            for stop in command.unreachable:
                if stop < len(self._stops[number]) and stop not in before.unreachable:
                    text = f"gives up {self._label(number, stop)}: no path leads there"
                    events.append(self.event("unreachable", text, name))
            if command.unreachable != before.unreachable:
                self._left[number] = self.recorder.next_stop(number, command.unreachable)
            for stop, claimed in enumerate(command.reached[: len(self._stops[number])]):
                if claimed and not self.recorder.is_reached(number, stop) and before.reached[stop : stop + 1] != [True]:
                    away = distance(self.physics.pose(number), self._stops[number][stop])
                    text = f"says it reached {self._label(number, stop)} but is {away:.2f} m away; not counted"
                    events.append(self.event("false_claim", text, name))
            if Activity.DONE is command.activity is not before.activity and (lacks := self._left[number]) is not None:
                text = f"says it is done but has not reached {self._label(number, lacks)}; not counted"
                events.append(self.event("false_claim", text, name))
        return events

    def edit(self, edit: Edit) -> bool:
        """Add or remove walls; robots sense it at this tick. Return False, and do nothing, if it changes nothing.

        Raises:
            ConfigError: the edit is outside the map, or a robot stands there or could not stop before it.
        """
        bodies = zip(self.robots, self.poses(), self.wheels, strict=True)
        floor = edited(self.floor, edit, bodies, self.settings.robot, self.dt)
        if np.array_equal(floor.cells, self.floor.cells):
            return False
        self.floor = floor
        self.physics.set_floor(floor)
        self.recorder.set_floor(floor)
        self.traffic.set_floor(floor, self.settings)
        self._recent.append((self.tick, edit))
        self.edits += 1
        return True

    def poses(self) -> list[Pose]:
        """Return the pose of every robot."""
        return self.physics.poses()

    def touching(self) -> list[Contact]:
        """Return the contacts that have begun and not ended."""
        return self.physics.touching

    def mover_poses(self) -> list[Pose]:
        """Return the pose of every moving obstacle."""
        return [patrol.at(self.time) for patrol in self._movers]

    def number(self, name: str) -> int:
        """Return a robot's number."""
        return self._number[name]

    def stops(self, name: str) -> tuple[Point, ...]:
        """Return a robot's stops [m]."""
        return self._stops[self._number[name]]

    def event(self, kind: str, text: str, robot: str | None = None) -> Event:
        """Return an event of this tick."""
        return Event(run=self.run, tick=self.tick, time=self.time, robot=robot, kind=kind, text=text)


def stop_label(stop: int, stops: int, return_home: bool) -> str:
    """Return the name of a stop for people: ``target 1``, ..., ``home``."""
    return "home" if return_home and stop == stops - 1 else f"target {stop + 1}"
