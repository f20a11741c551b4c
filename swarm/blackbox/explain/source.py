"""What runs again: a tape, a plan of a storm, or a scenario with a number of robots and a seed, as in lockstep."""

from collections.abc import Callable, Mapping
from pathlib import Path

import yaml

from swarm.blackbox.explain.moment import Instant, Simulated, run_moment_until
from swarm.blackbox.explain.tape_moment import Taped
from swarm.blackbox.replay.keyframes import make_keyframe_folder
from swarm.blackbox.replay.replay import Replay
from swarm.errors import ConfigError
from swarm.maps.files import read_text
from swarm.scenario.check import check
from swarm.scenario.load import load
from swarm.scenario.shipped_scenarios import find_scenario
from swarm.settings import TAPE
from swarm.storm.plans.plan import LARGEST, read
from swarm.storm.uncooperative import make_mute
from swarm.tape.reader import TapeFile
from world.simulate import Simulation


def open_moment_at(
    path: Path,
    at: float | None,
    *,
    run: int | None = None,
    robots: int | Mapping[str, int] | None = None,
    seed: int | None = None,
    each: Callable[[Replay], None] = lambda replay: None,
) -> Instant:
    """Return a run as it is at a time [s]: a file that ends as a tape is one. None: where the tape ends.

    Of a tape, ``run`` is the number of the run, by default the last, and ``each`` is called after every tick. Of other
    files, ``robots`` and ``seed`` may be given.

    Raises:
        ConfigError: the file cannot be read, or is not what it should be, or the run has no such time.
    """
    if path.suffix != TAPE:
        if run is not None:
            raise ConfigError(f"--run: expected a tape, got {path}; leave --run out")
        if at is None:
            raise ConfigError(f"--at: expected a time of the run in {path} [s], got none; only a tape ends by itself")
        return _simulate_source(simulation_from(path, robots, seed), at)
    for name, value in (("--robots", robots), ("--seed", seed)):
        if value is not None:
            raise ConfigError(f"{name}: expected none with a tape, which has its own, got {value}; leave {name} out")
    taped = Taped(TapeFile(path), make_keyframe_folder())
    taped.run_through(run, None if at is None else round(at / taped.world.dt), each)
    return taped


def _simulate_source(simulation: Simulation, at: float) -> Instant:
    tick = round(at / simulation.world.dt)
    moment = run_moment_until(Simulated(simulation), tick)
    if moment.past.tick < tick:
        raise ConfigError(f"--at: expected 0 to {moment.past.clock(moment.past.tick)}, got {at:g}; the run ends there")
    return moment


def simulation_from(path: Path, robots: int | Mapping[str, int] | None = None, seed: int | None = None) -> Simulation:
    """Return a run that has not begun; robots and seed are the scenario's, unless given.

    Raises:
        ConfigError: the file cannot be read, is neither a plan nor a scenario, or the mission cannot be driven.
    """
    path = find_scenario(path)
    if _is_plan(path):
        plan = read(path)
        scenario = plan.to_scenario()
        simulation = Simulation.of(scenario, plan.robots, scenario.settings.seed, plan.to_faults())
        make_mute(simulation, plan.mute)
        return simulation
    scenario, count = load(path).with_robots(robots)
    seed = scenario.settings.seed if seed is None else seed
    return Simulation.of(check(scenario, count, seed).scenario, count, seed)


def _is_plan(path: Path) -> bool:
    try:
        raw = yaml.load(read_text(path, LARGEST), yaml.CSafeLoader)
    except (yaml.YAMLError, RecursionError, ValueError):
        return False
    return isinstance(raw, dict) and "storm" in raw
