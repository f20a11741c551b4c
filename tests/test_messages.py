"""The table of messages, and decoding of arbitrary bytes: it returns the message or raises PeerError."""

import re
import struct
from math import inf, nan
from typing import Any

import msgpack
import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import inspect

from swarm import messages
from swarm.bus.codec import decode, encode
from swarm.errors import PeerError
from swarm.messages import REPLIES, TOPICS, VERSION, Accepted, Command, Message, Sense, Topic
from swarm.robot.tuning import SCALE
from world.tasks.tasks import REST

LARGE = 10_000_000  # bytes


def values_of(type_: inspect.Type) -> st.SearchStrategy[Any]:
    """Draw values that a field's type allows."""
    match type_:
        case inspect.Metadata(type=inner):
            return values_of(inner)
        case inspect.FloatType(ge=low, gt=above, le=high, lt=below):
            return st.floats(
                above if low is None else low,
                below if high is None else high,
                allow_nan=False,
                allow_infinity=False,
                exclude_min=above is not None,
                exclude_max=below is not None,
            )
        case inspect.IntType(ge=low, le=high, lt=below):
            return st.integers(low, high if below is None else below - 1)
        case inspect.StrType(pattern=str(pattern)):
            return st.from_regex(pattern.replace(r"\Z", "$"), fullmatch=True).filter(lambda text: "\n" not in text)
        case inspect.StrType(max_length=longest):
            return st.text(max_size=min(longest or 50, 50))
        case inspect.BytesType():
            return st.binary(max_size=5)
        case inspect.LiteralType(values=values):
            return st.sampled_from(values)
        case inspect.BoolType():
            return st.booleans()
        case inspect.NoneType():
            return st.none()
        case inspect.EnumType(cls=cls):
            return st.sampled_from(cls)
        case inspect.ListType(item_type=item, min_length=least):
            return st.lists(values_of(item), min_size=least or 0, max_size=4)
        case inspect.VarTupleType(item_type=item):
            return st.lists(values_of(item), max_size=4).map(tuple)
        case inspect.TupleType(item_types=items):
            return st.tuples(*map(values_of, items))
        case inspect.DictType(key_type=key, value_type=value):
            return st.dictionaries(values_of(key), values_of(value), max_size=3)
        case inspect.UnionType(types=types):
            return st.one_of(*map(values_of, types))
        case inspect.NamedTupleType(cls=cls, fields=fields) | inspect.DataclassType(cls=cls, fields=fields):
            return st.builds(cls, **{field.name: values_of(field.type) for field in fields})
        case inspect.StructType(cls=cls):
            return messages_of(cls)
    raise TypeError(f"no example for {type_}")


def messages_of(kind: type[msgspec.Struct]) -> st.SearchStrategy[Any]:
    fields = inspect.type_info(kind).fields  # type: ignore[attr-defined]
    return st.builds(kind, **{field.name: values_of(field.type) for field in fields})


KINDS = [
    kind
    for kind in vars(messages).values()
    if isinstance(kind, type) and issubclass(kind, Message) and kind is not Message
]
any_message = st.sampled_from(KINDS).flatmap(messages_of)
# fmt: off
SENSE = Sense(
        world="local",
    run=0, tick=3, time=0.15, lockstep=True, x=1.0, y=2.0, yaw=0.5, linear=0.6, angular=0.1, left=1.6, front=0.7,
    right=1.6, bearings=[0.5, None], hears=[("r2", 2)], rays=[1.6] * 15,
)
# fmt: on


def fields_of(message: Message) -> dict[str, Any]:
    unpacked: dict[str, Any] = msgpack.unpackb(encode(message))
    return unpacked


@given(any_message)
def test_every_message_comes_back_as_it_went(message: Message) -> None:
    assert decode(encode(message), type(message), LARGE) == message


@pytest.mark.parametrize("scale", [SCALE.turning, SCALE.detour, SCALE.tight * (1.0 - SCALE.behind)])
def test_every_scale_that_a_robot_chooses_passes_the_wire(scale: float) -> None:
    command = msgspec.structs.replace(REST, scale=scale)
    assert decode(encode(command), Command, LARGE) == command


