"""The wire: Zenoh sessions and the messages that cross them. Nothing outside this package imports zenoh."""

from swarm.bus.arrivals import Arrival, Link, Presence, Request
from swarm.bus.connection import connect
from swarm.bus.session import Bus
from swarm.bus.settings import Endpoint
from swarm.bus.tap import Sample, Tap, fleets, names_on

__all__ = [
    "Arrival",
    "Bus",
    "Endpoint",
    "Link",
    "Presence",
    "Request",
    "Sample",
    "Tap",
    "connect",
    "fleets",
    "names_on",
]
