"""Which fleet a command means: the one on this machine, or one on the router of --connect."""

import argparse
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from swarm.cli.argument_parser import Parser, endpoint, secure
from swarm.errors import ConfigError
from swarm.messages.topic import key_prefix_of
from swarm.secure.names import OPERATOR

if TYPE_CHECKING:
    from swarm.bus import Bus, Endpoint
    from swarm.messages import Message, Topic

LOOK_EVERY: Final = 0.5  # s between two looks for a world


class FleetPlace(NamedTuple):
    """Where a fleet is: its router, as whom this process joins it, and its name."""

    endpoint: "Endpoint"
    fleet: str


def find_fleet(options: argparse.Namespace, member: str) -> FleetPlace:
    """Return the fleet of --fleet, or the only one there is; --connect says on which router, else on this machine.

    Raises:
        ConfigError: the endpoint is wrong; there is no such fleet, or there are several and none is named.
    """
    from swarm.bus import fleets
    from swarm.launch.fleet_registry import find, select_fleet

    if options.connect is None:
        card = find(options.fleet)
        return FleetPlace(endpoint(card.endpoint, options.secure, member), card.fleet)
    router = endpoint(options.connect, options.secure, member)
    return FleetPlace(router, select_fleet(options.fleet, fleets(router), f"on {router}"))


def find_tape(options: argparse.Namespace, fleet: str) -> str | None:
    """Return the file of a fleet's tape if this user has started it on this machine, else None: nobody knows it."""
    from swarm.launch.fleet_registry import cards

    known = {card.fleet: card.tape for card in cards()} if options.connect is None else {}
    return known.get(fleet)


def fleet_bus(options: argparse.Namespace, member: str) -> "Bus":
    """Return a member's bus of the fleet that the options mean.

    Raises:
        ConfigError: the endpoint is wrong; there is no such fleet, or there are several and none is named.
    """
    from swarm.bus import Bus

    return Bus(*find_fleet(options, member))


def send_request(options: argparse.Namespace, topic: "Topic[Any]", request: "Message", robot: str = "") -> int:
    """Send an operator's request to the fleet that the options mean, print the answer, and return 0.

    ``robot`` is the one that the topic's key names, "" if it names none.

    Raises:
        ConfigError: as ``fleet_bus``.
        PeerError: the request is refused.
    """
    with fleet_bus(options, OPERATOR) as bus:
        print(bus.ask(topic, request, robot=robot).text)
    return 0


def key_options(options: argparse.Namespace) -> argparse.Namespace:
    """Return the options with the key below the fleet's: one that is spelled in full names its fleet too.

    Raises:
        ConfigError: --fleet names another one.

    >>> said = key_options(argparse.Namespace(key="swarm/v1/paper/robot/r1/state", fleet=None))
    >>> said.key, said.fleet
    ('robot/r1/state', 'paper')
    """
    beginning = key_prefix_of("").removesuffix("/")  # of the keys of all fleets
    if not options.key.startswith(beginning):
        return options
    fleet, _, key = options.key.removeprefix(beginning).partition("/")
    if "*" in fleet:  # the one that is found
        fleet = options.fleet
    elif options.fleet not in {None, fleet}:
        raise ConfigError(f"expected a key of fleet {options.fleet!r}, got {options.key!r}; leave out one of the two")
    return argparse.Namespace(**vars(options) | {"fleet": fleet, "key": key})


def await_fleet(router: "Endpoint") -> str | None:
    """Return the only fleet on a router that has a world; wait for one. None: this process is told to stop meanwhile.

    One session asks all the time: a robot that waits costs the router no new session at each look.

    Raises:
        ConfigError: no router answers, or there are several fleets.
    """
    from swarm.bus import connect, names_on
    from swarm.launch.fleet_registry import select_fleet
    from swarm.stop_signal import stop_flag

    with stop_flag() as stop, connect(router) as session:
        while not stop.is_set():
            if names := names_on(session, "world"):
                name = select_fleet(None, names, f"on {router}")
                print(f"fleet {name}", flush=True)
                return name
            stop.wait(LOOK_EVERY)
    return None


def add_client_options(parser: Parser) -> None:
    """Add the options that choose a fleet."""
    parser.add_argument("--connect", metavar="ENDPOINT", help="the fleet's router; by default that on this machine")
    parser.add_argument("--fleet", metavar="NAME", help="by default the only one there is")
    secure(parser)
