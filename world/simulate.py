"""The same World and Robot objects in one process, without any bus: for tests, benchmarks, and a live run's digest."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any

from swarm.geometry import Pose
from swarm.messages import Broadcast
from swarm.robot.brain import Inputs, Robot
from swarm.robot.fuzzy import Controller
from swarm.robot.ground import planning_grid
from swarm.scenario.load import Scenario
from swarm.scenario.starts import starts
from world.report import missing, report
from world.world import World


@dataclass(frozen=True)
class Simulation:
    """A world and its robots, stepped in lockstep."""

    world: World
    robots: list[Robot]
    scenario: Scenario
    seed: int

    @classmethod
    def of(cls, scenario: Scenario, robots: int, seed: int) -> "Simulation":
        """Set everybody up at the starts that the seed draws."""
        grid = planning_grid(scenario)
        controller = Controller(scenario.profile)
        poses = starts(scenario, grid, robots, seed)
        world = World(scenario, poses, seed)
        brains = [
            Robot(name, number, scenario, pose, grid, controller)
            for number, (name, pose) in enumerate(zip(world.robots, poses, strict=True))
        ]
        return cls(world, brains, scenario, seed)

    def run(self, limit: float | None = None, watch: Callable[[World], None] | None = None) -> dict[str, Any]:
        """Step until all are done or ``limit`` [simulated s] has passed, and give the report."""
        world, began = self.world, perf_counter()
        limit = self.scenario.settings.limit if limit is None else limit
        broadcasts: dict[tuple[str, int], Broadcast] = {}
        while not world.finished and world.time < limit:
            commands = {}
            spoken: dict[tuple[str, int], Broadcast] = {}
            for name, robot, sense in zip(world.robots, self.robots, world.senses(lockstep=True).values(), strict=True):
                outputs = robot.step(Inputs(sense, [broadcasts[key] for key in sense.hears]))
                commands[name] = outputs.command
                if outputs.broadcast is not None:
                    spoken[name, sense.tick] = outputs.broadcast
            broadcasts = spoken
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
