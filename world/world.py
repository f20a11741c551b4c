"""The world: it computes what each robot senses at a tick, and moves the robots by their commands to the next tick.

Commands at tick k take effect at tick k + 1, in the order of the robots' numbers. The world uses no bus and no wall
clock. It has three parts: `Bodies` are where they are, `Tasks` say who is to drive where, `Measures` judge both.
"""

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import NamedTuple

import numpy as np

from swarm.errors import ConfigError, PeerError
from swarm.geometry import Pose
from swarm.maps.occupancy import Point
from swarm.messages import Accepted, Command, Edit, Event, Order, Places, PoolTargets, RobotAction, RobotDo, Sense
from swarm.messages.short_ids import long_id, shorten_ids
from swarm.scenario.load import Scenario
from swarm.scenario.starts import later_name, robot_names
from world.bodies.bodies import Bodies, BodiesState
from world.bodies.event_line import EventLine
from world.bodies.radio_model import RadioModel
from world.bodies.roster import Roster
from world.measure.measures import Measures
from world.measure.progress import STALLED
from world.measure.state import MeasuresState
from world.tasks.loads import change_load
from world.tasks.places import Book
from world.tasks.reachable import Reachable
from world.tasks.schedule import as_edit, as_request
from world.tasks.standstill import classify_silence, why
from world.tasks.tasks import Tasks, TasksState


class WorldState(NamedTuple):
    """The state of a world between two ticks."""

    tick: int
    heard: list[list[tuple[str, int]]]
    chance: np.random.Generator
    bodies: BodiesState
    tasks: TasksState
    measures: MeasuresState


