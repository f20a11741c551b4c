"""The messages of VDA 5050 2.1.0. What a master says is checked when it is decoded. SI units; angles in radians.

Names and types are those of the standard's text and of its JSON schemas (github.com/VDA5050/VDA5050, tag 2.1.0).
Fields that this bridge does not need are left out, and ignored when they come.
"""

from datetime import datetime
from math import pi
from typing import Annotated, Any, Final, Literal, TypeVar

from msgspec import DecodeError, Meta, Struct, field, json

from swarm.errors import PeerError
from swarm.messages.faults import explain_fault

VERSION: Final = "2.1.0"
MAJOR: Final = "v2"  # in each topic
LIMIT: Final = 262_144  # bytes of what a master says; an order of 100 nodes takes 30,000
MOST_ID: Final = 128  # characters
MOST_NODES: Final = 1000  # of an order, with its horizon
MOST_ACTIONS: Final = 100  # of one message

Name = Annotated[str, Meta(max_length=MOST_ID)]
GivenName = Annotated[str, Meta(min_length=1, max_length=MOST_ID)]
Text = Annotated[str, Meta(max_length=2000)]
Whole = Annotated[int, Meta(ge=0, le=2**53)]
Metres = Annotated[float, Meta(ge=-1e6, le=1e6)]
Radius = Annotated[float, Meta(ge=0, le=1e6)]
Angle = Annotated[float, Meta(ge=-pi - 1e-6, le=pi + 1e-6)]


class VdaStruct(Struct, frozen=True, kw_only=True, rename="camel", omit_defaults=True):
    """Base of all: fields are in camel case on the wire; optional ones that have no value are left out."""


class Header(VdaStruct, frozen=True, kw_only=True):
    """The first fields of each message."""

    header_id: Whole  # counts the messages of one topic
    timestamp: Text
    version: Name
    manufacturer: Name
    serial_number: Name


# --- what a master says ---


class Action(VdaStruct, frozen=True, kw_only=True):
    """Something to do beside driving."""

    action_type: GivenName
    action_id: GivenName
    blocking_type: Literal["NONE", "SOFT", "HARD"]


class NodePosition(VdaStruct, frozen=True, kw_only=True):
    """Where a node is."""

    x: Metres
    y: Metres
    map_id: Name
    theta: Angle | None = None
    allowed_deviation: Radius | None = field(default=None, name="allowedDeviationXY")
    allowed_deviation_theta: Angle | None = None


class OrderPart(VdaStruct, frozen=True, kw_only=True):
    """A node or an edge of an order. The released ones are its base, those after them its horizon."""

    sequence_id: Whole
    released: bool
    actions: Annotated[list[Action], Meta(max_length=MOST_ACTIONS)]


class Node(OrderPart, frozen=True, kw_only=True):
    """A place of an order."""

    node_id: GivenName
    node_position: NodePosition | None = None


class Edge(OrderPart, frozen=True, kw_only=True):
    """What joins two nodes."""

    edge_id: GivenName
    start_node_id: GivenName
    end_node_id: GivenName
    max_speed: float | None = None
    max_rotation_speed: float | None = None
    orientation: float | None = None
    direction: Text | None = None
    rotation_allowed: bool | None = None
    trajectory: dict[str, Any] | None = None
    corridor: dict[str, Any] | None = None


class Order(Header, frozen=True, kw_only=True):
    """An order, or an update of the one that the vehicle has."""

    order_id: GivenName
    order_update_id: Whole
    nodes: Annotated[list[Node], Meta(min_length=1, max_length=MOST_NODES)]
    edges: Annotated[list[Edge], Meta(max_length=MOST_NODES)]
    zone_set_id: Name | None = None


class InstantActions(Header, frozen=True, kw_only=True):
    """Actions that are not part of an order."""

    actions: Annotated[list[Action], Meta(max_length=MOST_ACTIONS)]


# --- what a vehicle says, behind a header ---


class Reference(VdaStruct, frozen=True, kw_only=True):
    """What an error or an information is about."""

    reference_key: str
    reference_value: str


class Error(VdaStruct, frozen=True, kw_only=True):
    """Why something is not done."""

    error_type: str
    error_level: Literal["WARNING", "FATAL"]
    error_references: tuple[Reference, ...] = ()
    error_description: str = ""


class Info(VdaStruct, frozen=True, kw_only=True):
    """Something to read; no program may depend on it."""

    info_type: str
    info_level: Literal["INFO", "DEBUG"]
    info_description: str = ""


class NodeState(VdaStruct, frozen=True, kw_only=True):
    """A node that is still ahead."""

    node_id: str
    sequence_id: int
    released: bool


class EdgeState(VdaStruct, frozen=True, kw_only=True):
    """An edge that is still ahead."""

    edge_id: str
    sequence_id: int
    released: bool


class ActionState(VdaStruct, frozen=True, kw_only=True):
    """How far an action is."""

    action_id: str
    action_type: str
    action_status: Literal["WAITING", "RUNNING", "FINISHED", "FAILED"]
    result_description: str = ""


