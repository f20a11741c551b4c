"""The command `swarm hz`: how often messages come on a key, and how evenly."""

import argparse
import json
import sys
from time import monotonic

from swarm.cli.argument_parser import Commands, Parser, seconds
from swarm.cli.fleet_lookup import add_client_options, find_fleet, key_options
from swarm.secure.names import WATCHER

TELL_EVERY = 1.0  # s


def hz(options: argparse.Namespace) -> int:
    """Print the rate each second and at the end of --seconds, or until Ctrl-C; return 1 if it was never known."""
    from swarm.bus import Tap
    from swarm.cli.look.rates import Beat, format_dropped_samples
    from swarm.stop_signal import stop_flag

    options = key_options(options)
    beat, known = Beat(), False
    with stop_flag() as stop, Tap(*find_fleet(options, WATCHER), options.key) as tap:
        told = monotonic()
        end = told + options.seconds
        while not stop.is_set() and told < end:
            due = min(told + TELL_EVERY, end)
            if (sample := tap.receive(due - monotonic())) is not None:
                beat.take(sample)
            if (now := monotonic()) < due:
                continue
            told = now
            if (pace := beat.pace()) is None:
                text = "fewer than two messages so far; `swarm topics` lists the keys in use"
                print(f"{options.key}: {text}", file=sys.stderr, flush=True)
                continue
            known = True
            if options.json:
                print(json.dumps(pace._asdict()), flush=True)
                continue
            print(
                f"{pace.rate:7.2f} Hz  {pace.bytes / 1000:6.1f} kB/s  gap {pace.gap_min * 1000:.0f} to "
                f"{pace.gap_max * 1000:.0f} ms, deviation {pace.gap_deviation * 1000:.1f} ms, {pace.lost} lost  "
                f"(of {pace.messages})",
                flush=True,
            )
    if tap.dropped:
        print(format_dropped_samples(tap.dropped), file=sys.stderr)
    return 0 if known else 1


def add(commands: "Commands[Parser]") -> None:
    """Add this command to the command line."""
    one = commands.add_parser("hz", help="print how often messages come on a key, and how evenly")
    one.add_argument("key", metavar="KEY", help="such as robot/r1/sense; * and ** stand for parts of it")
    text = "s until it ends; by default it goes on until Ctrl-C"
    one.add_argument("--seconds", type=seconds, default=float("inf"), metavar="S", help=text)
    one.add_argument("--json", action="store_true", help="an object per line")
    add_client_options(one)
    one.set_defaults(command=hz)