class World:
    """One run of one scenario: bodies at their starts, the clock at 0."""

    def __init__(
        self, scenario: Scenario, starts: list[Pose], seed: int, run: int = 0, edits: int = 0, identity: str = "local",
        external: Sequence[str] = (), places: Book | None = None,
    ) -> None:  # fmt: skip
        """Begin with the scenario's robots at ``starts``, and with those for whom ``places`` were opened."""
        self.settings = scenario.settings
        self.robots = list(robot_names(len(starts)))
        self.starts = list(starts)  # of all robots
        self.identity = identity  # the same in all runs of a fleet's world, and after it was started again
        self.run = run
        self.tick = 0
        self.due = True  # the state is to be saved
        self.dt = 1.0 / self.settings.rate
        self._first = len(starts)  # robots of the scenario
        self._number = {name: number for number, name in enumerate(self.robots)}
        places = places or Book(starts=[], kinds=[], requests={})
        stops = [scenario.stops(number, (start.x, start.y)) for number, start in enumerate(starts)]
        numbers = {name: self._number[name] for name in external}
        self.roster = Roster(scenario, self.robots)
        self.bodies = Bodies(scenario, starts, [len(row) for row in stops], seed, numbers, edits, self.roster)
        self.measures = Measures(scenario, starts, self.roster)
        self.tasks = Tasks(scenario, starts, stops, self.roster, self.measures.recorder, places)
        self.radio = RadioModel(self.settings.radio, seed, self.bodies.physics.sees)
        self._heard: list[list[tuple[str, int]]] = [[] for _ in starts]  # robot and tick of what each hears
        for start, kind in zip(places.starts, places.kinds, strict=True):
            self.add_robot(start, kind)
        self.measures.recorder.poses(self.starts.copy())
        self.bodies.measure()

    @property
    def time(self) -> float:
        """Seconds since the run began."""
        return self.tick * self.dt

    def poses(self) -> list[Pose]:
        """Return the pose of every robot."""
        return self.bodies.poses()

    def mover_poses(self) -> list[Pose]:
        """Return the pose of every moving obstacle."""
        return self.bodies.mover_poses(self.time)

    def number(self, name: str) -> int:
        """Return a robot's number."""
        return self._number[name]

    def is_at_next_stop(self, name: str) -> bool:
        """Return True if a robot is at its next stop, which counts at the end of this tick."""
        number = self._number.get(name)
        return number is not None and self.tasks.missions.is_at_next_stop(number, self.poses()[number])

    def event(self, kind: str, text: str, robot: str | None = None, at: Point | None = None) -> Event:
        """Return an event of this tick. Of a long id its text has 8 digits, and ``request`` all; ``at`` is in m."""
        return Event(
            run=self.run, tick=self.tick, time=self.time, robot=robot, kind=kind, text=shorten_ids(text), at=at,
            request=long_id(text),
        )  # fmt: skip

    # --- the end of a run ---

    @property
    def plans_matter(self) -> bool:
        """True if a request or errand waits, or an edit that may open a way to a stop given up does, or was lately."""
        return self.tasks.plans_matter(self.bodies.recent_edits, self.poses(), self.bodies.floor, self.tick)

    @property
    def is_finished(self) -> bool:
        """True if no robot has anything left to do, or if the robots have proven that their jam has no solution."""
        tasks, unfinished = self.tasks, self.tasks.unfinished_robots
        if not unfinished or tasks.missions.any_stopped or tasks.planned_orders.plans_left:
            return not unfinished and not self.plans_matter
        return self.measures.is_jammed(self.time, tasks.commands)

    @property
    def stands_for_good(self) -> bool:
        """True if nobody that speaks gets on with what is left: a jam without a solution, or all have stalled."""
        tasks, standing = self.tasks, enumerate(self.measures.progress.standing(self.time))
        left = [time for number, time in standing if isfinite(time) and not classify_silence(tasks, number, self.tick)]
        if not left or tasks.missions.any_stopped:
            return False
        return min(left) >= STALLED or self.measures.is_jammed(self.time, tasks.commands)

    def rests(self, members: Sequence[str]) -> bool:
        """Return True if nothing would happen until somebody asks for something; ``members`` are there."""
        awaited = self.tasks.waits_for(members) or self.tasks.planned_edits.plans_left or self.plans_matter
        return not awaited and not any(map(any, self.bodies.wheels))

    # --- one tick ---

    def senses(self, lockstep: bool) -> dict[str, Sense]:
        """Return what every robot senses at this tick, by name; asked again, it is the same."""
        bodies, missions, found = self.bodies, self.tasks.missions, {}
        edits = bodies.recent(self.tick)
        for number, (name, true_pose) in enumerate(zip(self.robots, self.poses(), strict=True)):
            twist, (pose, pose_error, yaw_error) = bodies.twist(number), bodies.told_pose(number, true_pose)
            left, front, right, rays = bodies.distances[number]
            found[name] = Sense(
                world=self.identity, run=self.run, tick=self.tick, time=self.time, lockstep=lockstep,
                x=pose.x, y=pose.y, yaw=pose.yaw,
                linear=twist.linear, angular=twist.angular, left=left, front=front, right=right,
                bearings=bodies.bearings(number, missions.places(number)),
                hears=self._heard[number], rays=rays, edits_before=bodies.edits - len(edits), edits=edits,
                assigned=missions.to_tell(number, self.tasks.commands[number]), stopped=missions.is_stopped(number),
                pose_error=pose_error, yaw_error=yaw_error,
                counted=missions.counted_stops(number) if pose_error or yaw_error else None,
                radius=self.roster.loads.get(number),
            )  # fmt: skip
        return found

    def step(self, commands: Mapping[str, Command], sent: Sequence[tuple[str, int]] = ()) -> list[Event]:
        """Run one tick by the commands that came and the broadcasts (robot, tick) sent with them; return its events."""
        bodies, tasks, measures = self.bodies, self.tasks, self.measures
        poses = self.poses()
        measures.steering.note_distances(self.tick, bodies.distances)
        arrived = tasks.arrivals(poses, self.time)
        if arrived:
            measures.verdict.clear()  # the jam did not stop the whole fleet
        said = arrived + tasks.admit({self._number[name]: commands[name] for name in sorted(commands)}, poses)
        said += measures.check(self.tick, self.time, poses, commands, tasks.commands)
        in_force = tasks.in_force(self.tick)
        moved = bodies.roll(self.tick, in_force)
        events = self._events(said + moved.said)
        heard = self.radio.hears(moved.poses, [(self._number[name], tick) for name, tick in sent])
        self._heard = [[(self.robots[sender], tick) for sender, tick in row] for row in heard]
        self.tick += 1
        said = measures.record(moved, in_force, tasks.commands)
        stalled = measures.record_stalls(self.time, moved, tasks.missions.under_way)
        said += [self._stall(number, moved.poses) for number in stalled]
        handed = tasks.hand_out(moved.poses, bodies.floor, measures.progress.standing(self.time), self.tick)
        if handed:
            measures.verdict.clear()
        self.due = bool(arrived or handed) or self.tick % round(self.settings.rate) == 0
        events += [*self._events(said + handed), *self._carry_out()]  # first what was reached, then planned orders
        if self.due:
            bodies.physics.settle()  # also if nobody saves: a run that was killed and one that was not are the same
        bodies.sense(tasks.targets, self.tick)
        events += self._events(bodies.watch_poses())
        return events

    def _events(self, said: Sequence[EventLine]) -> list[Event]:
        return [self.event(*one) for one in said]

    def _stall(self, number: int, poses: Sequence[Pose]) -> EventLine:
        """Return a line on a robot that has stops left and makes no progress for long."""
        missions, reason = self.tasks.missions, why(self.tasks, number, poses, self.tick)
        stop = missions.label(number, missions.left[number] or 0)
        text = f"made no progress towards {stop} for {STALLED:g} s{f': {reason}' if reason else ''}"
        return EventLine("stalled", text, self.robots[number])

    def _carry_out(self) -> list[Event]:
        """Carry out the planned edits and requests whose time has come; one that is refused becomes an event."""
        events = []
        for planned in self.tasks.planned_edits.due(self.time):
            try:
                changed = self.edit(edit := as_edit(planned))
            except ConfigError as fault:
                events.append(self.event("edit_refused", str(fault)))
            else:
                text = f"{edit.kind.value} from {edit.low} to {edit.high}{'' if changed else '; it changes nothing'}"
                events.append(self.event("edit", text))
        for asked in self.tasks.planned_orders.due(self.time):
            try:
                events += self._request(asked.robot, as_request(asked))[1]
            except PeerError as fault:
                events.append(self.event("request_refused", str(fault)))
        return events

    # --- between two ticks ---

    def save(self) -> WorldState:
        """Bring the bodies to rest in physics' memory; return the state, which shares its values with the world."""
        self.bodies.physics.settle()
        parts = self.bodies.state, self.tasks.state, self.measures.state
        return WorldState(self.tick, self._heard, self.radio.chance, *parts)

    def restore(self, state: WorldState) -> None:
        """Continue from a state; this is a new world of the same scenario, floor, starts, places and seed.

        Raises:
            ConfigError: the state is of another number of robots, or has other external bodies.
        """
        if len(state.heard) != len(self.robots):
            raise ConfigError(f"snapshot: expected {len(self.robots)} robots, got {len(state.heard)}")
        parts = state.bodies.external, self.bodies.external.state
        was, given = ([self.robots[number] for number in sorted(part.poses)] for part in parts)
        if was != given:
            raise ConfigError(
                f"snapshot: --body: expected {was}, as in the run that was saved, got {given}; give the same"
            )
        self.tick, self._heard, self.radio.chance = state.tick, state.heard, state.chance
        self.bodies.restore(state.bodies)
        self.tasks.restore(state.tasks)
        self.measures.restore(state.measures)

    def put_in(self, targets: PoolTargets) -> tuple[Accepted, list[Event]]:
        """Put targets into the pool; for the result and errors see ``request``."""
        outcome = self.tasks.dispatcher.add(targets, self.poses(), self._reachable, self.time)
        if outcome.changed:
            self.measures.recorder.request(len(self.robots), targets)
            self.due = True
        return Accepted(text=outcome.text), [self.event(kind, text) for kind, text in outcome.events]

    def request(self, name: str, request: Order | RobotAction) -> tuple[Accepted, list[Event]]:
        """Carry out a request to a robot; return the answer, and the events if it changes anything.

        Raises:
            PeerError: there is no such robot, or the request is refused; nothing has changed.
        """
        answered = self._request(name, request)
        number = self._number[name]
        self.bodies.sensing.draw_bearings(number, self.tasks.targets[number])
        return answered

    def _request(self, name: str, request: Order | RobotAction) -> tuple[Accepted, list[Event]]:
        if name not in self._number:
            raise PeerError(f"expected one of {', '.join(self.robots)}, got {name!r}; the fleet has no such robot")
        number = self._number[name]
        if isinstance(request, RobotAction) and request.do is RobotDo.LOAD:
            return self._load(number, request)
        outcome = self.tasks.request(number, request, self.poses()[number], self._reachable)
        if outcome.changed:
            self.measures.begin(number, self.time)
            self.due = True
        answer = Accepted(text=outcome.text, number=outcome.number, run=None if outcome.number is None else self.run)
        return answer, [self.event(kind, text, name) for kind, text in outcome.events]

    def _load(self, number: int, request: RobotAction) -> tuple[Accepted, list[Event]]:
        """Give a robot a load, or take it away; for the result and errors see ``request``."""
        name, bodies, held = self.robots[number], self.bodies, [command.held for command in self.tasks.commands]
        change = change_load(number, request.radius, self.roster, bodies.floor, self.poses(), bodies.wheels, held)
        if change.changed:
            bodies.load(number, change.radius, self.tick)
            self.measures.take_load(number, request, self.time)
            self.due = True
        events = [self.event("load", change.text, name)] if change.changed else []
        return Accepted(text=f"{name} {change.text}"), events

    @property
    def _reachable(self) -> Reachable:
        return Reachable(self.roster, self.bodies.floor)

    def open_places(self, request: Places) -> tuple[Accepted, list[Event]]:
        """Open places for more robots and put bodies there; for the result and errors see ``request``."""
        book, events = self.tasks.places, list[Event]()
        if (opened := book.known_request(request)) is None:
            free = self.tasks.spots(self.starts, self.bodies, self._kind_to_add(request), self.time)
            starts = free.starts(request, len(self.robots))
            opened = book.enter(request, starts, [self.add_robot(start, request.kind) for start in starts])
            self.measures.recorder.request(len(self.robots), request)
            self.bodies.measure()
            self.due = True
            text = "has a place at ({:.2f}, {:.2f}) m; it waits for a process to take it"
            placed = zip(opened.robots, starts, strict=True)
            events = [self.event("place", text.format(*start), name) for name, start in placed]
        return Accepted(text=opened.text, robots=opened.robots), events

    def _kind_to_add(self, request: Places) -> str:
        """Return the kind of robots that places are asked for.

        Raises:
            PeerError: the fleet has kinds, and the request names none of them; or it has none.
        """
        kinds = self.settings.kinds
        if (request.kind and request.kind not in kinds) or (kinds and not request.kind):
            known = ", ".join(kinds) or "none, the fleet has one kind of robots"
            raise PeerError(f"places {request.id}: kind: expected {known}, got {request.kind or 'none'}; correct it")
        return request.kind

    def add_robot(self, start: Pose, kind: str) -> str:
        """Put one more robot of a kind on the floor, without stops; return its name."""
        name = later_name(len(self.robots), self._first)
        self._number = self._number | {name: len(self.robots)}
        self.roster.add(name, kind)
        self.starts.append(start)
        self._heard.append([])
        self.bodies.add_robot(start)
        self.measures.add_robot(start, self.time)
        self.tasks.add_robot(start)
        return name

    def edit(self, edit: Edit, *, sensed: bool = False) -> bool:
        """Add or remove walls, also if robots have ``sensed`` this tick. Return False if it changes nothing.

        Raises:
            ConfigError: the edit is outside the map, or a robot stands there or could not stop before it.
        """
        if not self.bodies.edit(edit, self.tick, sensed=sensed):
            return False
        self.measures.set_floor(self.bodies.floor)
        self.tasks.pool.offer_all_again()
        return True
