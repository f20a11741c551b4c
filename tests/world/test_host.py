"""What the world makes of arrivals: whom it believes, who leaves, and which other world has come."""

from collections.abc import Iterator
from threading import Event as Flag
from typing import Any
from unittest.mock import Mock

import msgspec
import pytest

from swarm.bus import Arrival, Bus, Link, Presence, Request
from swarm.errors import ConfigError
from swarm.messages import COMMAND, EVENT, JOIN, LEAVE, Event, Join, Leave, Message, Topic
from swarm.secure import Identity
from tests.shared import scenario_of
from world.course import Course
from world.process import Host
from world.world import REST


class Rig:
    """A world of two robots whose arrivals are given by hand."""

    def __init__(self) -> None:
        self.bus = Mock(spec=Bus, id="w", sender=1)
        self.course = Course(self.bus, scenario_of(), 2, 1, "max", 300.0, False, 0, None, lambda line: None)
        self.host = Host(self.bus, self.course, lambda line: None)

    def take(self, *arrived: Any) -> None:  # noqa: ANN401, arrivals
        for one in arrived:
            self.bus.receive.return_value = one
            self.host._receive(0.0)
            self.host._requests.serve(self.host._answer, closed=lambda one: False)

    def ask(self, topic: Topic[Any], message: Message) -> None:
        self.take(Mock(spec=Request, topic=topic, message=message, ids={}))

    def join(self, name: str, sender: int | None) -> None:
        self.ask(JOIN, Join(robot=name, session=f"session-{name}", world=None, sender=sender))
        self.take(Presence("robot", name, f"session-{name}", alive=True))

    def told(self) -> list[tuple[str, str | None]]:
        events: Iterator[Event] = (call.args[1] for call in self.bus.send.call_args_list if call.args[0] is EVENT)
        return [(event.kind, event.robot) for event in events]


def command(sender: int | None, left: float) -> Arrival:
    return Arrival(COMMAND, {"robot": "r1"}, msgspec.structs.replace(REST, left=left), sender)


@pytest.mark.parametrize(("joined", "forged"), [(7, None), (7, 8)])
def test_a_command_in_a_robots_name_by_somebody_else_is_not_carried_out_and_told_once(
    joined: int, forged: int | None
) -> None:
    rig = Rig()
    rig.take(command(forged, 9.0))
    assert (rig.course.last.commands, rig.told()) == ({}, []), "nobody has the place yet"
    rig.join("r1", joined)
    rig.take(command(forged, 9.0), command(joined, 0.1), command(forged, 9.0))
    assert rig.course.last.commands["r1"].left == 0.1
    assert rig.told() == [("impostor", "r1")]


def test_a_robot_that_attaches_nothing_is_believed_as_its_key_says() -> None:
    rig = Rig()
    rig.join("r1", None)
    rig.take(command(None, 0.1))
    assert rig.course.last.commands["r1"].left == 0.1
    assert rig.told() == []


def test_a_robot_has_left_when_its_token_goes() -> None:
    rig = Rig()
    rig.join("r1", 7)
    rig.ask(LEAVE, Leave(robot="r1", session="session-r1"))
    assert (rig.course.lobby.present, rig.told()) == (["r1"], [])
    rig.take(Presence("robot", "r1", "session-r1", alive=False))
    assert (rig.course.lobby.present, rig.told()) == ([], [("left", "r1")])
    assert rig.course.roll.left == {"r1"}


def test_a_run_ends_when_its_keys_have_expired_and_not_when_only_the_router_is_away() -> None:
    expired = ConfigError("keys/world: it expired")
    rig, keys = Rig(), Mock(spec=Identity)
    keys.check.side_effect = [None, None, expired]
    rig.bus.receive.side_effect = [Link(up=False), None, None, AssertionError("it went on")]
    Host(rig.bus, rig.course, lambda line: None, keys).serve(Flag())
    assert rig.course.report()["reason"] == "no router can be reached any more: keys/world: it expired"


def test_another_world_is_told_once_and_this_one_is_none() -> None:
    rig = Rig()
    rig.take(*(Presence("world", "world", session, alive=True) for session in ("w", "x", "x", "y")))
    assert rig.told() == [("rival", None)]
