"""The command `swarm ls`: the fleets on this machine, or on a router."""

import argparse
import json
from typing import Any

from swarm.cli.finding import of_a_client
from swarm.cli.parsing import Commands, Parser, endpoint
from swarm.errors import ConfigError
from swarm.secure.identity import WATCHER


def ls(options: argparse.Namespace) -> int:
    """Print a row for each fleet; return 1 if there is none."""
    from swarm.bus import fleets
    from swarm.launch.running import cards

    if options.connect is None:
        rows = [asked(options, card.endpoint, card.fleet) | {"pid": card.pid} for card in cards()]
        where = "on this machine"
    else:
        router = endpoint(options.connect, options.secure, WATCHER)
        rows = [asked(options, str(router), name) | {"pid": None} for name in fleets(router)]
        where = f"on {router}"
    rows = [row for row in rows if options.fleet in {None, row["fleet"]}]
    if options.json:
        print(json.dumps(rows, indent=1))
    elif rows:
        shown(rows)
    else:
        print(f"no fleet runs {where}; start one with `swarm run`")
    return 0 if rows else 1


def asked(options: argparse.Namespace, router: str, fleet: str) -> dict[str, Any]:
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


def shown(rows: list[dict[str, Any]]) -> None:
    """Print the rows as a table."""
    from rich.box import SIMPLE_HEAD
    from rich.console import Console
    from rich.table import Table

    table = Table(box=SIMPLE_HEAD, pad_edge=False)
    table.add_column("fleet", overflow="fold")
    table.add_column("router", no_wrap=True)
    table.add_column("phase", no_wrap=True)
    for name in ("time", "robots", "pid"):
        table.add_column(name, justify="right", no_wrap=True)
    for row in rows:
        time = "" if row["time"] is None else f"{row['time']:.1f} s"
        robots = "" if row["robots"] is None else f"{row['present']} of {row['robots']}"
        table.add_row(row["fleet"], row["router"], row["phase"], time, robots, str(row["pid"] or ""))
    Console().print(table)


def add(commands: "Commands[Parser]") -> None:
    """Add this command to the command line."""
    one = commands.add_parser("ls", help="list the fleets on this machine, or on the router of --connect")
    one.add_argument("--json", action="store_true")
    of_a_client(one)
    one.set_defaults(command=ls)
