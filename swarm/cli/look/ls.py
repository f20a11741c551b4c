"""The command `swarm ls`: the fleets on this machine, or on a router."""

import argparse
import json
from typing import Any

from swarm.cli.argument_parser import Commands, Parser, endpoint
from swarm.cli.columns import align_rows
from swarm.cli.fleet_lookup import add_client_options
from swarm.errors import ConfigError
from swarm.secure.names import WATCHER


def ls(options: argparse.Namespace) -> int:
    """Print a row for each fleet; return 1 if there is none."""
    from swarm.bus import fleets
    from swarm.launch.fleet_registry import cards

    if options.connect is None:
        found = [card for card in cards() if options.fleet in {None, card.fleet}]
        rows = [
            query_world(options, card.endpoint, card.fleet) | {"pid": card.pid, "box": card.box, "tape": card.tape}
            for card in found
        ]
        where = "on this machine"
    else:
        router = endpoint(options.connect, options.secure, WATCHER)
        names = [name for name in fleets(router) if options.fleet in {None, name}]
        rows = [query_world(options, str(router), name) | {"pid": None, "box": None, "tape": None} for name in names]
        where = f"on {router}"
    if options.json:
        print(json.dumps(rows, indent=1))
    elif rows:
        print(format_fleets(rows))
    else:
        wanted = "fleet" if options.fleet is None else f"fleet {options.fleet}"
        print(f"no {wanted} runs {where}; start one with `swarm run`")
    return 0 if rows else 1


def query_world(options: argparse.Namespace, router: str, fleet: str) -> dict[str, Any]:
    """Return what a fleet's world says of itself; its phase is the reason if it says nothing."""
    from swarm.bus import Bus
    from swarm.messages import CLOCK

    row: dict[str, Any] = {"fleet": fleet, "router": router, "time": None, "robots": None, "present": None}
    if router.startswith("tls/") and options.secure is None:
        return row | {"phase": "needs --secure"}
    try:
        with Bus(endpoint(router, options.secure, WATCHER), fleet) as bus:
            clocks = bus.fetch(CLOCK, timeout=2.0)
    except ConfigError:
        return row | {"phase": "no router" if options.secure is None else "other keys"}
    if not clocks:
        return row | {"phase": "no world"}
    clock = clocks[0]
    said = {"phase": clock.phase.value, "time": clock.time}
    return row | said | {"robots": len(clock.robots), "present": len(clock.present)}


def format_fleets(rows: list[dict[str, Any]]) -> str:
    """Return the rows as a table."""
    table = [("fleet", "router", "phase", "time", "robots", "pid")]
    for row in rows:
        time = "" if row["time"] is None else f"{row['time']:.1f} s"
        robots = "" if row["robots"] is None else f"{row['present']} of {row['robots']}"
        table.append((row["fleet"], row["router"], row["phase"], time, robots, str(row["pid"] or "")))
    return align_rows(table, right=(3, 4, 5))


def add(commands: "Commands[Parser]") -> None:
    """Add this command to the command line."""
    text = "list the fleets on this machine, or on the router of --connect"
    more = (
        "On this machine these are the fleets that `swarm run` or `swarm box` of this user has started: it keeps "
        "a list of them. One that was started by hand, with `swarm router` and `swarm world`, is not in it: "
        "`swarm ls --connect ENDPOINT` asks its router."
    )
    one = commands.add_parser("ls", help=text, description=more)
    one.add_argument(
        "--json",
        action="store_true",
        help="a list, with each fleet's tape, and the address of its box, which is secret",
    )
    add_client_options(one)
    one.set_defaults(command=ls)
