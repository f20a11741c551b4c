"""How a process joins a router: the session, the channel of what arrives, and what Zenoh says in words for people."""

import re
from typing import Any, Final

import zenoh

from swarm.bus import settings
from swarm.errors import ConfigError

CHANNEL_LIMIT: Final = 50_000  # arrivals of one key that wait for Python; if there are more, their senders have to wait
SOURCE_LINE: Final = re.compile(r" at \S+\.rs:\d+\.?")  # where in Zenoh's own source an error was raised


def channel() -> "zenoh.handlers.FifoChannel[Any]":
    """Return where Zenoh puts what arrives until a thread of ours takes it."""
    return zenoh.handlers.FifoChannel(CHANNEL_LIMIT)


def connect(endpoint: settings.Endpoint) -> zenoh.Session:
    """Return a session that is connected to the router.

    Raises:
        ConfigError: no router answers, or a file of the member's keys is missing or wrong.
    """
    config = settings.client(endpoint)
    try:
        return zenoh.open(config)
    except zenoh.ZError as fault:
        start = "`swarm router`" + (" with keys of the same `swarm keys`" if endpoint.identity else "")
        raise ConfigError(
            f"endpoint {endpoint}: expected a running router, got: {strip_sources(str(fault))}; start one with {start}"
        ) from None


def strip_sources(text: str) -> str:
    """Return what Zenoh says without the files of its own source.

    >>> strip_sources("Unable to connect to any of [tcp/localhost:1]!  at /home/ci/zenoh/src/orchestrator.rs:170.")
    'Unable to connect to any of [tcp/localhost:1]'
    """
    return SOURCE_LINE.sub("", text).strip().rstrip("!. ")
