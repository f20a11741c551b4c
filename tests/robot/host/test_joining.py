"""Joining a world: asked again and again, kept through the world's absence, and started over only in another world."""

from typing import Any
from unittest.mock import Mock

import pytest
from msgspec.structs import replace

from swarm.bus import Arrival, Bus, Link, Presence
from swarm.errors import PeerError
from swarm.messages import CLOCK, COMMAND, JOIN, SENSE, Clock, Command, Phase, Took, Topic, Welcome
from swarm.robot.host.membership import FIRST, LONGEST, UNSEEN, SeatRequest
from swarm.robot.host.process import ECHOES, RobotHost
from swarm.scenario.load import Scenario
from swarm.suspend_clock import Awake
from tests.robot.shared import AT, FITS, STOPS, scenario


def welcome(name: str = "r1", world: str = "w", session: str = "s") -> Welcome:
    settings, packed = scenario().to_wire()
    return Welcome(
        robot=name, world=world, session=session, scenario=settings, packed=packed, edits=0,
        start=(AT.x, AT.y, AT.yaw), state=None,
    )  # fmt: skip


class Ship:
    """A host on a bus that only records; what arrives, the world's answers and the time are given by hand."""

    def __init__(self, *names: str | None) -> None:
        self.bus = Mock(spec=Bus, id="me", receive=self.receive)
        self.bus.other_wires.return_value = []
        self.said: list[str] = []  # all but the joins
        self.joined: list[str] = []
        self.arrivals: list[Arrival | Link | Presence] = []
        self.now, self.until = 0.0, 0.0  # s
        self.host = RobotHost(self.bus, names or ("r1",), self.log, awake=Awake(lambda: self.now))

    def log(self, line: str) -> None:
        (self.joined if line.startswith("joined as ") else self.said).append(line)

    def receive(self, wait: float) -> Arrival | Link | Presence | None:
        self.now += 0.0 if self.arrivals else wait
        return self.arrivals.pop(0) if self.arrivals else None

    def serve(self, *arrivals: Arrival | Link | Presence, seconds: float = 0.0, asks: int | None = None) -> None:
        """Let messages arrive, and the host do what there is to do for some time, or until it has asked so often."""
        self.arrivals += arrivals
        until, ask = self.now + seconds, self.bus.ask
        self.host.serve(Mock(is_set=lambda: self.now > until or ask.call_count == asks))

    def world(self, session: str, alive: bool = True) -> None:
        """Let a world come or go, as the first thing that the host notices when it serves again."""
        self.arrivals.append(Presence("world", "world", session, alive))

    def hear(self, topic: Topic[Any], message: Any, sender: int | None = None, robot: str = "r1") -> list[Command]:  # noqa: ANN401
        """Let a message arrive; return the commands that are sent then."""
        self.bus.send.reset_mock()
        self.serve(Arrival(topic, {"robot": robot}, message, sender))
        return self.commands

    @property
    def commands(self) -> list[Command]:
        return [call.args[1] for call in self.bus.send.call_args_list if call.args[0] is COMMAND]

    def join(self, *answers: Welcome | PeerError) -> list[Any]:
        """Let everybody ask who wants to, once for each answer; return what was asked."""
        before = self.bus.ask.call_count
        self.bus.ask.side_effect = list(answers)
        self.serve(seconds=10.0, asks=before + len(answers))
        return [call.args[1] for call in self.bus.ask.call_args_list[before:]]


def test_the_pauses_between_attempts_grow_to_a_bound_and_end_when_a_world_comes() -> None:
    place = SeatRequest("r1")
    now, pauses = 0.0, []
    for _ in range(9):
        place.take_refusal("no", now)
        before = now
        while not place.due(now):
            now += FIRST / 10
        pauses.append(now - before)
    assert pauses == pytest.approx([0.1, 0.2, 0.4, 0.8, 1.6, 3.2, 5.0, 5.0, 5.0], abs=0.02)
    assert pauses[-1] == pytest.approx(LONGEST, abs=0.02)
    place.take_refusal("no", now)
    place.ask_at_once()
    assert place.due(now)


