"""Who may do what: certificates, the folder with the keys of a fleet, and the router's access list."""

from swarm.secure.identity import Identity

__all__ = ["Identity"]