@given(any_message, st.data())
def test_a_truncated_message_is_refused(message: Message, data: st.DataObject) -> None:
    payload = encode(message)
    with pytest.raises(PeerError):
        decode(payload[: data.draw(st.integers(0, len(payload) - 1))], type(message), LARGE)


@given(any_message, st.data())
def test_a_message_with_bits_flipped_is_refused_or_still_within_its_bounds(
    message: Message, data: st.DataObject
) -> None:
    payload = bytearray(encode(message))
    for _ in range(data.draw(st.integers(1, 4))):
        payload[data.draw(st.integers(0, len(payload) - 1))] = data.draw(st.integers(0, 255))
    try:
        got = decode(bytes(payload), type(message), LARGE)
    except PeerError:
        return
    assert decode(encode(got), type(message), LARGE) == got


@given(st.binary(max_size=200), st.sampled_from(KINDS))
def test_noise_is_refused(noise: bytes, kind: type[Message]) -> None:
    with pytest.raises(PeerError):
        decode(noise, kind, LARGE)


plain = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**63), 2**64 - 1)
    | st.floats()
    | st.text(max_size=8)
    | st.binary(max_size=8),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4),
    max_leaves=10,
)


@given(any_message, st.data(), plain)
def test_any_field_replaced_by_anything_is_refused_or_within_its_bounds(
    message: Message, data: st.DataObject, value: object
) -> None:
    fields = fields_of(message)
    fields[data.draw(st.sampled_from(sorted(fields)))] = value
    try:
        got = decode(msgpack.packb(fields), type(message), LARGE)
    except PeerError:
        return
    assert decode(encode(got), type(message), LARGE) == got, "what is let in can be sent on"


@given(any_message, st.data())
def test_a_missing_field_is_refused_unless_it_has_a_default(message: Message, data: st.DataObject) -> None:
    required = [f.name for f in inspect.type_info(type(message)).fields if f.required]  # type: ignore[attr-defined]
    gone = data.draw(st.sampled_from([*required, "v"]))
    fields = {name: value for name, value in fields_of(message).items() if name != gone}
    with pytest.raises(PeerError):
        decode(msgpack.packb(fields), type(message), LARGE)


def test_a_field_that_a_receiver_does_not_know_is_ignored() -> None:
    assert decode(msgpack.packb(fields_of(SENSE) | {"of the future": [1, 2]}), Sense, LARGE) == SENSE


# fmt: off
BAD_FIELDS: dict[str, dict[str, object]] = {
    "not a number":            {"x": nan},
    "infinite":                {"x": inf},
    "infinitely negative":     {"y": -inf},
    "not a number in a list":  {"bearings": [nan]},
    "not an angle":            {"yaw": 4.0},
    "a negative distance":     {"front": -0.1},
    "too far":                 {"x": 1e7},
    "too fast":                {"linear": 21.0},
    "a text for a number":     {"x": "1.0"},
    "a number for a text":     {"hears": [[3, 3]]},
    "a number for a truth":    {"lockstep": 1},
    "a fraction for a count":  {"tick": 0.5},
    "a negative count":        {"tick": -1},
    "a count beyond 2**53":    {"tick": 2**53 + 1},
    "nothing for a number":    {"x": None},
    "a map for a list":        {"hears": {}},
    "a pair too long":         {"hears": [["r2", 2, 2]]},
    "an id with a slash":      {"hears": [["r/2", 2]]},
    "an id with a newline":    {"hears": [["r2\n", 2]]},
    "an id too long":          {"hears": [["r" * 65, 2]]},
    "an empty id":             {"hears": [["", 2]]},
    "bytes for a text":        {"hears": [[b"r2", 2]]},
    "another version":         {"v": VERSION + 1},
    "a version as text":       {"v": str(VERSION)},
    "no version":              {"v": None},
    "a true version":          {"v": [VERSION]},
}
# fmt: on


@pytest.mark.parametrize("name", BAD_FIELDS)
def test_a_bad_field_is_refused(name: str) -> None:
    with pytest.raises(PeerError, match="sense"):
        decode(msgpack.packb(fields_of(SENSE) | BAD_FIELDS[name]), Sense, LARGE)