def test_nobody_asks_where_no_world_is_and_each_refusal_is_told_once() -> None:
    ship = Ship()
    assert ship.join(welcome()) == []
    ship.world("s")
    ship.join(PeerError("no place"), PeerError("no place"), PeerError("no answer"), PeerError("no place"), welcome())
    assert ship.said == ["r1: no place; it asks again and again", "r1: no answer; it asks again and again"]
    ship.bus.announce.assert_called_once_with("robot", "r1")
    assert ship.join(welcome()) == [], "it has its place"


SENSE_ = replace(FITS, world="w")
AT_STOP = replace(SENSE_, x=STOPS[0][0], y=STOPS[0][1])


def test_a_robot_keeps_its_memory_when_its_world_comes_back_as_another_process() -> None:
    ship = Ship()
    ship.world("s")
    (first,) = ship.join(welcome())
    ship.hear(SENSE, AT_STOP)
    ship.world("s", alive=False)
    assert ship.join(welcome()) == [], "no world"
    ship.world("t")
    (asked,) = ship.join(welcome(session="t"))
    assert (first.world, first.session) == (None, "me")
    assert (asked.robot, asked.world) == ("r1", "w")
    assert ship.hear(SENSE, replace(SENSE_, tick=8))[0].reached[0]
    ship.bus.withdraw.assert_not_called()


def test_a_robot_does_not_even_ask_when_only_the_router_was_away() -> None:
    ship = Ship()
    ship.world("s")
    ship.join(welcome())
    ship.world("s", alive=False)
    ship.world("s")
    assert ship.join(welcome()) == []


LEFT_OUT = Clock(run=0, tick=100, time=5.0, phase=Phase.RUNNING, robots=["r1"], present=[])


def test_a_robot_that_its_world_does_not_see_announces_itself_anew() -> None:
    ship = Ship()

    def left_out(seconds: float) -> int:
        """Let the clock leave it out for some time; return how often it has announced itself so far."""
        until = ship.now + seconds
        while ship.now < until:
            ship.hear(CLOCK, LEFT_OUT)
            ship.serve(seconds=0.5)
        return len(ship.bus.announce.call_args_list)

    ship.world("s")
    ship.join(welcome())
    ship.bus.ask.side_effect = lambda *_, **__: welcome()
    assert left_out(3 * UNSEEN) == 1, "the world has not come to it yet"
    ship.hear(CLOCK, replace(LEFT_OUT, present=["r1"]))
    assert left_out(0.8 * UNSEEN) == 1
    ship.hear(CLOCK, replace(LEFT_OUT, present=["r1"]))
    assert left_out(0.8 * UNSEEN) == 1
    assert ship.said == []
    ship.bus.withdraw.assert_not_called()
    assert left_out(0.6 * UNSEEN) == 2
    ship.bus.withdraw.assert_called_once_with("robot", "r1")
    assert ship.said == ["r1: the world does not see this process; it joins once more"]
    assert left_out(1.5 * UNSEEN) == 2, "it is more patient each time"
    assert left_out(1.5 * UNSEEN) == 3


def test_in_another_world_all_robots_of_a_process_start_over() -> None:
    ship, names = Ship("r1", "r2"), ("r1", "r2")
    ship.world("s")
    ship.join(*map(welcome, names))
    for name in names:
        ship.hear(SENSE, AT_STOP, robot=name)
    ship.world("s", alive=False)
    ship.world("t")
    asked = ship.join(*(welcome(name, "another", "t") for name in names))
    assert [(one.robot, one.world) for one in asked] == [("r1", "w"), ("r2", None)]
    for name in names:
        (command,) = ship.hear(SENSE, replace(FITS, world="another", tick=8), robot=name)
        assert not command.reached[0]
    assert [call.args for call in ship.bus.withdraw.call_args_list] == [("robot", "r1"), ("robot", "r2")]


