"""The `swarm` command: one thin function for each subcommand."""

import os
import sys
from collections.abc import Sequence


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return 0 for success, 1 if a run has not passed, 2 if the command or a file is wrong."""
    try:
        status = _run(arguments)
    except KeyboardInterrupt:  # `swarm run` gets here only before it has started the fleet
        sys.unraisablehook = lambda _: None  # what an interrupted import has half made may not end well
        print("swarm: interrupted; nothing is left running", file=sys.stderr)
        status = 1
    except BrokenPipeError:
        status = 1
    try:
        sys.stdout.flush()
    except OSError:  # the reader of the output, such as `head`, has closed it, or its terminal is gone
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        status = 1
    return status


def _run(arguments: Sequence[str] | None) -> int:
    # imported here, so that a Ctrl-C meanwhile is one sentence too, and so is what an installation lacks
    from swarm import installation
    from swarm.errors import SwarmError

    words = [*(sys.argv[1:] if arguments is None else arguments)]
    try:
        installation.check(installation.ROBOT if words[:1] in (["robot"], ["--version"]) else installation.LIBRARIES)
    except SwarmError as fault:
        print(f"swarm: {fault}", file=sys.stderr)
        return 2
    from swarm.cli.top import read
    from swarm.launch.process_name import name_process

    try:
        options = read(words)
        robot = options.id if options.called == "robot" else None  # others have an --id that names an order
        name_process(robot or options.called)
        return int(options.command(options))
    except SwarmError as fault:
        print(f"swarm: {fault}", file=sys.stderr)
        return 2
