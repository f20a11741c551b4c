"""The same World and Robot objects in one process, without any bus: for tests, benchmarks, and a live run's digest."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import Any

from msgspec.structs import replace as changed

from swarm.geometry import Pose
from swarm.messages import Broadcast, Command
from swarm.robot.brain import Inputs, Robot
from swarm.robot.fuzzy import Controller
from swarm.robot.ground import planning_grid
from swarm.scenario.load import Scenario
from swarm.scenario.starts import starts
from world.faults import Drill, Faults, Health
from world.report import missing, report
from world.world import World

Answers = tuple[dict[str, Command], dict[str, Broadcast]]  # of all robots, to one tick


@dataclass(frozen=True)
class Simulation:
    """A world and its robots, stepped in lockstep."""

    world: World
    robots: list[Robot]
    scenario: Scenario
    seed: int
    drill: Drill
    spoken: dict[str, Broadcast] = field(default_factory=dict)  # who broadcast in the last tick, and what

    @classmethod
    def of(cls, scenario: Scenario, robots: int, seed: int, faults: Faults | None = None) -> "Simulation":
        """Set everybody up at the starts that the seed draws; ``faults`` is what shall go wrong."""
        grid = planning_grid(scenario)
        controller = Controller(scenario.profile)
        poses = starts(scenario, grid, robots, seed)
        world = World(scenario, poses, seed)
        brains = [
            Robot(name, number, scenario, pose, grid, controller)
            for number, (name, pose) in enumerate(zip(world.robots, poses, strict=True))
        ]
        return cls(world, brains, scenario, seed, Drill(faults or Faults(), seed, world.dt))

    def run(
        self,
        limit: float | None = None,
        watch: Callable[[World], None] | None = None,
        over: Callable[[World], bool] = lambda world: world.finished,
    ) -> dict[str, Any]:
        """Step until all are done, or ``over``, or ``limit`` [simulated s] has passed, and give the report."""
        world, began = self.world, perf_counter()
        limit = self.scenario.settings.limit if limit is None else limit
        leaders: set[str] = set()
        answers = deque[Answers](({}, {}) for _ in range(self.drill.late))
        while not over(world) and world.time < limit:
            commands: dict[str, Command] = {}
            spoken: dict[str, Broadcast] = {}
            for name, robot, sense in zip(world.robots, self.robots, world.senses(lockstep=True).values(), strict=True):
                health = self.drill.health(name, world.time, leads=name in leaders)
                if health in {Health.SUSPENDED, Health.DEAD}:
                    continue
                outputs = robot.step(Inputs(sense, [self.spoken[sender] for sender, _ in sense.hears]))
                held_up = health is Health.HELD_UP
                commands[name] = changed(outputs.command, left=0.0, right=0.0) if held_up else outputs.command
                if outputs.broadcast is not None:
                    spoken[name] = outputs.broadcast
                    own = outputs.broadcast.traffic and outputs.broadcast.traffic.own
                    (leaders.add if own and own.plan is not None else leaders.discard)(name)
            answers.append((commands, spoken))
            commands, spoken = answers.popleft()
            self.spoken.clear()
            self.spoken.update(spoken)
            world.step(commands)
            if watch is not None:
                watch(world)
        edited = replace(self.scenario, map=world.floor)
        return report(
            world, planning_grid(edited), scenario=edited.settings.name, seed=self.seed, pace="max",
            wall_time=perf_counter() - began, late_commands=0,
            reason=missing(world) if world.finished else f"time limit of {limit:g} s; {missing(world)}",
        )  # fmt: skip


def poses_along(simulation: Simulation) -> list[list[Pose]]:
    """Run a simulation and keep every pose: ``poses[tick][robot]``."""
    kept = [simulation.world.poses()]
    simulation.run(watch=lambda world: kept.append(world.poses()))
    return kept
