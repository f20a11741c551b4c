"""The router, embedded: a Zenoh session in router mode is one."""

from collections.abc import Callable

import zenoh

from swarm.bus import settings
from swarm.errors import ConfigError
from swarm.stopping import told_to_stop


def serve(endpoint: settings.Endpoint) -> int:
    """Be the router as a process, until told to stop."""
    with told_to_stop() as stop:
        run(endpoint, stop.wait)
    return 0


def run(endpoint: settings.Endpoint, wait: Callable[[], object]) -> None:
    """Route until ``wait`` returns.

    Raises:
        ConfigError: the endpoint cannot be listened on.
    """
    try:
        session = zenoh.open(settings.router(endpoint))
    except zenoh.ZError as fault:
        raise ConfigError(f"router: expected to listen on {endpoint}, got {fault}; is the port in use?") from None
    with session:
        wait()
