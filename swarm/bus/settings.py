"""The settings of Zenoh sessions: who listens, who connects, how soon a silent session counts as gone."""

import json
import re
import socket
from collections.abc import Sequence
from dataclasses import dataclass, replace
from ipaddress import ip_address
from pathlib import Path
from typing import Any, Final

import zenoh

from swarm.errors import ConfigError
from swarm.secure import Identity
from swarm.secure.names import AUTHORITY, CERTIFICATE, KEY

LEASE: Final = 1.0  # s of silence after which a session is closed; measured: a frozen reader then blocks nobody
LEASE_OF_EACH: Final = 0.025  # s, at least, for each session of one machine: measured with 256 on two cores
# Measured: shared memory limits a router to about 350 sessions.
COMMON: Final[dict[str, Any]] = {
    "scouting/multicast/enabled": False,
    "scouting/gossip/enabled": False,
    "transport/shared_memory/enabled": False,
}
CLIENT: Final = COMMON | {
    "mode": "client",
    "connect/timeout_ms": 10_000,
    "connect/retry": {"period_init_ms": 50, "period_max_ms": 500, "period_increase_factor": 1.5},
}
ROUTER: Final = COMMON | {
    "mode": "router",
    "transport/unicast/max_sessions": 4000,
    "connect/timeout_ms": -1,  # other routers are looked for as long as this one lives
    "connect/exit_on_failure": False,
    "connect/retry": {"period_init_ms": 100, "period_max_ms": 1000, "period_increase_factor": 1.5},
}

PATTERN: Final = re.compile(r"^(tcp|tls)/(\[[0-9a-fA-F:]+\]|[^:/\s]+):(\d{1,5})$")


@dataclass(frozen=True, slots=True)
class Endpoint:
    """The address on which the router listens, ``tcp/HOST:PORT``, or ``tls/HOST:PORT`` for a member with keys."""

    host: str
    port: int
    identity: Identity | None = None  # as whom this process opens or joins the fleet; None: the fleet is open to all
    lease: float = LEASE  # s

    def __str__(self) -> str:
        return f"{'tcp' if self.identity is None else 'tls'}/{self.host}:{self.port}"

    @classmethod
    def parse(cls, text: str, keys: Path | None = None, member: str = "") -> "Endpoint":
        """Read ``tcp/HOST:PORT``; or, for a member of a fleet with keys in a folder, ``tls/HOST:PORT``.

        Raises:
            ConfigError: the text does not have that form.
        """
        match = PATTERN.match(text)
        scheme = "tcp" if keys is None else "tls"
        if not match or not 0 < int(match[3]) < 65536:
            raise ConfigError(
                f"endpoint: expected {scheme}/HOST:PORT, got {text!r}; for example {scheme}/127.0.0.1:7447"
            )
        if match[1] != scheme:
            what = "needs keys: add --secure DIR" if keys is None else "with --secure: begin it with tls/"
            raise ConfigError(f"endpoint: expected {scheme}/HOST:PORT, got {text!r}, which {what}")
        return cls(match[2], int(match[3]), None if keys is None else Identity(keys, member))

    def endpoint_for_member(self, member: str) -> "Endpoint":
        """Return the same endpoint for another member of the fleet."""
        return self if self.identity is None else replace(self, identity=replace(self.identity, name=member))

    def endpoint_for_sessions(self, sessions: int) -> "Endpoint":
        """Return the same endpoint for so many sessions of one machine: many of them are waited for longer."""
        return replace(self, lease=max(LEASE, LEASE_OF_EACH * sessions))

    @property
    def is_local(self) -> bool:
        """True if only this machine can reach it."""
        try:
            return ip_address(self.host.strip("[]")).is_loopback
        except ValueError:
            return self.host == "localhost"

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
            return replace(self, port=probe.getsockname()[1])


def client(endpoint: Endpoint) -> zenoh.Config:
    """Return the settings of a session that connects to the router.

    Raises:
        ConfigError: a file of the member's keys is missing or wrong.
    """
    return _config(CLIENT | {"connect/endpoints": [str(endpoint)]} | _lease(endpoint) | _tls(endpoint, "connect"))


def router(endpoint: Endpoint, others: Sequence[Endpoint] = ()) -> zenoh.Config:
    """Return the settings of the session that is the router; it joins ``others``, however late they come.

    Raises:
        ConfigError: a file of the router's keys is missing or wrong.
    """
    places: dict[str, Any] = {"listen/endpoints": [str(endpoint)], "connect/endpoints": [*map(str, others)]}
    config = _config(ROUTER | places | _lease(endpoint) | _tls(endpoint, "listen", *(("connect",) if others else ())))
    if endpoint.identity is not None:
        try:
            config.insert_json5("access_control", endpoint.identity.access_list())
        except zenoh.ZError as fault:
            raise ConfigError(
                f"{endpoint.identity.folder}: expected the access list that `swarm keys` wrote, Zenoh says: {fault}"
            ) from None
    return config


def _lease(endpoint: Endpoint) -> dict[str, Any]:
    return {"transport/link/tx/lease": round(1000 * endpoint.lease)}  # ms


def _tls(endpoint: Endpoint, *sides: str) -> dict[str, Any]:
    """Return the settings of mutual TLS for sides, ``listen`` or ``connect``; none for an open fleet."""
    identity = endpoint.identity
    if identity is None:
        return {}
    identity.check()
    return {
        "transport/link/tls": {
            "enable_mtls": True,
            "verify_name_on_connect": True,
            "close_link_on_expiration": True,
            "root_ca_certificate": str(identity.folder / AUTHORITY),
            **{f"{side}_certificate": str(identity.folder / CERTIFICATE) for side in sides},
            **{f"{side}_private_key": str(identity.folder / KEY) for side in sides},
        }
    }


def _config(settings: dict[str, Any]) -> zenoh.Config:
    config = zenoh.Config()
    for key, value in settings.items():
        config.insert_json5(key, json.dumps(value))
    return config
