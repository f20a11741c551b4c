"""The embedded router: a Zenoh session in router mode."""

from collections.abc import Callable, Sequence
from time import monotonic
from typing import Final

import zenoh

from swarm.bus import settings
from swarm.bus.connection import strip_sources
from swarm.errors import ConfigError
from swarm.heartbeat import Heartbeat
from swarm.stop_signal import stop_flag

LOOK: Final = 0.5  # s between two looks whether to stop: a signal that one of Zenoh's threads gets wakes no wait
PATIENCE: Final = 5.0  # s that routers may be away which this one joins, before that is said


def serve(endpoint: settings.Endpoint, others: Sequence[settings.Endpoint] = ()) -> int:
    """Run the router until this process is told to stop; it prints when links to other routers come and go.

    It joins ``others`` as soon as they answer.

    Raises:
        ConfigError: the router cannot listen on the endpoint.
    """
    heart, links = Heartbeat(), RouterLinks(others, monotonic())
    with stop_flag() as stop, _open_session(endpoint, others) as session:
        while not stop.wait(LOOK):
            heart.beat()
            if (said := links.describe_links(len(session.info.routers_zid()), monotonic())) is not None:
                print(f"router: {said}", flush=True)
    return 0


def run(endpoint: settings.Endpoint, wait: Callable[[], object]) -> None:
    """Route until ``wait`` returns.

    Raises:
        ConfigError: the router cannot listen on the endpoint.
    """
    with _open_session(endpoint):
        wait()


def _open_session(endpoint: settings.Endpoint, others: Sequence[settings.Endpoint] = ()) -> zenoh.Session:
    try:
        return zenoh.open(settings.router(endpoint, others))
    except zenoh.ZError as fault:
        raise ConfigError(
            f"router: expected to listen on {endpoint}, got: {strip_sources(str(fault))}; is the port in use?"
        ) from None


class RouterLinks:
    """What there is to say about a router's links to others, as they come and go."""

    def __init__(self, others: Sequence[settings.Endpoint], now: float) -> None:
        self._others = ", ".join(map(str, others))
        self._joins, self._linked, self._since, self._warned = len(others), 0, now, False

    def describe_links(self, linked: int, now: float) -> str | None:
        """Take in to how many routers there is a link ``now`` [s]; return a sentence if there is something to say."""
        is_linked = f"linked with {linked} other router{'s' * (linked != 1)}"
        if linked != self._linked:
            self._linked, self._since, self._warned = linked, now, False
            return is_linked
        if linked >= self._joins or self._warned or now - self._since < PATIENCE:
            return None
        self._warned = True
        return (
            f"{is_linked} for {PATIENCE:g} s, expected {self._joins} at {self._others}; is each of them running, "
            "reachable from here, and of the same keys? This one goes on trying"
        )
