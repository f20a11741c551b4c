"""World and Robot objects in one process, without a bus: for tests, benchmarks, and the digest of a live run."""

from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from time import perf_counter
from typing import Any, NamedTuple

from msgspec.structs import replace as changed

from swarm.messages import Broadcast, Command, Event, Places, Sense
from swarm.robot.brain import Inputs, Robot
from swarm.scenario.load import Scenario
from swarm.scenario.prepare import planning_grid, prepare
from world.faults import SILENT, Drill, Faults, Health
from world.in_process import InProcess
from world.views.metrics import shortest_lengths
from world.views.report import missing, report
from world.world import World


class AnswerUnderWay(NamedTuple):
    """A robot's answer on its way to the world."""

    due: int  # tick in which it arrives
    command: Command
    broadcast: Broadcast | None


class Tick(NamedTuple):
    """What happened in one tick."""

    senses: Mapping[str, Sense]
    health: Mapping[str, Health]
    commands: Mapping[str, Command]  # answered in this tick; late commands reach the world some ticks later
    spoken: Mapping[str, Broadcast]  # broadcast in this tick
    events: list[Event]  # of the world


@dataclass(kw_only=True)
class Simulation(InProcess):
    """A world and its robots in lockstep; who answers when is drawn by the drill. Broadcasts are those of a tick."""

    robots: list[Robot]
    seed: int
    drill: Drill
    _under_way: dict[str, deque[AnswerUnderWay]] = field(default_factory=dict)  # answers of each robot, oldest first
    _leaders: set[str] = field(default_factory=set)
    _away: set[str] = field(default_factory=set)

    @classmethod
    def of(cls, scenario: Scenario, robots: int, seed: int, faults: Faults | None = None) -> "Simulation":
        """Return a simulation with all robots at the starts that the seed draws; ``faults`` will happen in it."""
        scenario, poses = prepare(scenario, robots, seed)
        world = World(scenario, poses, seed)
        roster = world.roster
        brains = [
            Robot(name, number, own, pose, planning_grid(own), roster.controller(number))
            for number, (name, pose) in enumerate(zip(world.robots, poses, strict=True))
            for own in [roster.scenario(number)]
        ]
        drill = Drill(faults or Faults(), seed, world.dt)
        return cls(world=world, scenario=scenario, robots=brains, seed=seed, drill=drill)

    def step(self) -> Tick:
        """Run one tick: the robots sense, decide and answer, and the world moves."""
        world = self.world
        senses = world.senses(lockstep=True)
        health: dict[str, Health] = {}
        commands: dict[str, Command] = {}
        spoken: dict[str, Broadcast] = {}
        for number, (name, sense) in enumerate(senses.items()):
            health[name] = self.drill.health(name, world.time, leads=name in self._leaders)
            if health[name] in SILENT:
                if health[name] is Health.AWAY:
                    self._away.add(name)
                continue
            robot = self._present(name, number, sense)
            outputs = robot.step(Inputs(sense, self.find_broadcasts(sense.hears)))
            held_up = health[name] is Health.HELD_UP
            command = commands[name] = changed(outputs.command, left=0.0, right=0.0) if held_up else outputs.command
            under_way = self._under_way.setdefault(name, deque())
            due = world.tick + self.drill.delay(name)
            under_way.append(
                AnswerUnderWay(max([due, *(answer.due for answer in under_way)]), command, outputs.broadcast)
            )
            if outputs.broadcast is not None:
                spoken[name] = outputs.broadcast
                own = outputs.broadcast.traffic and outputs.broadcast.traffic.own
                (self._leaders.add if own and own.plan is not None else self._leaders.discard)(name)
        self.broadcasts = {}
        for name in sorted(self._under_way):
            under_way = self._under_way[name]
            while under_way and under_way[0].due <= world.tick:
                answer = under_way.popleft()
                self.deliver(name, answer.command, answer.broadcast)
        return Tick(senses, health, commands, spoken, self.move())

    def open_places(self, request: Places) -> list[Event]:
        """Open places for more robots, and put robots there; return the events."""
        events = self.world.open_places(request)[1]
        self.robots += map(self.new_robot, self.world.robots[len(self.robots) :])
        return events

    def _present(self, name: str, number: int, sense: Sense) -> Robot:
        """Return the robot of that name with all edits taken in; it is a new one if its process had ended."""
        robot = self.robots[number]
        if name in self._away:
            self._away.discard(name)
            robot = self.robots[number] = self.welcome_robot(name)
        elif robot.has_missed_edits(sense):
            robot.take_map(self.scenario_of(name), self.world.bodies.edits)
        return robot

    def run(
        self,
        limit: float | None = None,
        watch: Callable[[World], None] | None = None,
        over: Callable[[World], bool] = lambda world: world.is_finished,
    ) -> dict[str, Any]:
        """Step until ``over`` returns True or ``limit`` [simulated s] has passed, and return the report."""
        world, began = self.world, perf_counter()
        limit = self.scenario.settings.limit if limit is None else limit
        while not over(world) and world.time < limit:
            self.step()
            if watch is not None:
                watch(world)
        return self.report(perf_counter() - began, limit)

    def report(self, wall_time: float, limit: float) -> dict[str, Any]:
        """Return the report of the run so far; ``limit`` [simulated s] is what ended it if it is not finished."""
        world, edited = self.world, self.scenario_on_floor()
        return report(
            world, shortest_lengths(world), scenario=edited.settings.name, seed=self.seed,
            robots_per_process=len(self.robots), pace="max", wall_time=wall_time, late_commands=0, tick_wall=None,
            reason=missing(world) if world.is_finished else f"time limit of {limit:g} s; {missing(world)}",
        )  # fmt: skip
