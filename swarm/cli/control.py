"""The paper's buttons, and where a running fleet stands."""

import argparse
import json
from typing import TYPE_CHECKING

import msgspec

from swarm.cli.parsing import Commands, Parser
from swarm.errors import ConfigError

if TYPE_CHECKING:
    from swarm.bus import Bus

BUTTONS = {
    "go": "let the robots start",
    "pause": "let the clock stand",
    "resume": "let the clock go on",
    "restart": "all back to their starts, progress cleared",
    "stop": "end the run",
}


def button(options: argparse.Namespace) -> int:
    """Press one of the paper's buttons."""
    from swarm.messages import ACTION, Action, Do

    with fleet_bus(options) as bus:
        print(bus.ask(ACTION, Action(do=Do(options.button))).text)
    return 0


def status(options: argparse.Namespace) -> int:
    """Tell where a running fleet stands, as JSON."""
    from swarm.messages import CLOCK, STATE

    with fleet_bus(options) as bus:
        clocks = bus.fetch(CLOCK)
        if not clocks:
            raise ConfigError("status: expected a world in that fleet, found none; start one with `swarm world`")
        states = {state.robot: msgspec.to_builtins(state) for state in bus.fetch(STATE)}
    print(json.dumps({"clock": msgspec.to_builtins(clocks[0]), "robots": dict(sorted(states.items()))}, indent=1))
    return 0


def fleet_bus(options: argparse.Namespace) -> "Bus":
    """Open the wire of the fleet that is meant: the one named with --connect, or the one that runs here."""
    from swarm.bus import Bus, Endpoint
    from swarm.launch.running import find

    if options.connect is not None:
        return Bus(Endpoint.parse(options.connect), options.fleet or "fleet")
    card = find(options.fleet)
    return Bus(Endpoint.parse(card.endpoint), card.fleet)


def of_a_client(parser: Parser) -> None:
    """Let a command say which fleet it means."""
    parser.add_argument("--connect", metavar="ENDPOINT", help="of a router elsewhere; by default this machine's fleet")
    parser.add_argument("--fleet", metavar="NAME")


def add(commands: "Commands[Parser]") -> None:
    """Put these commands on the line."""
    for name, text in BUTTONS.items():
        one = commands.add_parser(name, help=text)
        of_a_client(one)
        one.set_defaults(command=button, button=name)
    one = commands.add_parser("status", help="where a running fleet stands, as JSON")
    of_a_client(one)
    one.set_defaults(command=status)
