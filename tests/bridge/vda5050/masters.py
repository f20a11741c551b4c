"""A program on a broker that hears all that vehicles say, and says what it wants: plain paho and JSON."""

import json
import uuid
from collections import defaultdict, deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from queue import Empty, SimpleQueue
from time import monotonic
from typing import Any, Final, NamedTuple

import paho.mqtt.client as paho
from paho.mqtt.enums import CallbackAPIVersion

from tests.bridge.vda5050.shared import MAKER
from tests.launch.actors import PATIENCE

Message = dict[str, Any]
Fits = Callable[[Message], Any]


class Said(NamedTuple):
    robot: str
    topic: str
    message: Message
    kept: bool  # by the broker, from before we came


class Master:
    """What it hears of a vehicle on a topic waits there until somebody looks at it; ``heard`` has all of it."""

    def __init__(self, client: paho.Client, below: str) -> None:
        self.client, self._below = client, below
        self.queue: SimpleQueue[Said] = SimpleQueue()
        self.heard: list[Said] = []
        self._waiting: defaultdict[tuple[str, str], deque[Said]] = defaultdict(deque)  # that nobody has looked at

    def say(self, robot: str, topic: str, payload: Message | bytes) -> None:
        packed = payload if isinstance(payload, bytes) else json.dumps(payload).encode()
        self.client.publish(f"{self._below}/{robot}/{topic}", packed).wait_for_publish()

    def until(self, robot: str, topic: str, fits: Fits = lambda _: True, kept: bool | None = None) -> Message:
        """Wait for a message of a vehicle that fits."""
        deadline, last, waiting = monotonic() + PATIENCE, None, self._waiting[robot, topic]
        while True:
            while waiting:
                said = waiting.popleft()
                last = said.message
                if kept in {None, said.kept} and fits(last):
                    return last
            try:
                said = self.queue.get(timeout=max(0.0, deadline - monotonic()))
            except Empty:
                raise AssertionError(f"{robot} says no such {topic}; its last one: {last}") from None
            self.heard.append(said)
            self._waiting[said.robot, said.topic].append(said)

    def connection(self, robot: str, state: str) -> Message:
        return self.until(robot, "connection", lambda said: said["connectionState"] == state)

    def error(self, robot: str, part: str) -> str:
        """Wait for an error with such a text; return its type."""
        state = self.until(
            robot, "state", lambda said: [one for one in said["errors"] if part in one["errorDescription"]]
        )
        return next(str(one["errorType"]) for one in state["errors"] if part in one["errorDescription"])


@contextmanager
def master_on(port: int, interface: str = "uagv", maker: str = MAKER) -> Iterator[Master]:
    below: Final = f"{interface}/v2/{maker}"
    client = paho.Client(CallbackAPIVersion.VERSION2, client_id=f"test-{uuid.uuid4().hex}")
    client.reconnect_delay_set(1, 1)
    master = Master(client, below)

    def on_message(_: Any, __: Any, got: paho.MQTTMessage) -> None:  # noqa: ANN401, paho's
        robot, topic = got.topic.removeprefix(f"{below}/").split("/")
        if topic not in {"order", "instantActions"}:
            master.queue.put(Said(robot, topic, json.loads(got.payload), got.retain))

    def on_connect(*_: object) -> None:
        client.subscribe(f"{below}/+/+", 1)

    client.on_message, client.on_connect = on_message, on_connect
    client.connect("127.0.0.1", port)
    client.loop_start()
    try:
        yield master
    finally:
        client.disconnect()
        client.loop_stop()
