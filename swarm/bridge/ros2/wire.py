"""The wire of rmw_zenoh: keys, liveliness tokens, QoS as text, GIDs and attachments. Pure.

Source: rmw_zenoh's docs/design.md, liveliness_utils.cpp, attachment_helpers.cpp and qos.cpp, as of Jazzy 0.2.4 and
Kilted 0.6.0. Before these versions an attachment had another form.
"""

import struct
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from xxhash import xxh3_128_intdigest

from swarm.bridge.ros2.topics import RosTopic

NODE: Final = "swarm_bridge"  # the name of the bridge's node in each namespace
ENCLAVE: Final = "%"  # of security: none
ATTACHED: Final = struct.Struct("<qqB16s")  # number of the message, ns of its sending, length of the GID, the GID
GID_LENGTH: Final = 16  # bytes


class EndpointKind(StrEnum):
    """What a token announces."""

    PUBLISHER = "MP"
    SUBSCRIBER = "MS"


@dataclass(frozen=True, slots=True, kw_only=True)
class Node:
    """A node of ROS, as its token announces it."""

    domain: int
    session: str  # the id of its Zenoh session
    number: int  # unique in the session
    namespace: str  # "/r1"; "/" is that of the fleet

    @property
    def token(self) -> str:
        """The key of its liveliness token."""
        return self._token(self.number, "NN")

    def endpoint(self, number: int, kind: EndpointKind, topic: RosTopic, type_hash: str) -> "RosEndpoint":
        """Return a publisher or a subscriber of this node; the number is unique in the session."""
        name = f"{self.namespace.rstrip('/')}/{topic.name}"
        kept = f"{dds(topic.type)}/{type_hash}"
        return RosEndpoint(
            key=f"{self.domain}{name}/{kept}",
            token=f"{self._token(number, kind)}/{mangled(name)}/{kept}/{topic.qos}",
        )

    def _token(self, number: int, kind: str) -> str:
        place = f"{ENCLAVE}/{mangled(self.namespace)}/{NODE}"
        return f"@ros2_lv/{self.domain}/{self.session}/{self.number}/{number}/{kind}/{place}"


@dataclass(frozen=True, slots=True)
class RosEndpoint:
    """A publisher or a subscriber of ROS."""

    key: str  # of its messages
    token: str  # of its liveliness

    @property
    def gid(self) -> bytes:
        """Its global id: XXH3-128 of the token's key, the low half first, each half little-endian."""
        digest: int = xxh3_128_intdigest(self.token.encode())
        return digest.to_bytes(GID_LENGTH, "little")


def attachment(number: int, sent: int, gid: bytes) -> bytes:
    """Return what rmw_zenoh wants attached to a message, 33 bytes; it drops a message without.

    A publisher numbers its messages from 1. ``sent`` is ns since 1970.
    """
    return ATTACHED.pack(number, sent, GID_LENGTH, gid)


def dds(name: str) -> str:
    """Return the DDS name of a type.

    >>> dds("nav_msgs/msg/Odometry")
    'nav_msgs::msg::dds_::Odometry_'
    """
    package, kind, short = name.split("/")
    return f"{package}::{kind}::dds_::{short}_"


def mangled(name: str) -> str:
    """Return a name as one part of a key.

    >>> mangled("/r1/odom"), mangled("/")
    ('%r1%odom', '%')
    """
    return name.replace("/", "%")