class AgvPosition(VdaStruct, frozen=True, kw_only=True):
    """Where a vehicle is."""

    x: float
    y: float
    theta: float
    map_id: str
    position_initialized: bool


class Velocity(VdaStruct, frozen=True, kw_only=True):
    """How fast it is, in its own frame."""

    vx: float
    vy: float
    omega: float


class BatteryState(VdaStruct, frozen=True, kw_only=True):
    """Our robots have no battery that runs down."""

    battery_charge: float  # percent
    charging: bool


class SafetyState(VdaStruct, frozen=True, kw_only=True):
    """Our robots have no emergency stop and no protective field."""

    e_stop: Literal["NONE"]
    field_violation: bool


class MapState(VdaStruct, frozen=True, kw_only=True):
    """A map that a vehicle has."""

    map_id: str
    map_version: str
    map_status: Literal["ENABLED"]


class State(VdaStruct, frozen=True, kw_only=True):
    """All that a master has to know of a vehicle."""

    order_id: str
    order_update_id: int
    last_node_id: str
    last_node_sequence_id: int
    node_states: tuple[NodeState, ...]
    edge_states: tuple[EdgeState, ...]
    driving: bool
    paused: bool
    new_base_request: bool
    action_states: tuple[ActionState, ...]
    battery_state: BatteryState
    operating_mode: Literal["AUTOMATIC"]
    errors: tuple[Error, ...]
    safety_state: SafetyState
    loads: tuple[str, ...]  # there are none
    maps: tuple[MapState, ...]
    information: tuple[Info, ...]
    agv_position: AgvPosition | None = None  # None: the world has not told it yet
    velocity: Velocity | None = None
    distance_since_last_node: float | None = None


class Visualization(VdaStruct, frozen=True, kw_only=True):
    """Where a vehicle is, for drawings."""

    agv_position: AgvPosition
    velocity: Velocity


class Connection(VdaStruct, frozen=True, kw_only=True):
    """Whether a vehicle can be spoken to."""

    connection_state: Literal["ONLINE", "OFFLINE", "CONNECTIONBROKEN"]


Body = VdaStruct | dict[str, Any]
Heard = TypeVar("Heard", Order, InstantActions)
DECODERS: Final[dict[type[Any], json.Decoder[Any]]] = {kind: json.Decoder(kind) for kind in (Order, InstantActions)}
ENCODER: Final = json.Encoder()


def decode_message(payload: bytes, kind: type[Heard]) -> Heard:
    """Return a checked message of a master.

    Raises:
        PeerError: the payload is too long, is no such message, or one of another version.
    """
    if len(payload) > LIMIT:
        raise PeerError(f"expected at most {LIMIT} bytes, got {len(payload)}")
    try:
        message: Heard = DECODERS[kind].decode(payload)
    except (DecodeError, RecursionError, UnicodeDecodeError) as fault:
        raise PeerError(_explain_decode_fault(payload, fault)) from None
    if not message.version.startswith("2."):
        raise PeerError(f"version: expected 2.x, got {message.version[:20]!r}")
    return message


def _explain_decode_fault(payload: bytes, fault: Exception) -> str:
    try:
        return str(explain_fault(str(fault), json.decode(payload)))
    except (DecodeError, RecursionError, UnicodeDecodeError) as broken:
        return f"expected JSON, got {payload[:16]!r} ({broken})"


class RefusedNames(VdaStruct, frozen=True, kw_only=True):
    """What a message that is refused may say of itself, of any type."""

    header_id: Any = None
    order_id: Any = None
    order_update_id: Any = None


def find_references(payload: bytes) -> tuple[Reference, ...]:
    """Return what a message that is refused says of itself, as far as it can be read."""
    if len(payload) > LIMIT:
        return ()
    try:
        names = json.decode(payload, type=RefusedNames)
    except (DecodeError, RecursionError, UnicodeDecodeError):
        return ()
    said = {"headerId": names.header_id, "orderId": names.order_id, "orderUpdateId": names.order_update_id}
    return tuple(make_reference(key, value) for key, value in said.items() if isinstance(value, (str, int)))


def make_reference(key: str, value: object) -> Reference:
    """Return a reference to one value, cut to the length of an id."""
    return Reference(reference_key=key, reference_value=str(value)[:MOST_ID])


def encode_message(header: Header, body: Body) -> bytes:
    """Return a vehicle's message as JSON: the fields of the header, then those of the body."""
    return ENCODER.encode(header)[:-1] + b"," + ENCODER.encode(body)[1:]


def format_time(at: datetime) -> str:
    """Return a time in UTC as the standard writes it, in milliseconds.

    >>> from datetime import UTC
    >>> format_time(datetime(2026, 1, 2, 3, 4, 5, 678_900, tzinfo=UTC))
    '2026-01-02T03:04:05.678Z'
    """
    return f"{at:%Y-%m-%dT%H:%M:%S}.{at.microsecond // 1000:03d}Z"
