"""The command that puts targets into the pool of a running fleet: any robot that is free visits them."""

import argparse
from uuid import uuid4

from swarm.cli.finding import fleet_bus, of_a_client
from swarm.cli.parsing import Commands, Parser, point
from swarm.secure.names import OPERATOR


def pool(options: argparse.Namespace) -> int:
    """Put targets into the pool."""
    from swarm.messages import POOL, PoolTargets

    request = PoolTargets(id=options.id or uuid4().hex, targets=options.targets)
    with fleet_bus(options, OPERATOR) as bus:
        print(bus.ask(POOL, request).text)
    return 0


def add(commands: "Commands[Parser]") -> None:
    """Add the command to the command line."""
    one = commands.add_parser("pool", help="give a running fleet targets that any free robot visits")
    one.add_argument("targets", type=point, nargs="+", metavar="X,Y", help="m; each is visited once, in any order")
    text = "name of the request, a new one by default; the same request given again changes nothing"
    one.add_argument("--id", metavar="NAME", help=text)
    of_a_client(one)
    one.set_defaults(command=pool)
