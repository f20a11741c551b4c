"""The wire of rmw_zenoh: keys, liveliness tokens, QoS as text, GIDs and attachments. Pure.

Source: rmw_zenoh's docs/design.md, liveliness_utils.cpp, attachment_helpers.cpp and qos.cpp, as of Jazzy 0.2.4 and
Kilted 0.6.0. Before these versions an attachment had another form.
"""

import re
import struct
from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import Final, NamedTuple

from xxhash import xxh3_128_intdigest

NODE: Final = "swarm_bridge"  # the usual name of the bridge's node in each namespace
ENCLAVE: Final = "%"  # of security: none
ATTACHED: Final = struct.Struct("<qqB16s")  # number of the message, ns of its sending, length of the GID, the GID
GID_LENGTH: Final = 16  # bytes


class Qos(StrEnum):
    """The qualities of service that the bridge offers, in the text of a token: empty is rmw_zenoh's default.

    The parts are reliability (2: best effort), durability (1: transient local), history and depth; then deadline,
    lifespan and liveliness.
    """

    DEFAULT = "::,10:,:,:,,"
    LATCHED = ":1:,1:,:,:,,"
    SENSOR = "2::,5:,:,:,,"
    TF = "::,100:,:,:,,"  # tf2's own

    @property
    def is_latched(self) -> bool:
        """True if who comes late gets the last message."""
        return self is Qos.LATCHED


class RosTopic(NamedTuple):
    """A topic of ROS, below the namespace of its node."""

    name: str
    type: str
    qos: Qos = Qos.DEFAULT


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
    name: str = NODE

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
        place = f"{ENCLAVE}/{mangled(self.namespace)}/{self.name}"
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


def namespaces(robots: Iterable[str]) -> tuple[dict[str, str], dict[str, str]]:
    """Return the namespace of each robot, and who has it already for each robot that cannot have its own.

    A name of ROS has only letters, digits and single underscores and begins with a letter; ours has ``.``, ``:`` and
    ``-`` too.

    >>> namespaces(["r1", "arm-2", "arm.2", "7"])
    ({'r1': '/r1', 'arm-2': '/arm_2', '7': '/r7'}, {'arm.2': 'arm-2'})
    """
    given: dict[str, str] = {}
    owners: dict[str, str] = {}
    refused: dict[str, str] = {}
    for robot in robots:
        name = re.sub("[^A-Za-z0-9]+", "_", robot).strip("_")
        name = name if name[:1].isalpha() else f"r{name}"
        if name in owners:
            refused[robot] = owners[name]
        else:
            owners[name], given[robot] = robot, f"/{name}"
    return given, refused
