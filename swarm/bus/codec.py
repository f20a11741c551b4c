"""The conversion of messages to payloads and back. Decoding returns a checked message or raises ``PeerError``."""

from typing import Any, TypeVar

import msgpack
import msgspec

from swarm.errors import PeerError
from swarm.messages import VERSION, Message

M = TypeVar("M", bound=Message)


def encode(message: Message) -> bytes:
    """Pack a message as a MessagePack map."""
    fields: dict[str, Any] = msgspec.to_builtins(message, builtin_types=(bytes,))
    fields["v"] = VERSION
    packed: bytes = msgpack.packb(fields)
    return packed


def decode(payload: bytes, kind: type[M], limit: int) -> M:
    """Unpack and check a message of a known kind.

    Raises:
        PeerError: the payload is longer than ``limit`` bytes, is not a MessagePack map, or has another version or kind.
    """
    name = kind.__name__.lower()
    if len(payload) > limit:
        raise PeerError(f"{name}: expected at most {limit} bytes, got {len(payload)}")
    try:
        fields = msgpack.unpackb(payload, max_ext_len=0)
    except (ValueError, msgpack.UnpackException, RecursionError) as fault:
        raise PeerError(f"{name}: expected a MessagePack map, got {payload[:16]!r} ({fault})") from None
    if not isinstance(fields, dict):
        raise PeerError(f"{name}: expected a MessagePack map, got {type(fields).__name__}")
    if fields.get("v") != VERSION:
        raise PeerError(f"{name}: expected version {VERSION}, got {fields.get('v')!r}")
    try:
        return msgspec.convert(fields, kind)
    except (msgspec.ValidationError, RecursionError) as fault:
        raise PeerError(f"{name}: {fault}") from None
