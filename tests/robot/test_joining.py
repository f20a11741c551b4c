"""Joining a world: asked again and again, kept through the world's absence, and started over only in another world."""

from typing import Any
from unittest.mock import Mock

import msgspec
import pytest

from swarm.awake import Awake
from swarm.bus import Arrival, Bus, Link, Presence
from swarm.errors import PeerError
from swarm.messages import COMMAND, JOIN, SENSE, Topic, Welcome
from swarm.robot.process import ECHOES, FIRST, LONGEST, Crew, Place
from tests.robot.shared import AT, FITS, scenario


def welcome(name: str = "r1", world: str = "w", session: str = "s") -> Welcome:
    settings, packed = scenario().to_wire()
    return Welcome(
        robot=name, world=world, session=session, scenario=settings, packed=packed, edits=0,
        start=(AT.x, AT.y, AT.yaw), state=None,
    )  # fmt: skip


class Ship:
    """A crew on a bus that only records; the world's answers are given by hand."""

    def __init__(self, *names: str | None) -> None:
        self.bus = Mock(spec=Bus, id="me")
        self.said: list[str] = []  # all but the joins
        self.joined: list[str] = []
        self.crew = Crew(self.bus, names or ("r1",), self.log)

    def log(self, line: str) -> None:
        (self.joined if line.startswith("joined as ") else self.said).append(line)

    def world(self, session: str, alive: bool = True) -> None:
        self.crew._take(Presence("world", "world", session, alive), 0.0)

    def hear(self, topic: Topic[Any], message: Any, sender: int | None = None) -> None:  # noqa: ANN401
        """Let a message arrive."""
        self.crew._take(Arrival(topic, {}, message, sender), 0.0)

    def join(self, *answers: Welcome | PeerError) -> list[Any]:
        """Let everybody ask who wants to, once for each answer; return what was asked."""
        self.bus.ask.side_effect = list(answers)
        before = self.bus.ask.call_count
        for _ in answers:
            place = self.crew._to_join(1e9)
            if place is None:
                break
            self.crew._join(place)
        return [call.args[1] for call in self.bus.ask.call_args_list[before:]]


def test_the_pauses_between_attempts_grow_to_a_bound_and_end_when_a_world_comes() -> None:
    place = Place("r1")
    now, pauses = 0.0, []
    for _ in range(9):
        place.refused("no", now)
        before = now
        while not place.due(now):
            now += FIRST / 10
        pauses.append(now - before)
    assert pauses == pytest.approx([0.1, 0.2, 0.4, 0.8, 1.6, 3.2, 5.0, 5.0, 5.0], abs=0.02)
    assert pauses[-1] == pytest.approx(LONGEST, abs=0.02)
    place.refused("no", now)
    place.hurry()
    assert place.due(now)


def test_nobody_asks_where_no_world_is_and_each_refusal_is_told_once() -> None:
    ship = Ship()
    assert ship.crew._to_join(1e9) is None
    ship.world("s")
    ship.join(PeerError("no place"), PeerError("no place"), PeerError("no answer"), PeerError("no place"), welcome())
    assert ship.said == ["r1: no place; it asks again and again", "r1: no answer; it asks again and again"]
    ship.bus.announce.assert_called_once_with("robot", "r1")
    assert ship.crew._to_join(1e9) is None


def test_a_robot_keeps_its_seat_when_its_world_comes_back_as_another_process() -> None:
    ship = Ship()
    ship.world("s")
    (first,) = ship.join(welcome())
    seat = ship.crew._inbox.seats["r1"]
    ship.world("s", alive=False)
    assert ship.crew._to_join(1e9) is None, "no world"
    ship.world("t")
    (asked,) = ship.join(welcome(session="t"))
    assert ship.crew._inbox.seats["r1"] is seat
    assert (first.world, first.session) == (None, "me")
    assert (asked.robot, asked.world) == ("r1", "w")
    ship.bus.withdraw.assert_not_called()


def test_a_robot_does_not_even_ask_when_only_the_router_was_away() -> None:
    ship = Ship()
    ship.world("s")
    ship.join(welcome())
    ship.world("s", alive=False)
    ship.world("s")
    assert ship.crew._to_join(1e9) is None


