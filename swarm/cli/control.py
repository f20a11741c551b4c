"""Commands to a running fleet: the paper's buttons, edits of the floor, and its status."""

import argparse
import json
from typing import TYPE_CHECKING

import msgspec

from swarm.cli.parsing import Commands, Parser, endpoint, point, secure
from swarm.errors import ConfigError
from swarm.secure.identity import OPERATOR, WATCHER

if TYPE_CHECKING:
    from swarm.bus import Bus

BUTTONS = {
    "go": "start the robots",
    "pause": "stop the clock",
    "resume": "start the clock again",
    "restart": "put all robots back at their starts and clear the progress",
}


def button(options: argparse.Namespace) -> int:
    """Press one of the paper's buttons."""
    from swarm.messages import ACTION, Action, Do

    with fleet_bus(options, OPERATOR) as bus:
        print(bus.ask(ACTION, Action(do=Do(options.button))).text)
    return 0


def edit(options: argparse.Namespace) -> int:
    """Add walls or obstacles to the floor of a running fleet, or remove them."""
    from swarm.messages import EDIT, Edit, Kind

    if not all(abs(value) <= 1e6 for corner in (options.low, options.high) for value in corner):
        raise ConfigError(
            f"swarm edit: expected corners within 1e6 m, got {options.low} and {options.high}; correct them"
        )
    with fleet_bus(options, OPERATOR) as bus:
        print(bus.ask(EDIT, Edit(kind=Kind(options.kind), low=options.low, high=options.high)).text)
    return 0


def status(options: argparse.Namespace) -> int:
    """Print the status of a running fleet as JSON."""
    from swarm.messages import CLOCK, STATE

    with fleet_bus(options, WATCHER) as bus:
        clocks = bus.fetch(CLOCK)
        if not clocks:
            raise ConfigError("status: expected a world in that fleet, found none; start one with `swarm world`")
        states = {state.robot: msgspec.to_builtins(state) for state in bus.fetch(STATE)}
    print(json.dumps({"clock": msgspec.to_builtins(clocks[0]), "robots": dict(sorted(states.items()))}, indent=1))
    return 0


def fleet_bus(options: argparse.Namespace, member: str) -> "Bus":
    """Return a member's bus of the fleet given by --connect, or of the fleet that runs on this machine.

    Raises:
        ConfigError: the endpoint is wrong, or no fleet or several fleets run on this machine.
    """
    from swarm.bus import Bus
    from swarm.launch.running import find

    if options.connect is not None:
        return Bus(endpoint(options.connect, options.secure, member), options.fleet or "fleet")
    card = find(options.fleet)
    return Bus(endpoint(card.endpoint, options.secure, member), card.fleet)


def of_a_client(parser: Parser) -> None:
    """Add the options that choose a fleet."""
    parser.add_argument("--connect", metavar="ENDPOINT", help="the fleet's router; by default that on this machine")
    parser.add_argument("--fleet", metavar="NAME")
    secure(parser)


def add(commands: "Commands[Parser]") -> None:
    """Add these commands to the command line."""
    for name, text in BUTTONS.items():
        one = commands.add_parser(name, help=text)
        of_a_client(one)
        one.set_defaults(command=button, button=name)
    one = commands.add_parser("edit", help="add walls to the floor of a running fleet, or remove them")
    one.add_argument("kind", choices=("wall", "obstacle", "free"), help="what all cells of the rectangle become")
    one.add_argument("low", type=point, metavar="X,Y", help="m, a corner")
    one.add_argument("high", type=point, metavar="X,Y", help="m, the opposite corner")
    of_a_client(one)
    one.set_defaults(command=edit)
    one = commands.add_parser("status", help="print the status of a running fleet as JSON")
    of_a_client(one)
    one.set_defaults(command=status)
