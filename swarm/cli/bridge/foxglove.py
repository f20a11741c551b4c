"""The command `swarm bridge foxglove`: a running fleet in Foxglove, live and as a file."""

import argparse
from pathlib import Path

from swarm.cli.argument_parser import Commands, Parser
from swarm.cli.bridge import clock
from swarm.cli.fleet_lookup import add_client_options, find_fleet
from swarm.errors import ConfigError
from swarm.installation import hint_for_extra
from swarm.secure.names import BRIDGE, WATCHER

HOST = "127.0.0.1"
PORT = 8765  # at which viewers look


def bridge(options: argparse.Namespace) -> int:
    """Show a fleet to Foxglove until its run is over or we are told to stop."""
    if not 0 <= options.port <= 65535:
        raise ConfigError(f"--port: expected 0 (a free one) to 65535, got {options.port}")
    if (lacks := hint_for_extra("foxglove")) is not None:
        raise ConfigError(f"bridge foxglove: {lacks}")
    from swarm.bridge.foxglove.process import run
    from swarm.bus import Endpoint

    router, fleet = find_fleet(options, WATCHER if options.read_only else BRIDGE)
    serve = Endpoint(options.bind, options.port)
    if not serve.is_local:
        steers = "" if options.read_only else " and can steer it"
        print(f"foxglove: {options.bind} is open: anybody who reaches it sees the fleet{steers}", flush=True)
    return run(
        router,
        fleet,
        serve=serve,
        record=options.record,
        read_only=options.read_only,
        wall_time=options.clock == "wall",
    )


def add(commands: "Commands[Parser]") -> None:
    """Add this command below `swarm bridge`."""
    said = "show a running fleet in Foxglove and Lichtblick, and take goals from there"
    one = commands.add_parser("foxglove", help=said, description=f"{said}; see docs/foxglove.md")
    add_client_options(one)
    one.add_argument("--port", type=int, default=PORT, metavar="N", help=f"{PORT} by default; 0 picks a free one")
    text = "address to serve at; only this machine by default, 0.0.0.0: all that reach it, who can steer the fleet then"
    one.add_argument("--bind", default=HOST, metavar="HOST", help=text)
    one.add_argument("--read-only", action="store_true", help="viewers see the fleet, and cannot send robots anywhere")
    one.add_argument("--record", type=Path, metavar="FILE.mcap", help="write a bag of ROS 2, too")
    clock.add(one)
    one.set_defaults(command=bridge)
