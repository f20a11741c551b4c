"""One connection to a broker of MQTT 3.1.1, with a last will. Nothing else in this project imports paho.

Each connection has a thread of paho's, which connects again for as long as it takes. Its callbacks only put what
happens into the inbox that all connections share.
"""

import ssl
from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path
from queue import Empty, SimpleQueue
from time import monotonic
from typing import Any, Final, NamedTuple

import paho.mqtt.client as paho
from paho.mqtt.enums import CallbackAPIVersion

from swarm.errors import ConfigError

KEEP_ALIVE: Final = 15  # s, as section 6.2 of VDA 5050 recommends
PATIENCE: Final = 5.0  # s, for a connection
FAREWELL: Final = 2.0  # s, for the last words of all
AGAIN: Final = (1, 8)  # s, between two tries to connect, at first and at most
MOST: Final = 2000  # items that wait in the inbox; then messages are dropped and counted


class ConnectionUp(NamedTuple):
    """A connection is there, or there again."""

    name: str


class ConnectionDown(NamedTuple):
    """A connection is not there: it was refused, or is gone."""

    name: str
    why: str


class MqttMessage(NamedTuple):
    """A message has come on a connection."""

    name: str
    topic: str
    payload: bytes


class Broker(NamedTuple):
    """Where a broker is, and who we are there."""

    host: str
    port: int
    user: str | None = None
    password: str | None = None
    tls: ssl.SSLContext | None = None

    def __str__(self) -> str:
        """Return its place."""
        return f"{self.host}:{self.port}"


class MqttInbox:
    """What has happened on all connections, in order."""

    def __init__(self) -> None:
        self._queue: SimpleQueue[ConnectionUp | ConnectionDown | MqttMessage] = SimpleQueue()
        self._overflowed = 0

    def add_item(self, item: ConnectionUp | ConnectionDown | MqttMessage) -> None:
        """Add an item; drop and count a message if too many items wait. Any thread may call it."""
        if isinstance(item, MqttMessage) and self._queue.qsize() >= MOST:
            self._overflowed += 1
        else:
            self._queue.put(item)

    def take_items(self) -> list[ConnectionUp | ConnectionDown | MqttMessage]:
        """Return what has come since the last call."""
        found: list[ConnectionUp | ConnectionDown | MqttMessage] = []
        with suppress(Empty):
            while len(found) < MOST:
                found.append(self._queue.get_nowait())
        return found

    def count_dropped(self) -> int:
        """Return how many items were dropped since the last call."""
        count, self._overflowed = self._overflowed, 0
        return count


def build_tls_context(authority: Path | None, certificate: Path | None, key: Path | None) -> ssl.SSLContext:
    """Return the settings of TLS: whom we trust (None: whom this machine trusts), and who we are.

    Raises:
        ConfigError: one of the files is missing, or is not what it should be.
    """
    try:
        made = ssl.create_default_context(cafile=authority)
    except (OSError, ssl.SSLError) as fault:
        raise ConfigError(f"--tls-ca {authority}: expected certificates in PEM, got: {_format_error(fault)}") from None
    if certificate is not None:
        try:
            made.load_cert_chain(certificate, key, password="")
        except (OSError, ssl.SSLError) as fault:
            what = f"--tls-cert {certificate} --tls-key {key}"
            raise ConfigError(
                f"{what}: expected a certificate and its key in PEM, without a passphrase, got: {_format_error(fault)}"
            ) from None
    return made


