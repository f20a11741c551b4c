"""The command `swarm keys`: it makes the certificates of a fleet."""

import argparse
from pathlib import Path

from swarm.cli.argument_parser import Commands, Parser
from swarm.errors import ConfigError


def keys(options: argparse.Namespace) -> int:
    """Make the keys of a fleet in a new folder."""
    from swarm.scenario.starts import robot_names
    from swarm.secure.keys import make
    from swarm.secure.names import ROLES

    if not 1 <= options.robots <= 1000:
        raise ConfigError(f"--robots: expected 1 to 1000, got {options.robots}")
    if not 0 < options.days <= 3650:
        raise ConfigError(f"--days: expected more than 0 and at most 3650, got {options.days:g}")
    robots = robot_names(options.robots)
    make(options.folder, robots, options.host, options.days, several=options.several_routers)
    print(f"{options.folder}: keys for {options.days:g} days, for {', '.join((*ROLES, *robots))}")
    return 0


def add(commands: "Commands[Parser]") -> None:
    """Add this command to the command line."""
    one = commands.add_parser("keys", help="make the keys of a fleet that only its members can join")
    one.add_argument("folder", type=Path, metavar="DIR", help="a new folder, or an empty one")
    one.add_argument("--robots", type=int, required=True, metavar="N")
    text = "days until the keys expire, 30 by default; a member's keys cannot be taken back earlier"
    one.add_argument("--days", type=float, default=30.0, metavar="D", help=text)
    text = "a name or address by which others reach the router, beside those of this machine; may be repeated"
    one.add_argument("--host", action="append", default=[], metavar="NAME", help=text)
    text = "let routers join each other (`swarm router --join`): then who has the router's keys may say everything"
    one.add_argument("--several-routers", action="store_true", help=text)
    one.set_defaults(command=keys)
