"""The `swarm` command: one thin function for each subcommand."""

import os
import sys
from collections.abc import Sequence

from swarm.cli import control, fleet, storm, tools
from swarm.cli.parsing import Parser, Version, joined
from swarm.errors import SwarmError


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return 0 for success, 1 if a mission is not complete, 2 if the command or a file is wrong."""
    try:
        try:
            return _run(arguments)
        finally:
            sys.stdout.flush()
    except BrokenPipeError:  # the reader of the output, such as `head`, has closed it
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1


def _run(arguments: Sequence[str] | None) -> int:
    top = Parser(prog="swarm", description="N robots, each its own process, in one shared world, shown in Rerun.")
    top.add_argument(
        "--version", action=Version, nargs=0, help="print the version, and whether the package is compiled"
    )
    commands = top.add_subparsers(required=True, metavar="COMMAND", parser_class=Parser)
    for room in (fleet, control, storm, tools):
        room.add(commands)
    try:
        options = top.parse_args(joined(sys.argv[1:] if arguments is None else arguments))
        return int(options.command(options))
    except SwarmError as fault:
        print(f"swarm: {fault}", file=sys.stderr)
        return 2
