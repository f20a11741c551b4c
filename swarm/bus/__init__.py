"""The wire: Zenoh sessions and what crosses them. Nothing outside this package imports zenoh."""

from swarm.bus.session import Arrival, Bus, Link, Presence, Request
from swarm.bus.settings import Endpoint

__all__ = ["Arrival", "Bus", "Endpoint", "Link", "Presence", "Request"]
