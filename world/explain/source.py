"""What runs again: a plan of a storm, or a scenario with a number of robots and a seed, as in lockstep."""

from pathlib import Path

import yaml

from swarm.maps.files import read_text
from swarm.scenario.check import check
from swarm.scenario.load import load
from swarm.scenario.shipped import found
from world.simulate import Simulation
from world.storm.plans.plan import LARGEST, read
from world.storm.uncooperative import make_mute


def simulation_from(path: Path, robots: int | None = None, seed: int | None = None) -> Simulation:
    """Return a run that has not begun; robots and seed are the scenario's, unless given.

    Raises:
        ConfigError: the file cannot be read, is neither a plan nor a scenario, or the mission cannot be driven.
    """
    path = found(path)
    if _is_plan(path):
        plan = read(path)
        scenario = plan.to_scenario()
        simulation = Simulation.of(scenario, plan.robots, scenario.settings.seed, plan.to_faults())
        make_mute(simulation, plan.mute)
        return simulation
    scenario = load(path)
    robots = scenario.settings.robots if robots is None else robots
    seed = scenario.settings.seed if seed is None else seed
    return Simulation.of(check(scenario, robots, seed).scenario, robots, seed)


def _is_plan(path: Path) -> bool:
    try:
        raw = yaml.load(read_text(path, LARGEST), yaml.CSafeLoader)
    except (yaml.YAMLError, RecursionError, ValueError):
        return False
    return isinstance(raw, dict) and "storm" in raw
