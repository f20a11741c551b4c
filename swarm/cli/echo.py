"""The command `swarm echo`: the messages on a key, decoded and checked as every receiver does."""

import argparse
import json
import sys
from typing import TYPE_CHECKING, Any, Final, cast

from swarm.cli.finding import of_a_client, place
from swarm.cli.parsing import Commands, Parser
from swarm.secure.identity import WATCHER

if TYPE_CHECKING:
    from swarm.bus import Arrival, Sample

WIDTH: Final = 80  # columns; longer values are cut, --json has them whole


def echo(options: argparse.Namespace) -> int:
    """Print every message on a key until Ctrl-C, or the first good one; return 1 if none came before the end."""
    from swarm.bus import Tap
    from swarm.errors import PeerError
    from swarm.stopping import told_to_stop

    come = False
    with told_to_stop() as stop, Tap(*place(options, WATCHER), options.key) as tap:
        while not stop.is_set() and not (options.once and come):
            if (sample := tap.receive(0.2)) is None:
                continue
            try:
                fields = read(sample)
            except PeerError as fault:
                said = str(fault).removeprefix(f"{sample.key}: ")  # some faults begin with the key
                print(f"{sample.key}: {said}", file=sys.stderr, flush=True)
                continue
            come = True
            print(json.dumps({"key": sample.key, "message": fields}) if options.json else text(sample, fields))
            sys.stdout.flush()
    return 0 if come else 1


def read(sample: "Sample") -> dict[str, Any]:
    """Return the fields of a message as values of JSON.

    Raises:
        PeerError: its key is in no row of the table of topics, or a receiver would refuse it.
    """
    import msgspec

    from swarm.bus.opening import opened
    from swarm.cli.rates import topic_of
    from swarm.errors import PeerError

    topic = topic_of(sample.key)
    if topic is None:
        raise PeerError(
            f"expected a key of the table of topics, got {len(sample.payload)} bytes on this one; "
            "`swarm schema` lists the messages"
        )
    arrived = cast("Arrival", opened("", ("sample", topic, sample.key, sample.payload)))
    fields: dict[str, Any] = msgspec.to_builtins(arrived.message)
    return fields


def text(sample: "Sample", fields: dict[str, Any]) -> str:
    """Return a message as lines for people: the key, then a line for each field, cut to the width of a terminal."""
    lines = [f"{sample.key}  {len(sample.payload)} bytes"]
    for name, value in fields.items():
        line = f"  {name}: {value if isinstance(value, str) else json.dumps(value)}".replace("\n", " ")
        lines.append(line if len(line) <= WIDTH else f"{line[: WIDTH - 4]} ...")
    return "\n".join(lines)


def add(commands: "Commands[Parser]") -> None:
    """Add this command to the command line."""
    one = commands.add_parser("echo", help="print the messages on a key")
    one.add_argument("key", metavar="KEY", help="such as robot/r1/state; * and ** stand for parts of it")
    one.add_argument("--once", action="store_true", help="end after the first message")
    one.add_argument("--json", action="store_true", help="an object per line, whole")
    of_a_client(one)
    one.set_defaults(command=echo)