def test_in_another_world_all_robots_of_a_process_start_over() -> None:
    ship = Ship("r1", "r2")
    ship.world("s")
    ship.join(welcome("r1"), welcome("r2"))
    seats = dict(ship.crew._inbox.seats)
    ship.world("s", alive=False)
    ship.world("t")
    asked = ship.join(*(welcome(name, "another", "t") for name in ("r1", "r2")))
    assert [(one.robot, one.world) for one in asked] == [("r1", "w"), ("r2", None)]
    assert all(ship.crew._inbox.seats[name] is not seat for name, seat in seats.items())
    assert [call.args for call in ship.bus.withdraw.call_args_list] == [("robot", "r1"), ("robot", "r2")]


def test_only_the_answer_of_a_world_that_has_a_token_fits() -> None:
    ship = Ship()
    ship.world("s")
    ship.join(welcome())
    fits = ship.bus.ask.call_args.kwargs["fits"]
    assert ship.bus.ask.call_args.args[0] is JOIN
    assert (fits(welcome()), fits(welcome(session="forged"))) == (True, False)


def test_a_sense_for_a_place_that_is_lost_and_one_of_another_world_are_dropped() -> None:
    ship = Ship()
    ship.world("s")
    ship.join(welcome(world="local"))
    ship.crew._take(Arrival(SENSE, {"robot": "r9"}, FITS), 0.0)
    assert ship.crew._inbox.waiting == {}
    ship.crew._take(Arrival(SENSE, {"robot": "r1"}, FITS), 0.0)
    assert list(ship.crew._inbox.waiting) == ["r1"]


def test_a_sense_in_the_worlds_name_by_somebody_else_is_dropped_and_named_once() -> None:
    ship = Ship()
    ship.world("s")
    (asked,) = ship.join(msgspec.structs.replace(welcome(world="local"), sender=7))
    assert asked.sender == ship.bus.sender
    for sender in (None, 8, 8):
        ship.crew._take(Arrival(SENSE, {"robot": "r1"}, FITS, sender), 0.0)
    assert ship.crew._inbox.waiting == {}
    assert ship.said == ["r1: a sense was dropped: it is of somebody else in the world's name"]
    ship.world("s", alive=False)
    ship.world("t")
    ship.join(msgspec.structs.replace(welcome(world="local", session="t"), sender=8))
    ship.crew._take(Arrival(SENSE, {"robot": "r1"}, FITS, 8), 0.0)
    assert list(ship.crew._inbox.waiting) == ["r1"], "its world came back as another process"


def test_a_repeated_sense_is_answered_at_once_though_a_newer_one_waits() -> None:
    ship = Ship()
    ship.world("s")
    ship.join(welcome(world="local"))
    seat = ship.crew._inbox.seats["r1"]
    seat.take(FITS)
    given = seat.answer(list)
    ship.crew._take(Arrival(SENSE, {"robot": "r1"}, FITS), 0.0)
    sent = [call.args[1] for call in ship.bus.send.call_args_list]
    assert given.outputs.command in sent
    assert ship.crew._inbox.waiting == {}


def test_after_the_router_is_back_the_last_answers_are_said_again_for_a_while() -> None:
    ship, clock = Ship(), [0.0]
    ship.crew._awake = Awake(lambda: clock[0])
    ship.world("s")
    ship.join(welcome(world="local"))
    seat = ship.crew._inbox.seats["r1"]
    seat.take(FITS)
    given = seat.answer(list)
    ship.bus.send.reset_mock()
    arrivals = iter([Link(up=True)])

    def receive(wait: float) -> Link | None:
        clock[0] += wait
        return next(arrivals, None)

    ship.bus.receive = receive
    ship.crew.serve(Mock(is_set=lambda: clock[0] > ECHOES[-1] + 1.0))
    commands = [call.args[1] for call in ship.bus.send.call_args_list if call.args[0] is COMMAND]
    assert commands == [given.outputs.command] * len(ECHOES)
