"""Commands that run a whole fleet on this machine, or one process of a fleet."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from swarm.cli.parsing import DEFAULT_ENDPOINT, Commands, Parser, pace
from swarm.errors import ConfigError

if TYPE_CHECKING:
    from swarm.bus import Endpoint
    from swarm.settings import Settings


def run(options: argparse.Namespace) -> int:
    """Launch a whole fleet on this machine; without a scenario, list those that come with the project."""
    from swarm.launch.fleet import warm_up
    from swarm.scenario.shipped import found, shipped
    from swarm.scenario.source import Source

    if options.scenario is None:
        print("swarm run SCENARIO: a scenario file, or one of these:")
        print("\n".join(f"  {name:15}{about}" for name, about in shipped().items()))
        return 0
    source = Source(found(options.scenario), options.scen, options.robots)
    if source.file.is_file():
        warm_up(source)
    from swarm.launch import run as launch

    scenario = source.read()
    robots, seed, limit = _numbers(options, scenario.settings)
    if not 0 <= options.port <= 65535:
        raise ConfigError(f"--port: expected 0 (a free one) to 65535, got {options.port}")
    return launch.run(
        launch.Options(
            scenario=scenario,
            robots=robots,
            robots_per_process=_at_least_one("--robots-per-process", options.robots_per_process),
            seed=seed,
            pace=pace(options.pace),
            limit=limit,
            wait=options.wait,
            dashboard=options.dashboard,
            rules=options.rules,
            record=options.record,
            report=options.report,
            port=options.port,
            fleet=options.fleet,
        )
    )


def router(options: argparse.Namespace) -> int:
    """Run the router."""
    from swarm.bus import Endpoint
    from swarm.bus.router import serve

    endpoint = Endpoint.parse(options.listen).claim()
    print(f"router: listening on {endpoint}", flush=True)
    return serve(endpoint)


def world(options: argparse.Namespace) -> int:
    """Run the world."""
    from swarm.scenario.check import check
    from swarm.scenario.load import load
    from swarm.scenario.shipped import found
    from world.process import run as run_world

    scenario = load(found(options.scenario))
    robots, seed, limit = _numbers(options, scenario.settings)
    scenario = check(scenario, robots, seed).scenario
    return run_world(
        _endpoint(options),
        options.fleet,
        scenario,
        robots,
        seed,
        pace(options.pace),
        limit,
        wait=options.wait,
        report_to=options.report,
    )


def robot(options: argparse.Namespace) -> int:
    """Run one robot, or more of them in this process."""
    from swarm.robot.process import run as be_robots

    count = _at_least_one("--count", options.count)
    if options.id is not None and count > 1:
        raise ConfigError(f"--id: expected no name with --count {count}, got {options.id!r}; leave one of them out")
    return be_robots(_endpoint(options), options.fleet, [options.id] * count)


def _at_least_one(option: str, robots: int) -> int:
    if robots < 1:
        raise ConfigError(f"{option}: expected at least 1 robot, got {robots}")
    return robots


def _numbers(options: argparse.Namespace, settings: "Settings") -> tuple[int, int, float]:
    """Return robots, seed and limit [s]: from the command line if given, else from the scenario."""
    robots = settings.robots if options.robots is None else options.robots
    seed = settings.seed if options.seed is None else options.seed
    limit = settings.limit if options.limit is None else options.limit
    if not 1 <= robots <= 1000:
        raise ConfigError(f"--robots: expected 1 to 1000, got {robots}")
    if not 0 <= seed <= 2**53:
        raise ConfigError(f"--seed: expected 0 to 2**53, got {seed}")
    if not 0 < limit <= 1e6:
        raise ConfigError(f"--limit: expected seconds above 0, at most 1e6, got {limit:g}")
    return robots, seed, limit


def add(commands: "Commands[Parser]") -> None:
    """Add these commands to the command line."""
    launch = commands.add_parser("run", help="launch a whole fleet on this machine")
    text = "a scenario .yaml, the name of one that comes with the project, or a MovingAI .map with --scen"
    launch.add_argument("scenario", type=Path, nargs="?", help=text)
    launch.add_argument("--scen", type=Path, metavar="FILE.scen", help="row i is robot i's start and target")
    _of_a_run(launch)
    text = "robots that share a process, 1 by default; if one of them fails, all of them are started again"
    launch.add_argument("--robots-per-process", type=int, default=1, metavar="K", help=text)
    launch.add_argument("--dashboard", default="auto", help="auto, viewer, web or off")
    launch.add_argument("--rules", metavar="ROBOT", help="robot whose fired rules are shown; by default the first")
    launch.add_argument("--record", type=Path, metavar="FILE.rrd", help="save what the dashboard draws")
    launch.add_argument("--port", type=int, default=0, help="port of the router; 0 picks a free one")
    launch.add_argument("--fleet", help="name of the fleet; by default the scenario's")
    launch.set_defaults(command=run)

    one = commands.add_parser("router", help="run the router of fleets")
    one.add_argument("--listen", default=DEFAULT_ENDPOINT, metavar="ENDPOINT")
    one.set_defaults(command=router)

    one = commands.add_parser("world", help="run the world of a fleet")
    one.add_argument("scenario", type=Path)
    _of_a_run(one)
    _of_a_process(one)
    one.set_defaults(command=world)

    one = commands.add_parser("robot", help="run one robot of a fleet, or several in one process")
    one.add_argument("--id", help="its name, such as r1; by default the first free one")
    one.add_argument("--count", type=int, default=1, metavar="K", help="robots in this process, 1 by default")
    _of_a_process(one)
    one.set_defaults(command=robot)


def _of_a_run(parser: Parser) -> None:
    parser.add_argument("--robots", type=int, metavar="N")
    parser.add_argument("--seed", type=int, metavar="S")
    parser.add_argument("--pace", default="realtime", help="realtime, max (lockstep) or a factor")
    parser.add_argument("--limit", type=float, metavar="SECONDS", help="simulated time after which the run ends")
    parser.add_argument("--wait", action="store_true", help="wait for `swarm go` before the start")
    parser.add_argument("--report", type=Path, metavar="FILE.json")


def _of_a_process(parser: Parser) -> None:
    parser.add_argument("--connect", default=DEFAULT_ENDPOINT, metavar="ENDPOINT")
    parser.add_argument("--fleet", default="fleet", metavar="NAME")


def _endpoint(options: argparse.Namespace) -> "Endpoint":
    from swarm.bus import Endpoint

    return Endpoint.parse(options.connect)
