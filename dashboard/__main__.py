"""One dashboard of a fleet: ``python -m dashboard --connect tcp/HOST:PORT --fleet NAME [--web | --viewer]``."""

import argparse
import os
import sys
from functools import partial
from pathlib import Path
from secrets import token_urlsafe

from dashboard.mode import BOX, LOOPBACK, TOKEN, choose
from dashboard.viewers import end_with_process
from swarm.errors import SwarmError
from swarm.installation import hint_for_extra


def main(arguments: list[str] | None = None) -> int:
    """Run the dashboard and return the exit status; 2 if the command line is wrong or the machine lacks something."""
    parser = argparse.ArgumentParser(prog="python -m dashboard", description="See a fleet in Rerun, or in the box.")
    parser.add_argument("--connect", required=True, metavar="tcp/HOST:PORT", help="where the fleet's router listens")
    parser.add_argument("--fleet", required=True, metavar="NAME")
    parser.add_argument("--secure", type=Path, metavar="DIR", help="folder with the keys of this fleet (`swarm keys`)")
    shown = parser.add_mutually_exclusive_group()
    shown.add_argument("--web", dest="asked", action="store_const", const="web", help="serve the web viewer")
    shown.add_argument("--viewer", dest="asked", action="store_const", const="viewer", help="open the native viewer")
    shown.add_argument("--box", dest="asked", action="store_const", const=BOX, help="serve the box, without Rerun")
    shown.add_argument("--off-screen", dest="asked", action="store_const", const="off", help="only record")
    parser.add_argument("--record", type=Path, metavar="FILE.rrd")
    text = "0.0.0.0: viewers on other machines too; of the box, only those that a published port leads to"
    parser.add_argument("--bind", default=LOOPBACK, metavar="HOST", help=text)
    parser.add_argument("--port", type=int, default=0, help="port of the data; 0 picks a free one")
    parser.add_argument("--web-port", type=int, default=0, help="port of the page; 0 picks a free one")
    parser.add_argument("--rules", metavar="ROBOT", help="robot whose fired rules are shown; by default the first")
    parser.add_argument("--ends-with", type=int, metavar="PID", help="the process that started this one: end with it")
    given = parser.parse_args(arguments)
    if given.ends_with is not None and not end_with_process(given.ends_with):
        return 0
    if given.asked == BOX:
        for option, value in (("--record", given.record), ("--rules", given.rules), ("--port", given.port)):
            if value:
                parser.error(f"{option}: expected it without --box, which needs no Rerun")
        return serve_box(given)
    if lacking := hint_for_extra("rerun"):
        print(lacking, file=sys.stderr)
        return 2
    from dashboard import process
    from swarm.bus import Endpoint
    from swarm.secure.names import WATCHER

    try:
        mode = choose(given.asked or "auto", os.environ, record=given.record is not None)
        return process.run(
            Endpoint.parse(given.connect, given.secure, WATCHER),
            given.fleet,
            mode or "off-screen",
            given.record,
            bind=given.bind,
            grpc_port=given.port,
            web_port=given.web_port,
            rules=given.rules,
        )
    except SwarmError as fault:
        print(fault, file=sys.stderr)
        return 2


def serve_box(given: argparse.Namespace) -> int:
    """Serve the box of a fleet until told to stop, and return the exit status."""
    from dashboard.box.process import run
    from swarm.bus import Endpoint
    from swarm.secure.names import OPERATOR

    try:
        endpoint = Endpoint.parse(given.connect, given.secure, OPERATOR)
        port = given.web_port or Endpoint(given.bind, 0).claim().port
        token = token_urlsafe(TOKEN)
        if given.bind != LOOPBACK:
            warning = "whoever reaches it and has the token can steer; the token is not encrypted on its way"
            print(f"box: bound to {given.bind}: {warning}", file=sys.stderr, flush=True)
        return run(endpoint, given.fleet, port, token, bind=given.bind, log=partial(print, flush=True))
    except SwarmError as fault:
        print(fault, file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
