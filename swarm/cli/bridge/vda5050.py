"""The command `swarm bridge vda5050`: a running fleet as vehicles for a master control."""

import argparse
import re
from pathlib import Path
from typing import Final

from swarm.cli.argument_parser import Commands, Parser
from swarm.cli.fleet_lookup import add_client_options, find_fleet
from swarm.errors import ConfigError
from swarm.installation import hint_for_extra
from swarm.secure.names import BRIDGE

BROKER: Final = "127.0.0.1:1883"
PORTS: Final = range(1, 65536)
INTERFACE, MANUFACTURER, MAP_ID = "uagv", "zenoh-swarm", "map"
NAME: Final = re.compile(r"[A-Za-z0-9_.:-]{1,64}")  # what VDA 5050 allows in a serialNumber
MOST_PASSWORD: Final = 65_535  # bytes, of MQTT
RATES: Final = (1.0, 5.0)  # Hz


def bridge(options: argparse.Namespace) -> int:
    """Show a fleet to master controls until its run is over or we are told to stop."""
    if (lacks := hint_for_extra("vda5050")) is not None:
        raise ConfigError(f"bridge vda5050: {lacks}")
    from swarm.bridge.vda5050.line import Broker, build_tls_context
    from swarm.bridge.vda5050.process import VehicleNames, run

    if (options.tls_cert is None) != (options.tls_key is None):
        raise ConfigError("--tls-cert and --tls-key: expected both or none, got one; give the other one too")
    if options.password_file is not None and options.user is None:
        raise ConfigError("--password-file: expected --user NAME too, got none; say whose password it is")
    files = options.tls_ca, options.tls_cert, options.tls_key
    tls = build_tls_context(*files) if options.tls or any(files) else None
    password = None if options.password_file is None else read_password(options.password_file)
    host, port = options.broker
    names = VehicleNames(options.interface, options.manufacturer, options.map_id)
    every = None if options.visualization is None else 1 / options.visualization
    return run(*find_fleet(options, BRIDGE), Broker(host, port, options.user, password, tls), names, every)


def broker(text: str) -> tuple[str, int]:
    """Read where a broker is.

    Raises:
        ConfigError: the text is no ``HOST:PORT``.
    """
    host, _, port = text.rpartition(":")
    if not host or not port.isdecimal() or int(port) not in PORTS:
        raise ConfigError(f"--broker: expected HOST:PORT, got {text!r}; for example {BROKER}")
    return host.strip("[]"), int(port)


def name(text: str) -> str:
    """Read a part of a topic.

    Raises:
        ConfigError: it has characters that VDA 5050 does not allow.
    """
    if not NAME.fullmatch(text):
        raise ConfigError(f"expected 1 to 64 letters, digits or _ . : -, got {text!r}; choose another name")
    return text


def rate(text: str) -> float:
    """Read how often vehicles tell where they are [Hz].

    Raises:
        ConfigError: it is out of the standard's use.
    """
    low, high = RATES
    try:
        found = float(text)
    except ValueError:
        found = 0.0
    if not low <= found <= high:
        raise ConfigError(f"--visualization: expected {low:g} to {high:g} Hz, got {text!r}")
    return found


def read_password(file: Path) -> str:
    """Return the first line of a file: it is not on the command line, where all users of a machine can read it.

    Raises:
        ConfigError: it cannot be read, or has none.
    """
    try:
        with file.open(encoding="utf-8") as opened:
            first = opened.readline(MOST_PASSWORD).rstrip("\r\n")
    except (OSError, UnicodeDecodeError) as fault:
        why = fault.strerror if isinstance(fault, OSError) else "it is no text"
        raise ConfigError(f"--password-file {file}: expected a file with a password, got: {why}") from None
    if not first:
        raise ConfigError(f"--password-file {file}: expected a password in its first line, got none")
    return first


def add(commands: "Commands[Parser]") -> None:
    """Add this command below `swarm bridge`."""
    said = "show a running fleet to master controls as vehicles of VDA 5050, and take orders from them"
    one = commands.add_parser("vda5050", help=said, description=f"{said}; see docs/vda5050.md")
    add_client_options(one)
    text = f"broker of MQTT; {BROKER} by default"
    one.add_argument("--broker", type=broker, default=broker(BROKER), metavar="HOST:PORT", help=text)
    one.add_argument("--user", metavar="NAME", help="who we are for the broker")
    one.add_argument("--password-file", type=Path, metavar="FILE", help="its first line is the password")
    one.add_argument("--tls", action="store_true", help="TLS with a broker whom this machine trusts")
    one.add_argument("--tls-ca", type=Path, metavar="FILE", help="TLS with a broker whom these certificates vouch for")
    one.add_argument("--tls-cert", type=Path, metavar="FILE", help="TLS with this certificate of ours")
    one.add_argument("--tls-key", type=Path, metavar="FILE", help="its key, without a passphrase")
    text = f"first part of the topics; {INTERFACE} by default"
    one.add_argument("--interface", type=name, default=INTERFACE, metavar="NAME", help=text)
    text = f"manufacturer of the vehicles; {MANUFACTURER} by default"
    one.add_argument("--manufacturer", type=name, default=MANUFACTURER, metavar="NAME", help=text)
    one.add_argument("--map-id", type=name, default=MAP_ID, metavar="NAME", help=f"of the floor; {MAP_ID} by default")
    text = "tell positions on the topic visualization too, so often: 1 to 5"
    one.add_argument("--visualization", type=rate, metavar="HZ", help=text)
    one.set_defaults(command=bridge)
