"""The command `swarm topics`: the keys on which a fleet talks, how often and how much."""

import argparse
import json
import sys
from time import monotonic
from typing import TYPE_CHECKING

from swarm.cli.argument_parser import Commands, Parser, seconds
from swarm.cli.columns import align_rows
from swarm.cli.fleet_lookup import add_client_options, find_fleet
from swarm.secure.names import WATCHER

if TYPE_CHECKING:
    from swarm.cli.look.rates import KeyRow


def topics(options: argparse.Namespace) -> int:
    """Listen for a while and print a row for each key that was heard or has a last message; return 1 for none."""
    from swarm.bus import Tap
    from swarm.cli.look.rates import KeyTraffic, format_dropped_samples

    with Tap(*find_fleet(options, WATCHER), "**") as tap:
        began = monotonic()
        traffic = KeyTraffic(began)
        while (left := began + options.seconds - monotonic()) > 0:
            if (sample := tap.receive(left)) is not None:
                traffic.take(sample)
        now = monotonic()
        for sample in tap.last():
            traffic.keep(sample)
        rows = traffic.rows(now)
    if options.json:
        print(json.dumps([row._asdict() for row in rows], indent=1))
    else:
        print(format_topics(rows, options.seconds))
    if tap.dropped:
        print(format_dropped_samples(tap.dropped), file=sys.stderr)
    return 0 if rows else 1


def format_topics(rows: "list[KeyRow]", lasted: float) -> str:
    """Return the rows as a table, and their sum."""
    if not rows:
        return f"nothing was heard for {lasted:g} s; `swarm ls` tells whether the fleet runs"
    table = [("key", "Hz", "usual", "bytes", "kB/s", "age [s]", "lost", "who")]
    for row in rows:
        usual = "?" if row.usual is None else f"{row.usual:g}" if row.usual else "-"
        size, weight = f"{row.size:.0f}", f"{row.bytes / 1000:.1f}"
        age = "kept" if row.age is None else f"{row.age:.1f}"
        table.append((row.key, f"{row.rate:.1f}", usual, size, weight, age, f"{row.lost}", row.who))
    messages, load = sum(row.rate for row in rows), sum(row.bytes for row in rows) / 1000
    total = f"{len(rows)} keys, {messages:.0f} messages/s, {load:.0f} kB/s in {lasted:g} s; usual: - is on change"
    return f"{align_rows(table, right=range(1, 7))}\n\n{total}"


def add(commands: "Commands[Parser]") -> None:
    """Add this command to the command line."""
    one = commands.add_parser("topics", help="list the keys on which a fleet talks: rate, bytes, losses, who")
    text = "s to listen, 3 by default; a rate is a mean over them"
    one.add_argument("--seconds", type=seconds, default=3.0, metavar="S", help=text)
    one.add_argument("--json", action="store_true")
    add_client_options(one)
    one.set_defaults(command=topics)
