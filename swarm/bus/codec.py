"""The conversion of messages to payloads and back. Decoding returns a checked message or raises ``PeerError``."""

from functools import cache
from typing import Annotated, Any, Final, NoReturn, TypeVar

import msgpack
from msgspec import DecodeError, Meta, Raw, Struct, ValidationError, json
from msgspec.msgpack import Decoder, Encoder

from swarm.bus.records import OpenedRecords
from swarm.errors import PeerError
from swarm.messages import Broadcast, Message, Relayed, TrafficBroadcast
from swarm.messages.faults import explain_fault

M = TypeVar("M", bound=Message)
ENCODER: Final = Encoder()
RECORDS: Final = OpenedRecords()


class SealedTraffic(Struct):
    """A ``TrafficBroadcast`` with unopened records."""

    own: Raw
    others: tuple[tuple[Annotated[int, Meta(ge=1, le=16)], Raw], ...] = ()


class SealedBroadcast(Broadcast, frozen=True, kw_only=True):
    """A ``Broadcast`` with unopened records."""

    traffic: SealedTraffic | None = None  # type: ignore[assignment]


FIELDS: Final = Decoder(dict[str, Raw])
MAP_16: Final = b"\xde"  # what a map of 16 fields or more begins with, before its size of two bytes
VERSION: Final = b"\xa1v"  # the text `v`
SEALED: Final = Decoder(SealedBroadcast)
OTHER_FIELDS: Final = tuple(name for name in Broadcast.__struct_fields__ if name != "traffic")


def encode(message: Message, as_json: bool = False) -> bytes:
    """Pack a message as a MessagePack map, or as JSON text; records that came in bytes go out as the same bytes."""
    if as_json:
        return json.encode(message)
    if isinstance(message, Broadcast) and message.traffic is not None and message.traffic.others:
        own, others = message.traffic.own, message.traffic.others
        packed: Any = tuple([(hops, RECORDS.packed_record(record)) for hops, record in others])
        message = _with_traffic(message, TrafficBroadcast(own=own, others=packed))
    return ENCODER.encode(message)


def decode(payload: bytes, kind: type[M], limit: int, as_json: bool = False) -> M:
    """Unpack and check a message of a known kind: a MessagePack map, or JSON text.

    Raises:
        PeerError: the payload is longer than ``limit`` bytes, is neither, or has another version or kind.
    """
    if len(payload) > limit:
        raise PeerError(f"{kind.__name__.lower()}: expected at most {limit} bytes, got {len(payload)}")
    try:
        if not (_has_version_in_json(payload) if as_json else _has_version(payload)):
            # the decoders of messages would let it be missing
            raise ValidationError("expected a version, `v`, got none")
        if as_json:
            return json.decode(payload, type=kind)
        message: Any = _decode_body(SEALED.decode(payload)) if kind is Broadcast else _decoder(kind).decode(payload)
    except (DecodeError, RecursionError, UnicodeDecodeError) as fault:
        raise PeerError(f"{kind.__name__.lower()}: {fault if as_json else _reason(payload, fault)}") from None
    found: M = message
    return found


def _has_version(payload: bytes) -> bool:
    """Return True if a map has the field `v`: this project's programs send it first."""
    first = payload[3:5] if payload[:1] == MAP_16 else payload[1:3]
    return first == VERSION or "v" in FIELDS.decode(payload)


def _has_version_in_json(payload: bytes) -> bool:
    return "v" in json.decode(payload, type=dict[str, Raw])


@cache
def _decoder(kind: type[M]) -> Decoder[M]:
    return Decoder(kind, ext_hook=_no_extension)


def _no_extension(code: int, data: memoryview) -> NoReturn:
    raise ValidationError(f"expected no extension type, got {code} of {len(data)} bytes")


def _decode_body(sealed: SealedBroadcast) -> Broadcast:
    traffic: Any = sealed.traffic
    if traffic is not None:
        others = tuple([Relayed(hops, RECORDS.open(record)) for hops, record in traffic.others])
        traffic = TrafficBroadcast(own=RECORDS.open(traffic.own), others=others)
    return _with_traffic(sealed, traffic)


def _with_traffic(message: Broadcast, traffic: TrafficBroadcast | None) -> Broadcast:
    return Broadcast(traffic=traffic, **{name: getattr(message, name) for name in OTHER_FIELDS})


def _reason(payload: bytes, fault: Exception) -> str:
    """Return why a payload is refused: for people, who know MessagePack better than this project's decoder."""
    try:
        whole = msgpack.unpackb(payload, max_ext_len=0)
    except (ValueError, msgpack.UnpackException, RecursionError) as broken:
        return f"expected a MessagePack map, got {payload[:16]!r} ({broken})"
    if not isinstance(whole, dict):
        return f"expected a MessagePack map, got {type(whole).__name__}"
    return str(explain_fault(str(fault), whole))
