"""The settings of Zenoh sessions: who listens, who connects, how soon a silent session counts as gone."""

import json
import re
import socket
from dataclasses import dataclass
from typing import Any, Final

import zenoh

from swarm.errors import ConfigError

# Measured: shared memory limits a router to about 350 sessions; with a lease of 1 s a frozen reader blocks nobody.
COMMON: Final[dict[str, Any]] = {
    "scouting/multicast/enabled": False,
    "scouting/gossip/enabled": False,
    "transport/shared_memory/enabled": False,
    "transport/link/tx/lease": 1000,  # ms
}
CLIENT: Final = COMMON | {
    "mode": "client",
    "connect/timeout_ms": 10_000,
    "connect/retry": {"period_init_ms": 50, "period_max_ms": 500, "period_increase_factor": 1.5},
}
ROUTER: Final = COMMON | {"mode": "router", "transport/unicast/max_sessions": 4000}

PATTERN: Final = re.compile(r"^(tcp)/(\[[0-9a-fA-F:]+\]|[^:/\s]+):(\d{1,5})$")


@dataclass(frozen=True, slots=True)
class Endpoint:
    """The address on which the router listens, in Zenoh's form ``tcp/HOST:PORT``."""

    host: str
    port: int

    def __str__(self) -> str:
        return f"tcp/{self.host}:{self.port}"

    @classmethod
    def parse(cls, text: str) -> "Endpoint":
        """Read ``tcp/HOST:PORT``.

        Raises:
            ConfigError: the text does not have that form.
        """
        match = PATTERN.match(text)
        if not match or not 0 < int(match[3]) < 65536:
            raise ConfigError(f"endpoint: expected tcp/HOST:PORT, got {text!r}; for example tcp/127.0.0.1:7447")
        return cls(match[2], int(match[3]))

    def claim(self) -> "Endpoint":
        """Check that the port is free and return the endpoint; port 0 becomes a free port.

        Raises:
            ConfigError: another process listens there, or the host is not this machine.
        """
        family = socket.AF_INET6 if self.host.startswith("[") else socket.AF_INET
        with socket.socket(family) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind((self.host.strip("[]"), self.port))
            except OSError as fault:
                raise ConfigError(
                    f"port {self.port} on {self.host}: expected a free port, got {fault.strerror or fault}; "
                    "stop the process that listens there, or give another port with --port (0 picks a free one)"
                ) from None
            return Endpoint(self.host, probe.getsockname()[1])


def client(endpoint: Endpoint) -> zenoh.Config:
    """Return the settings of a session that connects to the router."""
    return _config(CLIENT | {"connect/endpoints": [str(endpoint)]})


def router(endpoint: Endpoint) -> zenoh.Config:
    """Return the settings of the session that is the router."""
    return _config(ROUTER | {"listen/endpoints": [str(endpoint)]})


def _config(settings: dict[str, Any]) -> zenoh.Config:
    config = zenoh.Config()
    for key, value in settings.items():
        config.insert_json5(key, json.dumps(value))
    return config
