"""The wire of rmw_zenoh: keys, liveliness tokens, QoS as text, GIDs and attachments; and that of ros2dds. Pure.

Source: rmw_zenoh's docs/design.md, liveliness_utils.cpp, attachment_helpers.cpp and qos.cpp, as of Jazzy 0.2.4 and
Kilted 0.6.0. Before these versions an attachment had another form. And what free_fleet expects of zenoh-bridge-ros2dds.
"""

import struct
from dataclasses import dataclass
from enum import StrEnum
from functools import lru_cache
from typing import Final

from xxhash import xxh3_128_intdigest

from swarm.bridge.ros2.topics import RosService, RosTopic
from swarm.errors import PeerError

NODE: Final = "swarm_bridge"  # the usual name of the bridge's node in each namespace
ENCLAVE: Final = "%"  # of security: none
ATTACHED: Final = struct.Struct("<qqB16s")  # number of the message, ns of its sending, length of the GID, the GID
GID_LENGTH: Final = 16  # bytes
GID_AT: Final = 16  # bytes before the length of the GID in an attachment


class Dialect(StrEnum):
    """How ROS travels over Zenoh."""

    RMW_ZENOH = "rmw_zenoh"  # ROS's own middleware: a key has the type and its hash, tokens tell who is there
    ROS2DDS = "ros2dds"  # as zenoh-bridge-ros2dds does, for free_fleet: a key is the name, nothing is attached


class EndpointKind(StrEnum):
    """What a token announces."""

    PUBLISHER = "MP"
    SUBSCRIBER = "MS"
    SERVICE = "SS"


@dataclass(frozen=True, slots=True, kw_only=True)
class RosNode:
    """A node of ROS, as its token announces it."""

    domain: int
    session: str  # the id of its Zenoh session
    number: int  # unique in the session
    namespace: str  # "/r1"; "/" is that of the fleet
    name: str = NODE
    dialect: Dialect = Dialect.RMW_ZENOH

    @property
    def token(self) -> str | None:
        """The key of its liveliness token; None: the dialect has none."""
        return self._make_token(self.number, "NN")

    def make_endpoint(
        self, number: int, kind: EndpointKind, what: RosTopic | RosService, type_hash: str
    ) -> "RosEndpoint":
        """Return a publisher, a subscriber or a service of this node; the number is unique in the session."""
        name = f"{self.namespace.rstrip('/')}/{what.name}"
        kept = f"{dds_type_name(what.type)}/{type_hash}"
        if (token := self._make_token(number, kind)) is None:
            return RosEndpoint(key=name[1:], token=None)
        return RosEndpoint(key=f"{self.domain}{name}/{kept}", token=f"{token}/{mangle_name(name)}/{kept}/{what.qos}")

    def _make_token(self, number: int, kind: str) -> str | None:
        if self.dialect is Dialect.ROS2DDS:
            return None
        place = f"{ENCLAVE}/{mangle_name(self.namespace)}/{self.name}"
        return f"@ros2_lv/{self.domain}/{self.session}/{self.number}/{number}/{kind}/{place}"


@dataclass(frozen=True, slots=True)
class RosEndpoint:
    """A publisher, a subscriber or a service of ROS."""

    key: str  # of its messages
    token: str | None  # of its liveliness; None: the dialect has none, and attaches nothing

    @property
    def gid(self) -> bytes:
        """Its global id: XXH3-128 of the token's key, the low half first, each half little-endian."""
        assert self.token is not None, "the other dialect attaches nothing"
        return gid_of(self.token)

    def make_attachment(self, number: int, sent: int) -> bytes | None:
        """Return what is attached to a message of it: see ``attachment``; None: nothing."""
        return None if self.token is None else pack_attachment(number, sent, self.gid)

    def make_answer_attachment(self, request: bytes | None, sent: int) -> bytes | None:
        """Return what is attached to the answer to a request: the request's own number and GID; None: nothing.

        Raises:
            PeerError: what is attached to the request is not what rmw_zenoh attaches.
        """
        if self.token is None:
            return None
        if request is None or len(request) != ATTACHED.size or request[GID_AT] != GID_LENGTH:
            came = "nothing" if request is None else f"{len(request)} bytes"
            raise PeerError(f"expected an attachment of {ATTACHED.size} bytes, as rmw_zenoh's, got {came}")
        number, _, _, gid = ATTACHED.unpack(request)
        return pack_attachment(number, sent, gid)


@lru_cache(maxsize=4096)
def gid_of(name: str) -> bytes:
    """Return the global id of what a name announces; every message of a publisher has it."""
    digest: int = xxh3_128_intdigest(name.encode())
    return digest.to_bytes(GID_LENGTH, "little")


def pack_attachment(number: int, sent: int, gid: bytes) -> bytes:
    """Return what rmw_zenoh wants attached to a message, 33 bytes; it drops a message without.

    A publisher numbers its messages from 1. ``sent`` is ns since 1970.
    """
    return ATTACHED.pack(number, sent, GID_LENGTH, gid)


def dds_type_name(name: str) -> str:
    """Return the DDS name of a type.

    >>> dds_type_name("nav_msgs/msg/Odometry")
    'nav_msgs::msg::dds_::Odometry_'
    """
    package, kind, short = name.split("/")
    return f"{package}::{kind}::dds_::{short}_"


def mangle_name(name: str) -> str:
    """Return a name as one part of a key.

    >>> mangle_name("/r1/odom"), mangle_name("/")
    ('%r1%odom', '%')
    """
    return name.replace("/", "%")
