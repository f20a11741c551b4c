"""The world: it computes what each robot senses at a tick, and moves the robots by their commands to the next tick.

Commands at tick k take effect at tick k + 1, in the order of the robots' numbers. The world uses no bus and no wall
clock.
"""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from swarm.errors import ConfigError
from swarm.geometry import Pose, distance
from swarm.maps.occupancy import Point
from swarm.messages import COMMAND, Activity, Body, Command, Edit, Event, Kind, Mover, Sense, Truth
from swarm.motion.drive import DifferentialDrive, ramp
from swarm.scenario.load import Scenario
from swarm.scenario.starts import names
from world.edits import edited
from world.movers import Patrol
from world.physics import Contact, Physics
from world.progress import STALLED, ProgressWatch
from world.radio_model import RadioModel
from world.recorder import Recorder
from world.sensing import Distances, Sensing
from world.steering import SteeringWatch
from world.traffic_watch import TrafficWatch

PAPER_TOP_SPEED = 4.0  # m/s, the fastest rim speed of the paper's tables
PROVEN = 5.0  # s after the proof of an unsolvable jam, with no stop reached since, at which the run ends
VERDICTS = frozenset({"unsolvable", "no_plan_found"})
REST = Command(
    run=0, tick=0, left=0.0, right=0.0, heading=0.0, activity=Activity.READY,
    reached=[], unreachable=[], sent=False, replans=0,
)  # fmt: skip


