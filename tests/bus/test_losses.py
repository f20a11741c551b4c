"""What was lost is counted from the numbers of each sender: no more, and no less."""

from collections import Counter

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.msgpack import decode, encode

from swarm.bus import losses as module
from swarm.bus.losses import FARTHEST, Gaps, Ledger, Numbers
from swarm.errors import PeerError


def numbered(sender: int, number: int) -> bytes:
    return encode((sender, number))


@given(st.lists(st.booleans(), min_size=1, max_size=60))
def test_what_is_lost_between_two_that_come_is_counted(comes: list[bool]) -> None:
    sender, listener = Numbers(), Gaps()
    attached = [sender.attachment("key") for _ in comes]
    lost = sum(listener.count_lost("key", one) for one, came in zip(attached, comes, strict=True) if came)
    first, last = (comes.index(True), len(comes) - comes[::-1].index(True)) if True in comes else (0, 0)
    assert lost == comes[first:last].count(False)


@given(st.lists(st.tuples(st.sampled_from("ab"), st.booleans()), max_size=60))
def test_keys_are_counted_apart(sent: list[tuple[str, bool]]) -> None:
    together, alone = Gaps(), {"a": Gaps(), "b": Gaps()}
    sender, lost, expected = Numbers(), Counter[str](), Counter[str]()
    for key, came in sent:
        attached = sender.attachment(key)
        if came:
            lost[key] += together.count_lost(key, attached)
            expected[key] += alone[key].count_lost(key, attached)
    assert lost == expected


@pytest.mark.parametrize(
    ("come", "lost"),
    [
        ([(7, 40)], 0),  # a late listener
        ([(7, 40), (7, 41)], 0),
        ([(7, 40), (7, 44)], 3),
        ([(7, 40), (8, 0)], 0),  # the sender has started again
        ([(7, 40), (8, 5), (8, 7)], 1),
        ([(7, 40), (7, 40), (7, 41)], 0),  # sent twice
        ([(7, 40), (7, 42), (7, 41), (7, 43)], 1),  # late: it had been counted as lost
        ([(7, 0), (7, FARTHEST)], FARTHEST - 1),
        ([(7, 0), (7, FARTHEST + 1), (7, FARTHEST + 3)], 1),  # too far to be a gap
        ([(7, 0), (7, 2**53), (7, 1), (7, 3)], 1),  # a wrong number: only the gap after it is real
    ],
)
def test_a_sequence_of_numbers(come: list[tuple[int, int]], lost: int) -> None:
    listener = Gaps()
    assert sum(listener.count_lost("key", numbered(*one)) for one in come) == lost


def test_a_message_without_a_number_changes_nothing() -> None:
    listener = Gaps()
    assert [listener.count_lost("key", one) for one in (numbered(1, 1), None, numbered(1, 3))] == [0, 0, 1]


@pytest.mark.parametrize(
    "attached",
    [b"", b"\xff", encode([1]), encode([1, 2, 3]), encode([1, -1]), encode([2**32, 1]), encode(["a", 1]), b"\x92" * 99],
)
def test_an_attachment_that_is_no_sequence_is_refused(attached: bytes) -> None:
    with pytest.raises(PeerError, match="key: attachment: expected"):
        Gaps().count_lost("key", attached)


def test_keys_without_end_do_not_fill_the_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MOST", 3)
    listener = Gaps()
    for key in "abcd":
        listener.count_lost(key, numbered(1, 0))
    assert listener.count_lost("a", numbered(1, 9)) == 0, "it was forgotten"
    assert listener.count_lost("d", numbered(1, 9)) == 8


def test_the_key_silent_longest_is_forgotten_first(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MOST", 2)
    listener = Gaps()
    for key, number in (("a", 0), ("b", 0), ("a", 1), ("c", 0)):
        listener.count_lost(key, numbered(1, number))
    assert listener.count_lost("a", numbered(1, 4)) == 2
    assert listener.count_lost("b", numbered(1, 4)) == 0, "it was forgotten"


def test_two_senders_have_different_numbers_of_their_own() -> None:
    one, other = (decode(Numbers().attachment("key")) for _ in range(2))
    assert one[0] != other[0]
    assert one[1] == other[1] == 0


def test_losses_are_counted_in_full_and_logged_once_a_second(monkeypatch: pytest.MonkeyPatch) -> None:
    now, said = 50.0, list[str]()
    monkeypatch.setattr(module, "monotonic", lambda: now)
    one = Ledger(said.append)
    one.miss("robot/{robot}/state", "swarm/v1/f/robot/r1/state", 1)
    one.miss("robot/{robot}/state", "swarm/v1/f/robot/r1/state", 2)
    one.miss("world/event", "swarm/v1/f/world/event", 4)
    now += 1.5
    one.flush()
    one.flush()
    assert one.lost.counts == {"robot/{robot}/state": 3, "world/event": 4}
    advice = "this process or the network is too slow: fewer robots or a lower --pace"
    assert said == [
        f"1 message lost on the way; the last gap: 1 message on swarm/v1/f/robot/r1/state; {advice}",
        f"6 messages lost on the way; the last gap: 4 messages on swarm/v1/f/world/event; {advice}",
    ]
