"""The message types of ROS 2: how to make, serialize (CDR) and hash them, without ROS."""

import struct
from types import MappingProxyType
from typing import Any, Final

from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_typestore

from swarm.bridge.cdr.layouts import CDR_HEADER
from swarm.errors import PeerError

DISTROS: Final = MappingProxyType({"jazzy": Stores.ROS2_JAZZY, "kilted": Stores.ROS2_KILTED})
BROKEN: Final = (SerdeError, struct.error, ValueError, IndexError, AssertionError)  # what rosbags raises for no CDR


class Types:
    """The message types of a ROS distribution; a type is named as in ``nav_msgs/msg/Odometry``."""

    def __init__(self, distro: str) -> None:
        self._store = get_typestore(DISTROS[distro])

    def make(self, name: str, **fields: Any) -> Any:  # noqa: ANN401, rosbags makes the classes when it starts
        """Return a message with all its fields."""
        return self._store.types[name](**fields)

    def serialize(self, name: str, message: Any) -> bytes:  # noqa: ANN401
        """Return a message as CDR."""
        return bytes(self._store.serialize_cdr(message, name))

    def deserialize(self, name: str, payload: bytes) -> Any:  # noqa: ANN401
        """Return the message in a payload from outside.

        Raises:
            PeerError: the payload is no little-endian CDR of that type.
        """
        if payload[:4] != CDR_HEADER:
            raise PeerError(f"expected CDR of {name}, which begins with 00 01 00 00, got {payload[:4].hex(' ')!r}")
        try:
            return self._store.deserialize_cdr(payload, name)
        except BROKEN as fault:
            raise PeerError(
                f"expected CDR of {name}, got {len(payload)} bytes that are none ({fault or type(fault).__name__})"
            ) from None

    def hash(self, name: str) -> str:
        """Return the type hash of REP-2016, ``RIHS01_`` and 64 hex digits: it is a part of a topic's key."""
        found: str = self._store.hash_rihs01(name)
        return found

    def definition(self, name: str) -> str:
        """Return the text of a type with those of its parts, as bags and Foxglove have it (``ros2msg``)."""
        text: str = self._store.generate_msgdef(name, ros_version=2)[0]
        return text
