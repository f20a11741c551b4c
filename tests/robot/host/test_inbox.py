"""The inbox of a process: broadcasts go to its receiver, each sense to the robot of its key; who waits longest is next."""

from typing import Any
from unittest.mock import Mock

import msgspec

from swarm.bus import Arrival, Link
from swarm.messages import COMMAND, RADIO, SENSE, Sense, Topic
from swarm.robot.host.process import Inbox
from swarm.robot.host.radio import Radio, Receiver
from swarm.robot.host.seat import Seat
from tests.robot.shared import FITS, robot

MISFIT = msgspec.structs.replace(FITS, rays=[])


def inbox(*names: str) -> Inbox:
    """Return an inbox of robots that hear nothing."""
    one = Inbox(Mock(spec=Radio, arrived={}))
    for name in names:
        one.seats[name] = Seat(robot(name), Receiver(one.radio, 10.0), 3, lambda line: None)
    return one


def arrival(name: str, topic: Topic[Any] = SENSE, message: object = FITS) -> Arrival:
    return Arrival(topic, {"robot": name}, message)


def lacking(sense: Sense) -> Sense:
    return msgspec.structs.replace(sense, hears=[("r9", 8)])


def test_a_sense_goes_to_the_robot_of_its_key_and_a_broadcast_to_the_receiver() -> None:
    one = inbox("r1", "r2")
    one.sort(arrival("r2"))
    one.sort(arrival("r9", RADIO, "words"))
    one.sort(arrival("r1", COMMAND))
    one.sort(Link(up=True))
    assert one.radio.take.call_args.args == ("words",)  # type: ignore[attr-defined]
    assert list(one.waiting) == ["r2"]
    assert one.seats["r2"].sense is FITS
    assert one.ready(0.0) is one.seats["r2"]
    assert one.ready(0.0) is None


def test_who_waits_longest_is_next_and_a_newer_sense_does_not_send_it_back() -> None:
    one = inbox("r1", "r2", "r3")
    for name in ("r2", "r3", "r1"):
        one.sort(arrival(name))
    newer = msgspec.structs.replace(FITS, tick=FITS.tick + 1)
    one.sort(arrival("r2", message=newer))
    assert one.seats["r2"].sense is newer
    assert [one.ready(0.0) for _ in range(4)] == [one.seats["r2"], one.seats["r3"], one.seats["r1"], None]


def test_who_lacks_a_broadcast_lets_the_others_pass_and_stays() -> None:
    one = inbox("r1", "r2")
    one.sort(arrival("r1", message=lacking(FITS)))
    one.sort(arrival("r2"))
    assert one.ready(0.0) is one.seats["r2"]
    assert one.ready(0.0) is None
    assert list(one.waiting) == ["r1"]


def test_a_sense_that_does_not_fit_keeps_nobody_waiting() -> None:
    one = inbox("r1", "r2")
    one.sort(arrival("r1", message=MISFIT))
    assert list(one.waiting) == []
    one.sort(arrival("r1"))
    one.sort(arrival("r1", message=MISFIT))
    assert one.seats["r1"].sense is FITS, "the good one is not lost"
