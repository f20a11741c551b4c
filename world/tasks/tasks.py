"""Who is to drive where in one run: missions, the pool, places for more robots, the schedule, and the last commands."""

from collections.abc import Mapping, Sequence
from typing import Final, NamedTuple

from swarm.geometry import Pose
from swarm.maps.occupancy import OccupancyMap, Point
from swarm.messages import COMMAND, Activity, Command, Edit, Order, RobotAction
from swarm.scenario.load import Scenario
from world.bodies.bodies import Bodies
from world.bodies.event_line import EventLine
from world.bodies.roster import Roster
from world.measure.recorder import Recorder
from world.tasks.dispatcher import Dispatcher
from world.tasks.missions import Missions, MissionsState
from world.tasks.orders import OrderChange
from world.tasks.places import Book, Occupant, Spots
from world.tasks.reachable import Reachable
from world.tasks.schedule import Planned
from world.tasks.task_pool import TaskPool

REST: Final = Command(
    run=0, tick=0, left=0.0, right=0.0, heading=0.0, activity=Activity.READY,
    reached=[], unreachable=[], sent=False, replans=0,
)  # fmt: skip


class TasksState(NamedTuple):
    """The state of `Tasks`."""

    commands: list[Command]
    missions: MissionsState
    pool: TaskPool
    passed_edits: int
    passed_orders: int


