"""The inbox of a robot's process accepts only a sense that fits its scenario."""

from typing import Any
from unittest.mock import Mock

import msgspec
import pytest

from swarm.bus import Arrival
from swarm.messages import COMMAND, RADIO, SENSE, Sense, Topic
from swarm.robot.process import MOST_NAMED, Inbox
from swarm.robot.radio import Radio
from tests.robot.shared import robot

FITS = Sense(
    run=0, tick=7, time=0.35, lockstep=True, x=2.5, y=3.5, yaw=0.0, linear=0.0, angular=0.0,
    left=1.6, front=1.6, right=1.6, bearings=[None] * 4, hears=[], rays=[1.6] * 15,
)  # fmt: skip


def inbox() -> tuple[Inbox, Mock, list[str]]:
    radio, said = Mock(spec=Radio), list[str]()
    return Inbox(robot(), radio, said.append), radio, said


def arrival(topic: Topic[Any], message: object) -> Arrival:
    return Arrival(topic, {"robot": "r2"}, message)


def test_a_sense_that_fits_is_taken_and_a_broadcast_is_put_away() -> None:
    one, radio, said = inbox()
    assert one.sort(arrival(SENSE, FITS)) is FITS
    assert one.sort(arrival(RADIO, "words")) is None
    radio.take.assert_called_once_with("words")
    assert one.sort(arrival(COMMAND, FITS)) is None
    assert one.sort(None) is None
    assert said == []


@pytest.mark.parametrize(
    ("field", "count", "expected"), [("rays", 0, 15), ("rays", 14, 15), ("rays", 16, 15), ("bearings", 3, 4)]
)
def test_a_sense_of_another_scenario_is_dropped_and_named_once(field: str, count: int, expected: int) -> None:
    one, _, said = inbox()
    other = msgspec.structs.replace(FITS, **{field: [1.0] * count})
    assert [one.sort(arrival(SENSE, other)) for _ in range(3)] == [None] * 3
    assert len(said) == 1
    assert f"r2: tick 7: the sense was dropped: {field}: expected {expected}, got {count};" in said[0]
    assert one.sort(arrival(SENSE, FITS)) is FITS, "the next good one is taken"


def test_a_flood_of_wrong_senses_fills_no_log() -> None:
    one, _, said = inbox()
    for count in range(20, 20 + 3 * MOST_NAMED):
        assert one.sort(arrival(SENSE, msgspec.structs.replace(FITS, rays=[1.0] * count))) is None
    assert len(said) == MOST_NAMED
