"""The `swarm` command. One function a subcommand; each is thin, the work is elsewhere."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NoReturn

import msgspec

from swarm.errors import ConfigError, SwarmError

if TYPE_CHECKING:
    from swarm.bus import Bus, Endpoint

PACES: Final[dict[str, float | str]] = {"realtime": 1.0, "max": "max"}
DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"


class Parser(argparse.ArgumentParser):
    """argparse, with one sentence for what is wrong."""

    def error(self, message: str) -> NoReturn:
        """Say what is wrong and how to see what is right."""
        raise ConfigError(f"{self.prog}: {message}; see {self.prog} --help")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command: 0 all is well, 1 a mission is not complete, 2 the command or a file is wrong."""
    try:
        options = parser().parse_args(arguments)
        return int(options.command(options))
    except SwarmError as fault:
        print(f"swarm: {fault}", file=sys.stderr)
        return 2


def run(options: argparse.Namespace) -> int:
    """Launch a whole fleet on this machine."""
    from swarm.launch import run as launch
    from swarm.scenario import load

    scenario = load(options.scenario)
    settings = scenario.settings
    robots = settings.robots if options.robots is None else options.robots
    if not 1 <= robots <= 1000:
        raise ConfigError(f"--robots: expected 1 to 1000, got {robots}")
    return launch.run(
        launch.Options(
            scenario=scenario,
            robots=robots,
            seed=settings.seed if options.seed is None else options.seed,
            pace=_pace(options.pace),
            limit=settings.limit if options.limit is None else options.limit,
            wait=options.wait,
            dashboard=options.dashboard,
            record=options.record,
            report=options.report,
            port=options.port,
            fleet=options.fleet,
        )
    )


def router(options: argparse.Namespace) -> int:
    """Be the router."""
    from swarm.bus import Endpoint
    from swarm.bus.router import serve

    endpoint = Endpoint.parse(options.listen).claim()
    print(f"router: listening on {endpoint}", flush=True)
    return serve(endpoint)


def world(options: argparse.Namespace) -> int:
    """Be the world."""
    from swarm.robot.brain import planning_grid
    from swarm.scenario import load
    from swarm.scenario.check import check

    scenario = load(options.scenario)
    settings = scenario.settings
    robots = settings.robots if options.robots is None else options.robots
    seed = settings.seed if options.seed is None else options.seed
    check(scenario, planning_grid(scenario), robots, seed)
    status: int = _by_name("world.process:run")(
        _endpoint(options),
        options.fleet,
        scenario,
        robots,
        seed,
        _pace(options.pace),
        settings.limit if options.limit is None else options.limit,
        wait=options.wait,
        report_to=options.report,
    )
    return status


def robot(options: argparse.Namespace) -> int:
    """Be one robot."""
    from swarm.robot.process import run as be_robot

    return be_robot(_endpoint(options), options.fleet, options.id)


def button(options: argparse.Namespace) -> int:
    """Press one of the paper's buttons."""
    from swarm.messages import ACTION, Action, Do

    with _fleet_bus(options) as bus:
        print(bus.ask(ACTION, Action(do=Do(options.button))).text)
    return 0


def status(options: argparse.Namespace) -> int:
    """Tell where a running fleet stands, as JSON."""
    from swarm.messages import CLOCK, STATE

    with _fleet_bus(options) as bus:
        clocks = bus.fetch(CLOCK)
        if not clocks:
            raise ConfigError("status: expected a world in that fleet, found none; start one with `swarm world`")
        states = {state.robot: msgspec.to_builtins(state) for state in bus.fetch(STATE)}
    print(json.dumps({"clock": msgspec.to_builtins(clocks[0]), "robots": dict(sorted(states.items()))}, indent=1))
    return 0