# fmt: off
BAD_PAYLOADS = {
    "nothing":                   b"",
    "a number":                  msgpack.packb(1),
    "a list":                    msgpack.packb([1, 2]),
    "a text":                    msgpack.packb("sense"),
    "two maps":                  encode(SENSE) * 2,
    "keys that are no texts":    msgpack.packb({1: 2}),
    "an extension":              msgpack.packb({"v": 1, "x": msgpack.ExtType(4, b"abc")}),
    "a timestamp":               msgpack.packb({"v": 1, "x": msgpack.Timestamp(1, 1)}),
    "no UTF-8":                  b"\x81\xa1v\xa2\xff\xfe",
    "a promise of 2**32 items":  b"\xdd\xff\xff\xff\xff",
    "a promise of a huge map":   b"\xdf\xff\xff\xff\xff",
    "a promise of a huge text":  b"\xdb\xff\xff\xff\xff",
    "lists in lists":            b"\x91" * 100_000 + b"\x90",
    "maps in maps":              b"\x81\xa1v" * 100_000 + b"\x80",
    "depth within a field":      b"\x82\xa1v\x01\xa1x" + b"\x91" * 900 + b"\x90",
    "the reserved byte":         b"\xc1",
    "JSON":                      b'{"v": 1}',
}
# fmt: on


@pytest.mark.parametrize("name", BAD_PAYLOADS)
def test_a_bad_payload_is_refused(name: str) -> None:
    for kind in KINDS:
        with pytest.raises(PeerError, match=f"^{kind.__name__.lower()}: "):
            decode(BAD_PAYLOADS[name], kind, LARGE)


def test_a_payload_over_its_limit_is_refused_unread_and_one_at_it_is_not() -> None:
    payload = encode(SENSE)
    assert decode(payload, Sense, len(payload)) == SENSE
    with pytest.raises(PeerError, match=f"expected at most {len(payload) - 1} bytes, got {len(payload)}"):
        decode(payload, Sense, len(payload) - 1)


def test_numbers_survive_to_the_last_bit() -> None:
    x = struct.unpack("<d", bytes(range(7)) + b"\x3f")[0]
    message = msgspec.structs.replace(SENSE, x=x)
    assert decode(encode(message), Sense, LARGE).x == x


# --- the table ---

KNOWN = {"robot", "zx", "zy"}


@pytest.mark.parametrize("topic", TOPICS, ids=lambda topic: topic.key)
def test_each_row_of_the_table_makes_sense(topic: Topic[Any]) -> None:
    assert re.fullmatch(r"[a-z]+(/([a-z]+|{[a-z]+}))+", topic.key)
    assert set(re.findall(r"{(\w+)}", topic.key)) <= KNOWN
    assert topic.rate >= 0
    assert topic.timeout >= 0
    assert topic.timeout == 0 or topic.rate > 0, "only what comes again and again goes stale"
    assert topic.timeout == 0 or topic.timeout > 1 / topic.rate, "the next one comes before this one is stale"
    assert 1_000 <= topic.limit <= 16 * 1024 * 1024
    assert topic.message in KINDS


def test_keys_are_unique_and_none_matches_another() -> None:
    shapes = [re.sub(r"{\w+}", "*", topic.key) for topic in TOPICS]
    assert len(set(shapes)) == len(TOPICS)


def test_every_topic_of_the_module_is_in_the_table_and_every_reply_belongs_to_one() -> None:
    rows = [row for row in vars(messages).values() if isinstance(row, Topic)]
    assert {row.key for row in rows} == {row.key for row in TOPICS}
    assert set(REPLIES) <= {row.key for row in TOPICS}
    assert REPLIES[messages.ACTION.key] is Accepted


def test_a_robot_in_a_key_is_a_robot_in_the_message_where_the_message_names_one() -> None:
    for topic in TOPICS:
        if "robot" in topic.message.__struct_fields__ and topic.rate and topic.message is not messages.Event:
            assert "{robot}" in topic.key, topic.key