class Tasks:
    """All tasks, robots by their numbers; the ``roster`` says what they are, and others may be added to it."""

    def __init__(
        self, scenario: Scenario, starts: Sequence[Pose], stops: Sequence[Sequence[Point]], roster: Roster,
        recorder: Recorder, places: Book,
    ) -> None:  # fmt: skip
        self.settings, self.roster, self.robots, self._first = scenario.settings, roster, roster.names, len(starts)
        self.commands = [REST] * len(starts)  # the last one of each robot
        self.missions = Missions(self.settings, starts, stops, roster.names, recorder)
        self.dispatcher = Dispatcher(self.settings, self.missions, roster)
        self.places = places
        self.planned_edits, self.planned_orders = Planned(self.settings.edits), Planned(self.settings.orders)

    def add_robot(self, start: Pose) -> None:
        """Add a robot without stops."""
        self.commands.append(REST)
        self.missions.add_robot(start)

    @property
    def state(self) -> TasksState:
        """The state, which shares its values with this object."""
        passed = self.planned_edits.passed, self.planned_orders.passed
        return TasksState(self.commands, self.missions.state, self.pool, *passed)

    def restore(self, state: TasksState) -> None:
        """Continue from a state; places were given at the beginning."""
        self.commands, missions, pool, self.planned_edits.passed, self.planned_orders.passed = state
        self.missions.restore(missions)
        self.dispatcher.pool = pool

    @property
    def pool(self) -> TaskPool:
        """The pool: targets that any robot may take."""
        return self.dispatcher.pool

    # --- how far they are ---

    @property
    def complete(self) -> bool:
        """True if every robot has been at all its targets, none of which was cancelled, and the pool is empty."""
        return self.missions.complete and not self.pool.open and not self.missions.dropped_targets

    @property
    def unfinished_robots(self) -> list[str]:
        """Robots that do not say that they are done, or have stops left."""
        everybody = enumerate(zip(self.robots, self.commands, strict=True))
        return [name for number, (name, command) in everybody if not self.missions.is_finished(number, command)]

    def waits_for(self, present: Sequence[str]) -> list[str]:
        """Return the robots with stops left. Places that nobody has ever taken, and without stops, are left out."""
        here = {*present, *(name for number, name in enumerate(self.robots) if not self._is_untouched(number))}
        return [name for name in self.unfinished_robots if name in here]

    def _is_untouched(self, number: int) -> bool:
        """Return True if nobody has ever taken a robot's place, and it has no stops."""
        return number >= self._first and self.commands[number] == REST and not self.missions.stops(number)

    def plans_matter(self, recent: Sequence[Edit], poses: Sequence[Pose], floor: OccupancyMap, tick: int) -> bool:
        """Return True if a request or errand waits, or an edit that may open a way to a stop given up.

        An edit waits, or is one of the ``recent`` ones, of which robots may not have heard.
        """
        frees = "free" in [edit.kind for edit in self.planned_edits.plans_left] + [edit.kind for edit in recent]
        lacking = self.settings.retry_stops and any(command.unreachable for command in self.commands)
        now = bool(self.planned_orders.plans_left) or (frees and (lacking or bool(self.pool.waiting)))
        return now or self.dispatcher.has_waiting_errand(poses, floor, self.commands, tick)

    # --- one tick ---

    @property
    def targets(self) -> list[int]:
        """How many stops each robot has."""
        return [len(row.stops) for row in self.missions.orders.rows]

    def arrivals(self, poses: Sequence[Pose], time: float) -> list[EventLine]:
        """Count the stops that robots are at, at a time [s]: by their poses, whatever they say."""
        said = []
        for number, (pose, command) in enumerate(zip(poses, self.commands, strict=True)):
            said += self.missions.tick_off(number, pose, command.unreachable, time)
        return said

    def admit(self, commands: Mapping[int, Command], poses: Sequence[Pose]) -> list[EventLine]:
        """Take in commands, in their order; return what they say that is not so."""
        said = []
        for number, given in commands.items():
            command = self.missions.of_these_stops(number, given)
            before, self.commands[number] = self.commands[number], command
            said += self.missions.admit(number, before, command, poses[number])
        return said

    def in_force(self, tick: int) -> list[Command | None]:
        """Return the last command of each robot; None if it has expired, or the robot was told to stop."""
        lasting = [(tick - one.tick) * (1.0 / self.settings.rate) <= COMMAND.timeout for one in self.commands]
        obeyed = [lasts and not self.missions.is_stopped(number) for number, lasts in enumerate(lasting)]
        return [command if obeys else None for command, obeys in zip(self.commands, obeyed, strict=True)]

    def hand_out(
        self, poses: Sequence[Pose], floor: OccupancyMap, standing: Sequence[float], tick: int
    ) -> list[EventLine]:
        """Hand out errands of the pool, and take back those of robots that do not drive to them; return what changed.

        ``standing`` is how long [s] each robot has made no progress, infinite if it has no stop left.
        """
        said = self.dispatcher.step(poses, floor, self.commands, standing, tick)
        if said:
            self.commands = [*map(self.missions.of_these_stops, range(len(self.robots)), self.commands)]
        return said

    # --- requests ---

    def request(self, number: int, request: Order | RobotAction, pose: Pose, reachable: Reachable) -> OrderChange:
        """Carry out a request to a robot.

        Raises:
            PeerError: the request is refused; nothing has changed.
        """
        outcome = self.missions.take(number, request, pose[:2], reachable)
        if outcome.new_stops:
            self.commands[number] = self.missions.of_these_stops(number, self.commands[number])
        return outcome

    def spots(self, starts: Sequence[Pose], bodies: Bodies, kind: str, time: float) -> Spots:
        """Return the free floor as it is now for robots of a kind; ``starts`` are those of all robots.

        Raises:
            ConfigError: there is no such kind.
        """
        held, each = (one.held for one in self.commands), self.roster.bodies
        rows = zip(self.robots, bodies.poses(), bodies.wheels, held, each, strict=True)
        stops = [stop for row in self.missions.orders.rows for stop in row.stops]
        homes = [(start[:2], body.radius) for start, body in zip(starts, each, strict=True)]
        pool = [errand.at for errand in self.pool.open.values()]
        return Spots(
            self.roster.settings_of(kind), bodies.floor, [Occupant(*row) for row in rows],
            bodies.mover_poses(time), homes, [*stops, *pool],
        )  # fmt: skip