def parser() -> Parser:
    """Everything that can be said on the command line."""
    top = Parser(prog="swarm", description="N robots, each its own process, one shared world, seen in Rerun.")
    commands = top.add_subparsers(required=True, metavar="COMMAND", parser_class=Parser)

    launch = commands.add_parser("run", help="launch a whole fleet on this machine")
    launch.add_argument("scenario", type=Path, help="a scenario .yaml")
    _of_a_run(launch)
    launch.add_argument("--dashboard", default="auto", help="auto, viewer, web or off")
    launch.add_argument("--record", type=Path, metavar="FILE.rrd", help="save what the dashboard draws")
    launch.add_argument("--port", type=int, default=0, help="of the router; 0 picks a free one")
    launch.add_argument("--fleet", help="name of the fleet; by default the scenario's")
    launch.set_defaults(command=run)

    one = commands.add_parser("router", help="be the router of fleets")
    one.add_argument("--listen", default=DEFAULT_ENDPOINT, metavar="ENDPOINT")
    one.set_defaults(command=router)

    one = commands.add_parser("world", help="be the world of a fleet")
    one.add_argument("scenario", type=Path)
    _of_a_run(one)
    _of_a_process(one)
    one.set_defaults(command=world)

    one = commands.add_parser("robot", help="be one robot of a fleet")
    one.add_argument("--id", help="its name, such as r1; by default whichever place is free")
    _of_a_process(one)
    one.set_defaults(command=robot)

    for name, text in (
        ("go", "let the robots start"),
        ("pause", "let the clock stand"),
        ("resume", "let the clock go on"),
        ("restart", "all back to their starts, progress cleared"),
        ("stop", "end the run"),
    ):
        one = commands.add_parser(name, help=text)
        _of_a_client(one)
        one.set_defaults(command=button, button=name)

    one = commands.add_parser("status", help="where a running fleet stands, as JSON")
    _of_a_client(one)
    one.set_defaults(command=status)
    return top


def _of_a_run(parser: Parser) -> None:
    parser.add_argument("--robots", type=int, metavar="N")
    parser.add_argument("--seed", type=int, metavar="S")
    parser.add_argument("--pace", default="realtime", help="realtime, max (lockstep) or a factor")
    parser.add_argument("--limit", type=float, metavar="SECONDS", help="simulated time after which a run is given up")
    parser.add_argument("--wait", action="store_true", help="stand until `swarm go`")
    parser.add_argument("--report", type=Path, metavar="FILE.json")


def _of_a_process(parser: Parser) -> None:
    parser.add_argument("--connect", default=DEFAULT_ENDPOINT, metavar="ENDPOINT")
    parser.add_argument("--fleet", default="fleet", metavar="NAME")


def _of_a_client(parser: Parser) -> None:
    parser.add_argument("--connect", metavar="ENDPOINT", help="of a router elsewhere; by default this machine's fleet")
    parser.add_argument("--fleet", metavar="NAME")


def _endpoint(options: argparse.Namespace) -> Endpoint:
    from swarm.bus import Endpoint

    return Endpoint.parse(options.connect)


def _fleet_bus(options: argparse.Namespace) -> Bus:
    """Open the wire of the fleet that is meant: the one named with --connect, or the one that runs here."""
    from swarm.bus import Bus, Endpoint
    from swarm.launch.running import find

    if options.connect is not None:
        return Bus(Endpoint.parse(options.connect), options.fleet or "fleet")
    card = find(options.fleet)
    return Bus(Endpoint.parse(card.endpoint), card.fleet)


def _pace(text: str) -> float | str:
    """Read ``realtime``, ``max`` (lockstep) or a speed-up factor."""
    if text in PACES:
        return PACES[text]
    try:
        factor = float(text)
    except ValueError:
        factor = 0.0
    if not 0.001 <= factor <= 1000:
        raise ConfigError(f"--pace: expected realtime, max or a factor from 0.001 to 1000, got {text!r}")
    return factor


def _by_name(target: str) -> Callable[..., Any]:
    import importlib

    module, _, function = target.partition(":")
    found: Callable[..., Any] = getattr(importlib.import_module(module), function)
    return found


if __name__ == "__main__":
    sys.exit(main())
