"""The commands `swarm why` and `swarm open`: a run is run again up to a tick, and asked."""

import argparse
import json
import math
from pathlib import Path
from typing import TYPE_CHECKING

from swarm.cli.parsing import Commands, Parser
from swarm.errors import ConfigError
from swarm.settings import MOST_ROBOTS

if TYPE_CHECKING:
    from world.explain.moment import Moment


def why(options: argparse.Namespace) -> int:
    """Print the chain of causes of what a robot does at a time."""
    import msgspec

    from world.explain.clauses import as_text

    moment = _moment(options)
    causes = moment.why(options.robot)
    if options.json:
        print(json.dumps([msgspec.to_builtins(cause._asdict()) for cause in causes], indent=1))
    else:
        print(f"{options.robot} at {moment.past.clock(moment.past.tick)}:\n{as_text(causes)}")
    return 0


def opened(options: argparse.Namespace) -> int:
    """Print the whole state of a robot at a time, as JSON."""
    import msgspec

    moment = _moment(options)
    print(json.dumps(msgspec.to_builtins(moment.state(options.robot)), indent=1))
    return 0


def _moment(options: argparse.Namespace) -> "Moment":
    from world.explain.moment import run_until
    from world.explain.source import simulation_from

    if not 0.0 <= options.at <= 1e6 or math.isnan(options.at):
        raise ConfigError(f"--at: expected 0 to 1e6 s, got {options.at:g}")
    if options.robots is not None and not 1 <= options.robots <= MOST_ROBOTS:
        raise ConfigError(f"--robots: expected 1 to {MOST_ROBOTS}, got {options.robots}")
    if options.seed is not None and not 0 <= options.seed <= 2**53:
        raise ConfigError(f"--seed: expected 0 to 2**53, got {options.seed}")
    simulation = simulation_from(options.run, options.robots, options.seed)
    names = simulation.world.robots
    if options.robot not in names:
        raise ConfigError(f"robot: expected one of {', '.join(names)}, got {options.robot!r}; this run has no other")
    return run_until(simulation, round(options.at / simulation.world.dt))


def add(commands: "Commands[Parser]") -> None:
    """Add these commands to the command line."""
    one = commands.add_parser("why", help="say why a robot does what it does at a time, to the root of it")
    _of_a_moment(one)
    one.add_argument("--json", action="store_true")
    one.set_defaults(command=why)

    one = commands.add_parser("open", help="print all that a robot knows and has decided at a time, as JSON")
    _of_a_moment(one)
    one.set_defaults(command=opened)


def _of_a_moment(parser: Parser) -> None:
    parser.add_argument("robot", metavar="ROBOT", help="such as r3")
    text = "what is run again: a scenario, as `swarm run --pace max` runs it, or a plan of `swarm storm`"
    parser.add_argument("run", type=Path, metavar="RUN", help=text)
    parser.add_argument("--at", type=float, required=True, metavar="SECONDS", help="time of the run")
    parser.add_argument("--robots", type=int, metavar="N", help="by default as the scenario says")
    parser.add_argument("--seed", type=int, metavar="S", help="by default as the scenario says")
