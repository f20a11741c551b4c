"""The channels of one sink: a topic of ROS with its type and qualities, as Foxglove and bags of ROS 2 have them."""

from typing import Final

import foxglove

from swarm.bridge.ros2.topics import RosTopic
from swarm.bridge.ros2.types import Types

# as rosbag2 writes it; `ros2 bag play` needs all fields, and offers latched topics as latched ones
QOS: Final = """\
- history: keep_last
  depth: {depth}
  reliability: {reliability}
  durability: {durability}
  deadline: {never}
  lifespan: {never}
  liveliness: automatic
  liveliness_lease_duration: {never}
  avoid_ros_namespace_conventions: false
"""
NEVER: Final = "{sec: 9223372036, nsec: 854775807}"


def format_qos(topic: RosTopic) -> str:
    """Return a topic's qualities of service as the metadata of a bag has them."""
    reliability, durability, history, *_ = topic.qos.split(":")
    return QOS.format(
        depth=history.split(",")[-1], never=NEVER,
        reliability="best_effort" if reliability == "2" else "reliable",
        durability="transient_local" if durability == "1" else "volatile",
    )  # fmt: skip


class Channels:
    """The channels of one sink."""

    def __init__(self, ros: Types, context: foxglove.Context) -> None:
        self._ros, self._context = ros, context
        self._channels: dict[str, foxglove.Channel] = {}
        self._last = 0  # ns

    def offer_topic(self, name: str, topic: RosTopic) -> int:
        """Add a topic; return the number that the sink gives it."""
        text = self._ros.type_definition(topic.type).encode()
        schema = foxglove.Schema(name=topic.type, encoding="ros2msg", data=text)
        about = {"offered_qos_profiles": format_qos(topic), "topic_type_hash": self._ros.type_hash(topic.type)}
        channel = foxglove.Channel(name, message_encoding="cdr", schema=schema, context=self._context, metadata=about)
        self._channels[name] = channel
        return channel.id()

    def withdraw_topic(self, name: str) -> None:
        """Take a topic away."""
        self._channels.pop(name).close()

    def is_topic_wanted(self, name: str) -> bool:
        """Return True if the sink takes what is said on a topic now."""
        return self._channels[name].has_sinks()

    def log_message(self, name: str, payload: bytes, at: int) -> None:
        """Say a message that was sent at a time [ns], or at that of the last one: readers want them in order."""
        self._last = max(self._last, at)
        self._channels[name].base.log(payload, log_time=self._last)

    def reset_time(self) -> None:
        """Let time begin again."""
        self._last = 0
