"""The embedded router: a Zenoh session in router mode."""

from collections.abc import Callable, Sequence
from typing import Final

import zenoh

from swarm.bus import settings
from swarm.bus.connecting import plain
from swarm.errors import ConfigError
from swarm.heartbeat import Heartbeat
from swarm.stopping import told_to_stop

LOOK: Final = 0.5  # s between two looks whether to stop: a signal that one of Zenoh's threads gets wakes no wait


def serve(endpoint: settings.Endpoint, others: Sequence[settings.Endpoint] = ()) -> int:
    """Run the router until this process is told to stop; ``others`` are routers that it joins."""
    with told_to_stop() as stop:
        heart = Heartbeat()

        def wait() -> None:
            while not stop.wait(LOOK):
                heart.beat()

        run(endpoint, wait, others)
    return 0


def run(endpoint: settings.Endpoint, wait: Callable[[], object], others: Sequence[settings.Endpoint] = ()) -> None:
    """Route until ``wait`` returns; ``others`` are routers that this one joins as soon as they answer.

    Raises:
        ConfigError: the router cannot listen on the endpoint.
    """
    try:
        session = zenoh.open(settings.router(endpoint, others))
    except zenoh.ZError as fault:
        raise ConfigError(
            f"router: expected to listen on {endpoint}, got: {plain(str(fault))}; is the port in use?"
        ) from None
    with session:
        wait()
