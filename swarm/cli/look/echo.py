"""The command `swarm echo`: the messages on a key, decoded and checked as every receiver does."""

import argparse
import json
import sys
from collections import deque
from contextlib import suppress
from time import monotonic
from typing import TYPE_CHECKING, Any, Final, cast

from swarm.cli.argument_parser import Commands, Parser
from swarm.cli.fleet_lookup import add_client_options, find_fleet, key_options
from swarm.secure.names import WATCHER

if TYPE_CHECKING:
    from swarm.bus import Arrival, Sample, Tap
    from swarm.messages import Message

LOOK: Final = 0.2  # s between two looks whether we are told to stop
SOON: Final = 1.5  # s without a message after which it is said why; to ask the fleet takes a moment too
WIDTH: Final = 80  # columns; longer values are cut, --json has them whole


def echo(options: argparse.Namespace) -> int:
    """Print the last message that is kept under a key, and every message on it until Ctrl-C.

    With --once it ends after the first good one. While nothing comes it says why. Return 1 if none came before the end.
    """
    from swarm.bus import Tap
    from swarm.stop_signal import stop_flag

    options = key_options(options)
    good = heard = told = False
    with stop_flag() as stop, Tap(*find_fleet(options, WATCHER), options.key) as tap:
        began, kept = monotonic(), deque(tap.last())  # after the tap is open: what is sent meanwhile is not missed
        while not stop.is_set() and not (options.once and good):
            if (sample := kept.popleft() if kept else tap.receive(LOOK)) is not None:
                heard, good = True, show(sample, as_json=options.json) or good
            elif not heard and not told and monotonic() - began > SOON:
                told = True
                print(f"{options.key}: {explain_silence(tap, options.key)}", file=sys.stderr, flush=True)
    return 0 if good else 1


def show(sample: "Sample", *, as_json: bool) -> bool:
    """Print a message and return True; if a receiver would refuse it, say so and return False."""
    import msgspec

    from swarm.errors import PeerError

    try:
        fields = msgspec.to_builtins(read(sample))
    except PeerError as fault:
        said = str(fault).removeprefix(f"{sample.key}: ")  # some faults begin with the key
        print(f"{sample.key}: {said}", file=sys.stderr, flush=True)
        return False
    print(json.dumps({"key": sample.key, "message": fields}) if as_json else format_message(sample, fields), flush=True)
    return True


def explain_silence(tap: "Tap", key: str) -> str:
    """Return what to say on a key on which nothing comes."""
    from swarm.cli.look.silence import why
    from swarm.errors import PeerError
    from swarm.messages import CLOCK, Clock

    clock = None
    for sample in tap.last(CLOCK.key):
        with suppress(PeerError):
            clock = cast("Clock", read(sample))
    return f"no message so far (`swarm topics` lists the keys, Ctrl-C ends this): {why(key, clock)}"


def read(sample: "Sample") -> "Message":
    """Return the message of a sample.

    Raises:
        PeerError: its key is in no row of the table of topics, or a receiver would refuse it.
    """
    from swarm.bus.inbox_item import decode_item
    from swarm.cli.look.rates import topic_of
    from swarm.errors import PeerError

    topic = topic_of(sample.key)
    if topic is None:
        raise PeerError(
            f"expected a key of the table of topics, got {len(sample.payload)} bytes on this one; "
            "`swarm schema` lists the messages"
        )
    arrived = cast("Arrival", decode_item("", ("sample", topic, sample.key, sample.payload)))
    message: Message = arrived.message
    return message


def format_message(sample: "Sample", fields: dict[str, Any]) -> str:
    """Return a message as lines for people: the key, then a line for each field, cut to the width of a terminal."""
    lines = [f"{sample.key}  {len(sample.payload)} bytes"]
    for name, value in fields.items():
        line = f"  {name}: {value if isinstance(value, str) else json.dumps(value)}".replace("\n", " ")
        lines.append(line if len(line) <= WIDTH else f"{line[: WIDTH - 4]} ...")
    return "\n".join(lines)


def add(commands: "Commands[Parser]") -> None:
    """Add this command to the command line."""
    one = commands.add_parser("echo", help="print the last message that is kept on a key, and those that come")
    one.add_argument("key", metavar="KEY", help="such as robot/r1/state; * and ** stand for parts of it")
    one.add_argument("--once", action="store_true", help="end after the first message")
    one.add_argument("--json", action="store_true", help="an object per line, whole")
    add_client_options(one)
    one.set_defaults(command=echo)
