"""The command `swarm bridge` with all that is below it."""

from typing import Final

from swarm.cli.argument_parser import Commands, Parser
from swarm.cli.bridge import foxglove, ros2, vda5050

OTHERS: Final = (ros2, foxglove, vda5050)


def add(commands: "Commands[Parser]") -> None:
    """Add this command to the command line, with one below it for each of the other worlds."""
    one = commands.add_parser("bridge", help="show a running fleet to other software, and take orders from it")
    others: Commands[Parser] = one.add_subparsers(required=True, dest="to", metavar="TO", parser_class=Parser)
    for other in OTHERS:
        other.add(others)