def test_only_the_answer_of_a_world_that_has_a_token_fits() -> None:
    ship = Ship()
    ship.world("s")
    ship.join(welcome())
    fits = ship.bus.ask.call_args.kwargs["fits"]
    assert ship.bus.ask.call_args.args[0] is JOIN
    assert (fits(welcome()), fits(welcome(session="forged"))) == (True, False)


def test_all_robots_of_a_process_share_what_the_world_told_each_of_them_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    unpacked = Mock(side_effect=Scenario.from_wire)
    monkeypatch.setattr(Scenario, "from_wire", unpacked)
    ship = Ship(None, None, "r3")
    ship.world("s")
    asked = ship.join(welcome("r1"), welcome("r2"), replace(welcome("r3"), edits=1))
    assert unpacked.call_count == 2, "an edit came between the second and the third"
    assert [one.robot for one in asked] == [None, None, "r3"]
    assert [call.args for call in ship.bus.announce.call_args_list] == [("robot", name) for name in ("r1", "r2", "r3")]


def test_a_sense_for_a_place_that_is_lost_and_one_of_another_world_are_dropped() -> None:
    ship = Ship()
    ship.world("s")
    ship.join(welcome())
    assert ship.hear(SENSE, SENSE_, robot="r9") == []
    assert ship.hear(SENSE, replace(SENSE_, world="another")) == []
    assert [command.tick for command in ship.hear(SENSE, SENSE_)] == [SENSE_.tick]


def test_a_sense_in_the_worlds_name_by_somebody_else_is_dropped_and_named_once() -> None:
    ship = Ship()
    ship.world("s")
    (asked,) = ship.join(replace(welcome(), sender=7))
    assert asked.sender == ship.bus.sender
    assert [ship.hear(SENSE, SENSE_, sender) for sender in (None, 8, 8)] == [[], [], []]
    assert ship.said == ["r1: a sense was dropped: it is of somebody else in the world's name"]
    ship.world("s", alive=False)
    ship.world("t")
    ship.join(replace(welcome(session="t"), sender=8))
    assert len(ship.hear(SENSE, SENSE_, 8)) == 1, "its world came back as another process"


def test_a_repeated_sense_is_answered_at_once_though_a_newer_one_waits() -> None:
    ship = Ship()
    ship.world("s")
    ship.join(welcome())
    (given,) = ship.hear(SENSE, SENSE_)
    assert ship.hear(SENSE, replace(SENSE_, tick=8, hears=[("r9", 8)])) == [], "that broadcast is not here"
    (again,) = ship.hear(SENSE, SENSE_)
    assert given.took is None
    assert again == replace(given, took=Took(heard=[], again=True)), "it says so: a tape tells the two apart"


def test_after_the_router_is_back_the_last_answers_are_said_again_for_a_while() -> None:
    ship = Ship()
    ship.world("s")
    ship.join(welcome())
    given = ship.hear(SENSE, SENSE_)
    ship.bus.send.reset_mock()
    ship.serve(Link(up=True), seconds=ECHOES[-1] + 1.0)
    assert ship.commands == given * len(ECHOES)


def test_a_world_of_another_wire_is_named_once_a_minute() -> None:
    ship = Ship()
    ship.serve(seconds=10.0)
    assert ship.said == []
    ship.bus.other_wires.return_value = ["v2", "v3"]
    ship.serve(seconds=50.0)
    assert ship.said == [
        "expected a world of wire v1, got one of v2, v3; install the zenoh-swarm that it has, `swarm --version` says "
        "which; this process goes on waiting"
    ]
    ship.serve(seconds=60.0)
    assert len(ship.said) == 2
    ship.bus.other_wires.reset_mock()
    ship.world("s")
    assert ship.join(welcome()) != []
    ship.serve(seconds=100.0)
    assert not ship.bus.other_wires.called
