"""What programs that are not ours read in a bag, and a viewer of Foxglove's protocol."""

import json
import struct
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final, NamedTuple

from mcap.reader import make_reader
from mcap.records import Schema
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader
from websockets.sync.client import connect
from websockets.sync.connection import Connection
from websockets.typing import Subprotocol

PATIENCE: Final = 60.0  # s
PROTOCOL: Final = Subprotocol("foxglove.sdk.v1")


class Line(NamedTuple):
    """A message of a bag, as the library of MCAP and its decoder for ROS 2 read it."""

    topic: str
    at: int  # ns
    type: str
    message: Any


def lines(path: Path) -> list[Line]:
    """Return the messages of a bag."""
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        assert reader.get_header().profile == "ros2"
        return [
            Line(channel.topic, message.log_time, schema.name if schema else "", decoded)
            for schema, channel, message, decoded in reader.iter_decoded_messages()
        ]


def lines_of_both(path: Path) -> list[Line]:
    """Return the messages of a bag, of which rosbags reads as many."""
    found = lines(path)
    with AnyReader([path]) as reader:
        read = Counter(
            connection.topic for connection, _, raw in reader.messages() if reader.deserialize(raw, connection.msgtype)
        )
    assert read == Counter(line.topic for line in found)
    return found


def is_closed(path: Path) -> bool:
    """Return True if a bag has an index and statistics."""
    with path.open("rb") as file:
        return make_reader(file).get_summary() is not None


class Viewer:
    """A viewer: it wants all topics, or those that are named."""

    def __init__(self, socket: Connection, *topics: str) -> None:
        self._socket, self._topics = socket, topics
        self._decoders = DecoderFactory()
        self.channels: dict[str, Any] = {}  # by topic
        self.statuses: list[str] = []
        self._wanted: dict[int, tuple[str, Any]] = {}  # by subscription: the topic, how it is decoded

    def messages(self) -> Iterator[tuple[str, Any]]:
        """Yield the topic and the message of all that comes; a topic "" has what the server tells."""
        while True:
            yield from self.next(PATIENCE)

    def next(self, patience: float) -> Iterator[tuple[str, Any]]:
        """Yield the next thing that comes, as ``messages`` does; none if it tells nothing.

        Raises:
            TimeoutError: nothing came within ``patience`` [s].
        """
        if (came := self._socket.recv(timeout=patience)) is not None:
            if isinstance(came, str):
                said = json.loads(came)
                if said["op"] == "advertise":
                    self._subscribe(said["channels"])
                if said["op"] == "unadvertise":
                    self.channels = {
                        name: one for name, one in self.channels.items() if one["id"] not in said["channelIds"]
                    }
                yield "", said
            elif came[0] == 1:
                (number,) = struct.unpack("<I", came[1:5])
                topic, decode = self._wanted[number]
                yield topic, decode(came[13:])

    def until(self, topic: str) -> Any:  # noqa: ANN401
        """Return the next message of a topic."""
        return next(message for name, message in self.messages() if name == topic)

    def until_told(self, part: str) -> str:
        """Return the next sentence of the server that has a part."""
        return next(
            str(said["message"]) for name, said in self.messages()
            if not name and said["op"] == "status" and part in said["message"]
        )  # fmt: skip

    def publish(self, topic: str, encoding: str, payload: bytes, number: int = 1) -> None:
        """Publish as the viewer's 3D panel does."""
        about = {"id": number, "topic": topic, "encoding": encoding, "schemaName": "geometry_msgs/msg/PoseStamped"}
        self._socket.send(json.dumps({"op": "advertise", "channels": [about]}))
        self._socket.send(b"\x01" + struct.pack("<I", number) + payload)
        self._socket.send(json.dumps({"op": "unadvertise", "channelIds": [number]}))

    def send(self, message: str | bytes) -> None:
        """Send anything."""
        self._socket.send(message)

    def _subscribe(self, channels: list[dict[str, Any]]) -> None:
        asked = []
        for one in channels:
            self.channels[one["topic"]] = one
            if not self._topics or one["topic"] in self._topics:
                schema = Schema(one["id"], data=one["schema"].encode(), encoding="ros2msg", name=one["schemaName"])
                self._wanted[one["id"]] = one["topic"], self._decoders.decoder_for("cdr", schema)
                asked.append({"id": one["id"], "channelId": one["id"]})
        if asked:
            self._socket.send(json.dumps({"op": "subscribe", "subscriptions": asked}))


@contextmanager
def viewer(url: str, *topics: str) -> Iterator[Viewer]:
    """Connect a viewer."""
    with connect(url, subprotocols=[PROTOCOL], max_size=None, ping_interval=None, close_timeout=1.0) as socket:
        assert socket.subprotocol == PROTOCOL
        yield Viewer(socket, *topics)


def pose(x: float, y: float, frame: str = "map") -> bytes:
    """Return what a click on the floor publishes."""
    place = {"position": {"x": x, "y": y, "z": 0}, "orientation": {"x": 0, "y": 0, "z": 0, "w": 1}}
    return json.dumps({"header": {"stamp": {"sec": 0, "nsec": 0}, "frame_id": frame}, "pose": place}).encode()
