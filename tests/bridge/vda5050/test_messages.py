"""What comes on a vehicle's topics: whatever it is, it is a checked message or one sentence."""

import json
from contextlib import suppress
from math import inf, nan
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm.bridge.vda5050 import messages as vda
from swarm.errors import PeerError
from tests.bridge.vda5050.shared import actions_of, header, order_of

PLAIN = order_of(("A", 1.0, 2.0), ("B", 3.0, 4.0))
values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=6,
)
paths = st.sampled_from(
    [
        ("headerId",), ("version",), ("orderId",), ("orderUpdateId",), ("nodes",), ("edges",), ("nodes", 0),
        ("nodes", 1, "sequenceId"), ("nodes", 1, "released"), ("nodes", 0, "nodePosition"), ("nodes", 0, "actions"),
        ("nodes", 0, "nodePosition", "x"), ("nodes", 0, "nodePosition", "allowedDeviationXY"), ("edges", 0),
        ("edges", 0, "trajectory"), ("edges", 0, "maxSpeed"), ("zoneSetId",),
    ]
)  # fmt: skip


def changed(order: dict[str, Any], path: tuple[str | int, ...], value: object) -> dict[str, Any]:
    """Return an order with another value somewhere."""
    copy: dict[str, Any] = json.loads(json.dumps(order))
    place: Any = copy
    for step in path[:-1]:
        place = place[step]
    place[path[-1]] = value
    return copy


def refusal(payload: bytes, kind: type[Any] = vda.Order) -> str:
    with pytest.raises(PeerError) as caught:
        vda.decode_message(payload, kind)
    return str(caught.value)


def packed(order: dict[str, Any]) -> bytes:
    return json.dumps(order).encode()


@pytest.mark.parametrize(
    ("payload", "said"),
    [
        (b"", "expected JSON, got b''"),
        (b"no", "expected JSON, got b'no'"),
        (b"\xff\xfe", "expected JSON, got b'\\xff\\xfe'"),
        (b"[]", "expected object, got []"),
        (b"[" * 100_000, "expected JSON, got b'[[[["),
        (packed(PLAIN | {"x": 0})[:-1] + b', "deep": ' + b"[" * 50_000 + b"]" * 50_000 + b"}", "recursion"),
        (b" " * (vda.LIMIT + 1), f"expected at most {vda.LIMIT} bytes, got {vda.LIMIT + 1}"),
        (packed(header()), "Object missing required field orderId"),
        (packed(PLAIN | {"version": "1.1.0"}), "version: expected 2.x, got '1.1.0'"),
        (packed(PLAIN | {"version": "3.0.0"}), "version: expected 2.x, got '3.0.0'"),
        (packed(PLAIN | {"nodes": []}), "nodes: expected array of length >= 1, got []"),
        (packed(PLAIN | {"orderUpdateId": -1}), "orderUpdateId: expected int >= 0, got -1"),
        (packed(PLAIN | {"orderId": 7}), "orderId: expected str, got 7"),
        (packed(changed(PLAIN, ("nodes", 1, "nodePosition", "x"), nan)), "expected JSON, got"),
        (packed(changed(PLAIN, ("nodes", 1, "nodePosition", "x"), inf)), "expected JSON, got"),
        (packed(changed(PLAIN, ("nodes", 1, "nodePosition", "x"), 1e300)), "nodes[1].nodePosition.x: expected float <= 1"),
        (packed(changed(PLAIN, ("nodes", 1, "nodePosition", "theta"), 7.0)), "nodes[1].nodePosition.theta: expected float <="),
        (packed(changed(PLAIN, ("nodes", 0, "released"), "yes")), "nodes[0].released: expected bool, got 'yes'"),
    ],
)  # fmt: skip
def test_what_is_no_order_is_one_sentence(payload: bytes, said: str) -> None:
    assert said in refusal(payload)


@given(st.binary(max_size=200))
def test_any_bytes_are_refused_or_read(payload: bytes) -> None:
    vda.find_references(payload)
    for kind in (vda.Order, vda.InstantActions):
        assert refusal(payload, kind)


@given(paths, values)
def test_any_value_anywhere_is_refused_or_read(path: tuple[str | int, ...], value: object) -> None:
    payload = packed(changed(PLAIN, path, value))
    for reference in vda.find_references(payload):
        assert len(reference.reference_value) <= vda.MOST_ID
    with suppress(PeerError):
        vda.decode_message(payload, vda.Order)


def test_a_message_that_is_refused_says_what_it_is_as_far_as_it_can_be_read() -> None:
    def names(payload: bytes) -> dict[str, str]:
        return {one.reference_key: one.reference_value for one in vda.find_references(payload)}

    assert names(packed(PLAIN | {"nodes": 3})) == {"headerId": "0", "orderId": "o1", "orderUpdateId": "0"}
    assert names(packed({"orderId": ["o1"], "headerId": "x" * 500})) == {"headerId": "x" * vda.MOST_ID}
    assert names(b"garbage") == {}


@pytest.mark.parametrize("omit", ["zoneSetId", "theta"])
def test_null_is_as_good_as_nothing(omit: str) -> None:
    order = changed(PLAIN, (omit,) if omit == "zoneSetId" else ("nodes", 0, "nodePosition", omit), None)
    assert vda.decode_message(packed(order), vda.Order) == vda.decode_message(packed(PLAIN), vda.Order)


def test_actions_are_read_and_their_parameters_left_alone() -> None:
    said: dict[str, Any] = actions_of("startPause#7")
    said["actions"][0]["actionParameters"] = [{"key": "any", "value": {"nested": [1, None]}}]
    (action,) = vda.decode_message(packed(said), vda.InstantActions).actions
    assert (action.action_type, action.action_id) == ("startPause", "7")
