"""What an item of the inbox says: any key and any payload is either an arrival that fits its topic, or refused."""

from typing import Any

import msgpack
import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm.bus.arrivals import Arrival, Link, Presence
from swarm.bus.codec import decode, encode
from swarm.bus.inbox_item import ID, decode_item
from swarm.errors import PeerError
from swarm.messages import CLOCK, COMMAND, EVENT, MAP, PLAN, RADIO, SENSE, STATE, TRUTH, Plan, Topic

PREFIX = "swarm/v1/fleet/"
TOPICS = (CLOCK, COMMAND, EVENT, MAP, PLAN, RADIO, SENSE, STATE, TRUTH)
# fmt: off
CHUNKS = st.one_of(
    st.sampled_from(["robot", "r1", "r2", "sense", "cmd", "state", "plan", "radio", "0", "-1", "world", "*", "**", "", ".", "..",
                     "clock", "alive", "@adv", "$*", "r1 ", "r1\n", "\x00", "é", "a" * 65]),
    st.text(max_size=8),
)
# fmt: on
KEYS = st.lists(CHUNKS, max_size=7).map("/".join)
PLAN_OF_R1 = encode(Plan(robot="r1", run=0, tick=3, points=[(0.0, 1.0)]))


@given(topic=st.sampled_from(TOPICS), key=KEYS, payload=st.one_of(st.just(PLAN_OF_R1), st.binary(max_size=40)))
def test_any_key_and_payload_is_an_arrival_or_refused(topic: Topic[Any], key: str, payload: bytes) -> None:
    try:
        arrived = decode_item(PREFIX, ("sample", topic, PREFIX + key, payload))
    except PeerError:
        return
    assert isinstance(arrived, Arrival)
    assert PREFIX + topic.key.format(**arrived.ids) == PREFIX + key
    assert all(ID.match(part) for part in arrived.ids.values())


@given(key=KEYS, alive=st.booleans())
def test_any_token_is_a_presence_or_refused(key: str, alive: bool) -> None:
    try:
        arrived = decode_item(PREFIX, ("token", f"{PREFIX}alive/{key}", alive))
    except PeerError:
        return
    assert isinstance(arrived, Presence)
    assert (f"{arrived.role}/{arrived.id}/{arrived.session}", arrived.alive) == (key, alive)


# fmt: off
WRONG = {
    "robot/r1/plan/more": "expected the key",
    "robot/r1":           "expected the key",
    "":                   "expected the key",
    "world/r1/plan":      "expected the key",
    "robot/r1/state":     "expected the key",
    "robot/*/plan":       "expected an id",
    "robot//plan":        "expected an id",
    "robot/r 1/plan":     "expected an id",
    "robot/r1\n/plan":    "expected an id",
    f"robot/{'r' * 65}/plan": "expected an id",
    "robot/r2/plan":      "expected a message of 'r2', got one of 'r1'",
}
# fmt: on


@pytest.mark.parametrize(("key", "says"), WRONG.items())
def test_a_key_that_does_not_fit_its_topic_is_refused(key: str, says: str) -> None:
    with pytest.raises(PeerError, match=says):
        decode_item(PREFIX, ("sample", PLAN, PREFIX + key, PLAN_OF_R1))


NAMES = st.lists(st.one_of(st.sampled_from(["v", "\xa1v", "vv"]), st.text(max_size=2)), max_size=20, unique=True)


@given(names=NAMES)
def test_a_message_without_a_version_is_refused_wherever_the_version_would_be(names: list[str]) -> None:
    fields = dict.fromkeys(names, "v") | {"robot": "r1", "run": 0, "tick": 3, "points": []}
    fields.pop("v", None)
    with pytest.raises(PeerError, match="expected a version, v, got"):
        decode(msgpack.packb(fields), Plan, PLAN.limit)
    for whole in ({"v": 1} | fields, fields | {"v": 1}):
        assert decode(msgpack.packb(whole), Plan, PLAN.limit).tick == 3


def test_the_link_of_another_fleet_is_no_key_of_this_one() -> None:
    with pytest.raises(PeerError, match="expected the key"):
        decode_item(PREFIX, ("sample", PLAN, "swarm/v1/other/robot/r1/plan", PLAN_OF_R1))
    assert decode_item(PREFIX, ("link", False)) == Link(up=False)