class MqttConnection:
    """One connection, made in the background; ``end`` closes it."""

    def __init__(
        self,
        broker: Broker,
        name: str,
        inbox: MqttInbox,
        hears: tuple[str, ...] = (),
        will: tuple[str, bytes] | None = None,
    ) -> None:
        self._name, self._inbox, self._hears = name, inbox, hears
        self._client = _make_client(broker)
        self._client.reconnect_delay_set(*AGAIN)
        if will is not None:
            self._client.will_set(*will, qos=1, retain=True)
        self._client.on_connect = self._on_connect
        self._client.on_connect_fail = self._on_connect_fail
        self._client.on_disconnect = self._on_disconnect
        self._client.on_message = self._on_message
        self._client.connect_async(broker.host, broker.port, KEEP_ALIVE)
        self._client.loop_start()

    def publish_message(self, topic: str, payload: bytes, *, sure: bool = False, kept: bool = False) -> None:
        """Publish a message: at most once, or at least once if it must be ``sure``; the broker keeps it if asked."""
        self._client.publish(topic, payload, qos=1 if sure else 0, retain=kept)

    def publish_farewell(self, topic: str, payload: bytes) -> Callable[[float], None]:
        """Say a last message that the broker keeps; return what waits so long [s] until it is said."""
        last = self._client.publish(topic, payload, qos=1, retain=True)

        def wait(patience: float) -> None:
            with suppress(ValueError, RuntimeError):  # nobody is connected
                last.wait_for_publish(patience)

        return wait

    def disconnect(self) -> None:
        """Begin to close the connection, as a client should: the broker does not publish the will."""
        self._client.disconnect()

    def join(self) -> None:
        """Wait until the connection is closed."""
        self._client.loop_stop()

    def _on_connect(self, client: paho.Client, _: Any, __: Any, code: Any, ___: Any) -> None:  # noqa: ANN401, paho's
        if code.is_failure:
            self._inbox.add_item(ConnectionDown(self._name, f"refused: {code}"))
            return
        for topic in self._hears:
            client.subscribe(topic, 0)
        self._inbox.add_item(ConnectionUp(self._name))

    def _on_connect_fail(self, *_: object) -> None:
        self._inbox.add_item(ConnectionDown(self._name, "no connection"))

    def _on_disconnect(self, _: Any, __: Any, ___: Any, code: Any, ____: Any) -> None:  # noqa: ANN401, paho's
        self._inbox.add_item(ConnectionDown(self._name, str(code)))

    def _on_message(self, _: Any, __: Any, message: paho.MQTTMessage) -> None:  # noqa: ANN401, paho's
        self._inbox.add_item(MqttMessage(self._name, message.topic, bytes(message.payload)))


def close_connections(farewells: Iterable[tuple[MqttConnection, str, bytes]]) -> None:
    """Say a last message on each connection (topic, payload), and close all; no broker that is stuck is waited for."""
    said = [(line, line.publish_farewell(topic, payload)) for line, topic, payload in farewells]
    until = monotonic() + FAREWELL
    for _, wait in said:
        wait(max(0.0, until - monotonic()))
    for line, _ in said:
        line.disconnect()
    for line, _ in said:
        line.join()


def check_broker(broker: Broker) -> None:
    """Connect once, and close again.

    Raises:
        ConfigError: there is no broker, it cannot be trusted, or it refuses us.
    """
    client = _make_client(broker)
    told: SimpleQueue[Any] = SimpleQueue()
    client.on_connect = lambda _, __, ___, code, ____: told.put(code)
    client.on_disconnect = lambda _, __, ___, code, ____: told.put(code)
    expected = f"--broker {broker}: expected a broker of MQTT"
    try:
        client.connect(broker.host, broker.port, KEEP_ALIVE)
    except (OSError, ValueError) as fault:  # ssl.SSLError is an OSError
        advice = "see --tls-ca" if isinstance(fault, ssl.SSLError) else "start it, or name another one"
        raise ConfigError(f"{expected}, got: {_format_error(fault)}; {advice}") from None
    client.loop_start()
    try:
        code = told.get(timeout=PATIENCE)
    except Empty:
        raise ConfigError(
            f"{expected}, got no answer within {PATIENCE:g} s; is it one, and with TLS or without?"
        ) from None
    finally:
        client.disconnect()
        client.loop_stop()
    if code.is_failure:
        raise ConfigError(f"{expected} that lets us in, got: {code}; see --user, --password-file and --tls-ca")


def _make_client(broker: Broker) -> paho.Client:
    client = paho.Client(CallbackAPIVersion.VERSION2)
    client.connect_timeout = PATIENCE
    if broker.user is not None:
        client.username_pw_set(broker.user, broker.password)
    if broker.tls is not None:
        client.tls_set_context(broker.tls)
    return client


def _format_error(fault: Exception) -> str:
    """Return what went wrong, without numbers of system calls and of lines in C."""
    if isinstance(fault, ssl.SSLCertVerificationError):
        return fault.verify_message
    if isinstance(fault, ssl.SSLError):
        return (fault.reason or str(fault)).replace("_", " ").lower()
    return (fault.strerror if isinstance(fault, OSError) else None) or str(fault)