class World:
    """One run of one scenario: bodies at their starts, the clock at 0."""

    def __init__(self, scenario: Scenario, starts: list[Pose], seed: int, run: int = 0, edits: int = 0) -> None:
        settings = scenario.settings
        robot = settings.robot
        self.robots = names(len(starts))
        self.starts = starts
        self.run = run
        self.tick = 0
        self.dt = 1.0 / settings.rate
        self.returns = settings.return_home
        self._settings = settings
        self._drive = DifferentialDrive(robot.track_width)
        self._top_speed = PAPER_TOP_SPEED * robot.speed_scale
        self.floor = scenario.map
        self._physics = Physics(scenario.map, robot.radius, starts, self._top_speed, self.dt)
        self._patrols = [Patrol(mover) for mover in settings.movers]
        for mover, patrol in zip(settings.movers, self._patrols, strict=True):
            self._physics.add_mover(patrol.at(0.0), mover.radius, mover.size)
        self.edits = edits  # how many there have been, in all runs
        self._recent: list[tuple[int, Edit]] = []  # tick, edit
        self._sensing = Sensing(settings.sensors, len(starts), seed)
        self._radio = RadioModel(settings.radio, seed, self._physics.sees)
        self._stops = [scenario.stops(number, (start.x, start.y)) for number, start in enumerate(starts)]
        self._stop_places = [np.array(stops, np.float64).reshape(-1, 2) for stops in self._stops]
        self._number = {name: number for number, name in enumerate(self.robots)}
        self._wheels = [(0.0, 0.0)] * len(starts)  # rim speeds now [m/s]
        self._commands = [REST] * len(starts)
        self._heard: list[list[tuple[str, int]]] = [[] for _ in starts]
        self._distances = [Distances(0.0, 0.0, 0.0, [])] * len(starts)
        self.traffic = TrafficWatch(scenario.map, settings, self.robots)
        self.verdict = ""  # the last verdict of the robots' planners on a jam: unsolvable, or no plan found
        self._unsolvable_at: float | None = None
        self._planned = sorted(settings.edits, key=lambda edit: edit.at)
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
        proven = self._unsolvable_at is not None and self.time - self._unsolvable_at >= PROVEN
        return proven or all(command.activity is Activity.DONE for command in self._commands)

    def senses(self, lockstep: bool) -> dict[str, Sense]:
        """Return what every robot senses at this tick, by name."""
        return dict(self.each_sense(lockstep))

    def each_sense(self, lockstep: bool) -> Iterator[tuple[str, Sense]]:
        """Yield what each robot senses, one after the other; the rays of all are cast at once."""
        sensing, physics = self._sensing, self._physics
        self._recent = [(tick, edit) for tick, edit in self._recent if self.tick - tick <= self._settings.rate]
        edits = [edit for _, edit in self._recent]
        self._distances = sensing.all_distances(physics)
        for number, (name, pose) in enumerate(zip(self.robots, self.poses(), strict=True)):
            twist = self._drive.twist(*self._wheels[number])
            left, front, right, rays = self._distances[number]
            sense = Sense(
                run=self.run, tick=self.tick, time=self.time, lockstep=lockstep, x=pose.x, y=pose.y, yaw=pose.yaw,
                linear=twist.linear, angular=twist.angular, left=left, front=front, right=right,
                bearings=sensing.bearings(physics, number, pose, self._stop_places[number]), hears=self._heard[number],
                rays=rays, edits_before=self.edits - len(edits), edits=edits,
            )  # fmt: skip
            self.steering.sensed(number, sense)
            yield name, sense

    def step(self, commands: Mapping[str, Command]) -> list[Event]:
        """Run one tick and return its events; a robot without a new command keeps its last until it expires."""
        events = self._admit(commands)
        events += self._watch_traffic(commands)
        dt, fastest, most = self.dt, self._top_speed, self._settings.robot.wheel_acceleration * self.dt
        in_force = [c if (self.tick - c.tick) * dt <= COMMAND.timeout else None for c in self._commands]
        for number, command in enumerate(in_force):
            wanted = (command.left, command.right) if command else (0.0, 0.0)
            left, right = self._wheels[number]
            self._wheels[number] = (
                ramp(left, max(-fastest, min(fastest, wanted[0])), most),
                ramp(right, max(-fastest, min(fastest, wanted[1])), most),
            )
        movers = [patrol.at(self.time + dt) for patrol in self._patrols]
        contacts = self._physics.roll([self._drive.twist(*wheels) for wheels in self._wheels], movers)
        senders = [self._number[name] for name, command in sorted(commands.items()) if command.sent]
        poses = self.poses()
        heard = self._radio.hears(poses, senders)
        self._heard = [[(self.robots[sender], self.tick) for sender in row] for row in heard]
        self.tick += 1
        for contact in self.recorder.contacts(contacts, self._physics.touching, self._wheels):
            other = f" {self.robots[contact.other]}" if contact.other is not None else ""
            events.append(self.event("contact", f"touches {contact.kind}{other}", self.robots[contact.robot]))
        self.steering.look(in_force, poses)
        self.recorder.poses(poses)
        self.recorder.doing(self._commands)
        self._watch_progress(poses, events)
        self._make_edits(events)
        return events

    def _watch_progress(self, poses: Sequence[Pose], events: list[Event]) -> None:
        """Report robots that have stops left and make no progress for long, whatever the cause."""
        left = [self._next_stop(number) for number in range(len(self.robots))]
        for number in self.progress.look(self.time, poses, left):
            name, command = self.robots[number], self._commands[number]
            stop = stop_label(left[number] or 0, len(self._stops[number]), self.returns)
            waits = f", waits for {' and '.join(command.waits)}" if command.waits else ""
            events.append(self.event("stalled", f"made no progress towards {stop} for {STALLED:g} s{waits}", name))

    def _next_stop(self, number: int) -> int | None:
        """Return the first stop that a robot has neither reached nor given up."""
        given_up, reached_at = self._commands[number].unreachable, self.recorder.reached_at[number]
        if not given_up:
            return reached_at.index(None) if None in reached_at else None
        for stop, time in enumerate(reached_at):
            if time is None and stop not in given_up:
                return stop
        return None

    def _make_edits(self, events: list[Event]) -> None:
        """Make the scenario's own edits whose time has come; an edit that is refused becomes an event."""
        while self._planned and self._planned[0].at <= self.time + 1e-9:
            planned = self._planned.pop(0)
            edit = Edit(kind=Kind(planned.kind), low=planned.low, high=planned.high)
            try:
                self.edit(edit)
            except ConfigError as fault:
                events.append(self.event("edit_refused", str(fault)))
            else:
                events.append(self.event("edit", f"{planned.kind} from {planned.low} to {planned.high}"))

    def _watch_traffic(self, commands: Mapping[str, Command]) -> list[Event]:
        events = [
            self.event(kind, text, name) for name, command in sorted(commands.items()) for kind, text in command.notes
        ]
        for command in commands.values():
            for kind, text in command.notes:
                if kind in VERDICTS:
                    self.verdict = text
                    if kind == "unsolvable" and self._unsolvable_at is None:
                        self._unsolvable_at = self.time
        for fault in self.traffic.look(self.tick, self.poses(), commands, self._commands):
            cells = ", ".join(map(str, fault.where))
            text = f"{fault.kind} of {' and '.join(fault.robots)} in cell {cells}"
            events.append(self.event("traffic_fault", text, fault.robots[0]))
        return events

    def _admit(self, commands: Mapping[str, Command]) -> list[Event]:
        events = []
        for name, command in sorted(commands.items()):
            number = self._number[name]
            before, self._commands[number] = self._commands[number], command
            for stop, claimed in enumerate(command.reached[: len(self._stops[number])]):
                if not claimed or self.recorder.is_reached(number, stop):
                    continue
                away = distance(self._physics.pose(number), self._stops[number][stop])
                label = stop_label(stop, len(self._stops[number]), self.returns)
                if away <= self._settings.reach + 2 * self._top_speed * self.dt:
                    self.recorder.reached(number, stop, self.time)
                    self.verdict, self._unsolvable_at = "", None  # the jam did not stop the whole fleet
                    events.append(self.event("reached", f"is at {label}", name))
                elif stop >= len(before.reached) or not before.reached[stop]:
                    text = f"says it reached {label} but is {away:.2f} m away; not counted"
                    events.append(self.event("false_claim", text, name))
            for stop in command.unreachable:
                if stop < len(self._stops[number]) and stop not in before.unreachable:
                    label = stop_label(stop, len(self._stops[number]), self.returns)
                    events.append(self.event("unreachable", f"gives up {label}: no path leads there", name))
        return events

    def edit(self, edit: Edit) -> None:
        """Add or remove walls; robots sense it at this tick.

        Raises:
            ConfigError: the edit is outside the map, or a robot stands there or could not stop before it.
        """
        bodies = zip(self.robots, self.poses(), self._wheels, strict=True)
        self.floor = floor = edited(self.floor, edit, bodies, self._settings.robot, self.dt)
        self._physics.set_floor(floor)
        self.recorder.set_floor(floor)
        self.traffic.set_floor(floor, self._settings)
        self._recent.append((self.tick, edit))
        self.edits += 1

    def poses(self) -> list[Pose]:
        """Return the pose of every robot."""
        return self._physics.poses()

    def touching(self) -> list[Contact]:
        """Return the contacts that have begun and not ended."""
        return self._physics.touching

    def mover_poses(self) -> list[Pose]:
        """Return the pose of every moving obstacle."""
        return [patrol.at(self.time) for patrol in self._patrols]

    def stops(self, name: str) -> tuple[Point, ...]:
        """Return a robot's stops [m]."""
        return self._stops[self._number[name]]

    def truth(self) -> Truth:
        """Return the true state of all bodies, for the dashboard and other listeners."""
        bodies = []
        for number, (name, command) in enumerate(zip(self.robots, self._commands, strict=True)):
            pose, (left, front, right, _) = self._physics.pose(number), self._distances[number]
            left_v, right_v = self._wheels[number]
            bodies.append(
                Body(
                    robot=name,
                    x=pose.x,
                    y=pose.y,
                    yaw=pose.yaw,
                    left_v=left_v,
                    right_v=right_v,
                    left=left,
                    front=front,
                    right=right,
                    heading=command.heading,
                    steering=self.steering.labels[number],
                    scale=command.scale,
                    activity=command.activity,
                    held=command.held,
                    waits=command.waits,
                    members=command.members,
                )
            )
        movers = [
            Mover(x=pose.x, y=pose.y, yaw=pose.yaw, radius=mover.radius or 0.0, size=mover.size or (0.0, 0.0))
            for mover, pose in zip(self._settings.movers, self.mover_poses(), strict=True)
        ]
        return Truth(run=self.run, tick=self.tick, time=self.time, bodies=bodies, movers=movers)

    def event(self, kind: str, text: str, robot: str | None = None) -> Event:
        """Return an event of this tick."""
        return Event(run=self.run, tick=self.tick, time=self.time, robot=robot, kind=kind, text=text)


def stop_label(stop: int, stops: int, return_home: bool) -> str:
    """Return the name of a stop for people: ``target 1``, ..., ``home``."""
    return "home" if return_home and stop == stops - 1 else f"target {stop + 1}"
