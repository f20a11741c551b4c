"""What the world makes of arrivals: whom it believes, who leaves, and which other world has come."""

from collections.abc import Iterator
from contextlib import suppress
from threading import Event as Flag
from typing import Any
from unittest.mock import Mock

import msgspec
import pytest

from swarm.bus import Arrival, Bus, Link, Presence
from swarm.errors import ConfigError
from swarm.messages import (
    COMMAND,
    EDIT,
    EVENT,
    JOIN,
    LEAVE,
    ORDER,
    SENSE,
    Activity,
    Edit,
    Event,
    Join,
    Kind,
    Leave,
    Message,
    Order,
    Phase,
    Topic,
)
from swarm.secure import Identity
from swarm.settings import Pace
from swarm.suspend_clock import Awake
from tests.world.shared import request_of, run_of, step
from world.host.process import LOOK, Host
from world.tasks.tasks import REST


class DrainedError(Exception):
    """Nothing arrives any more."""


class Rig:
    """A world of two robots whose arrivals are given by hand."""

    def __init__(self, pace: Pace = "max") -> None:
        self.bus = Mock(spec=Bus, id="w", sender=1)
        self.bus.query_announced.return_value = []
        self.run = run_of(bus=self.bus, pace=pace)
        self.host = Host(self.bus, self.run, lambda line: None)

    def take(self, *arrived: Any) -> None:  # noqa: ANN401, arrivals
        """Let these arrive, one after the other, while the world waits for its robots."""
        self.bus.receive.side_effect = [*arrived, DrainedError]
        with suppress(DrainedError):
            self.host.serve(Flag())

    def ask(self, topic: Topic[Any], message: Message, **ids: str) -> Mock:
        self.take(request := request_of(topic, message, **ids))
        return request

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
    assert (rig.run.last.commands, rig.told()) == ({}, []), "nobody has the place yet"
    rig.join("r1", joined)
    rig.take(command(forged, 9.0), command(joined, 0.1), command(forged, 9.0))
    assert rig.run.last.commands["r1"].left == 0.1
    assert rig.told() == [("impostor", "r1")]


def test_a_robot_that_attaches_nothing_is_believed_as_its_key_says() -> None:
    rig = Rig()
    rig.join("r1", None)
    rig.take(command(None, 0.1))
    assert rig.run.last.commands["r1"].left == 0.1
    assert rig.told() == []


def test_a_robot_has_left_when_its_token_goes() -> None:
    rig = Rig()
    rig.join("r1", 7)
    rig.ask(LEAVE, Leave(robot="r1", session="session-r1"))
    assert (rig.run.membership.present, rig.told()) == (["r1"], [])
    rig.take(Presence("robot", "r1", "session-r1", alive=False))
    assert (rig.run.membership.present, rig.told()) == ([], [("left", "r1")])
    assert rig.run.liveliness.left == {"r1"}


def test_a_robot_whose_token_came_before_the_old_links_end_is_asked_for() -> None:
    """Zenoh tells tokens and links by threads of their own, so either may be first."""
    rig, now = Rig(), [0.0]
    rig.run.awake = Awake(lambda: now[0])
    rig.join("r1", 7)
    rig.bus.query_announced.return_value = [
        Presence("robot", name, f"session-{name}", alive=True) for name in ("r1", "r2", "r9")
    ]
    rig.take(Presence("robot", "r1", "session-r1", alive=True), Link(up=False), Link(up=True))
    assert (rig.run.membership.present, rig.run.membership.robots_awaited) == ([], ["r1"])
    rig.bus.query_announced.assert_not_called()
    for now[0] in (1.0, 2.0):
        rig.take(None)
        rig.bus.query_announced.assert_not_called()
    now[0] += 0.5
    rig.take(None, None)
    rig.bus.query_announced.assert_called_once_with("robot", LOOK)
    assert (rig.run.membership.present, rig.told()) == (["r1"], []), "r2 has not joined, and there is no r9"


def test_a_run_ends_when_its_keys_have_expired_and_not_when_only_the_router_is_away() -> None:
    expired = ConfigError("keys/world: it expired")
    rig, keys = Rig(), Mock(spec=Identity)
    keys.check.side_effect = [None, None, expired]
    rig.bus.receive.side_effect = [Link(up=False), None, None, AssertionError("it went on")]
    Host(rig.bus, rig.run, lambda line: None, keys).serve(Flag())
    assert rig.run.report()["reason"] == "no router can be reached any more: keys/world: it expired"


def test_another_world_is_told_once_and_this_one_is_none() -> None:
    rig = Rig()
    rig.take(*(Presence("world", "world", session, alive=True) for session in ("w", "x", "x", "y")))
    assert rig.told() == [("rival", None)]


# --- within a tick ---

WALL = Edit(kind=Kind.WALL, low=(8.2, 1.2), high=(8.8, 1.8))
SPEED = 0.72  # m/s; a robot stops within 0.3 m, but not a tick later


def test_in_lockstep_a_change_waits_for_the_end_of_the_tick_and_a_robot_that_comes_does_not() -> None:
    rig = Rig()
    rig.run.in_tick = True
    edit = rig.ask(EDIT, WALL)
    rig.join("r1", 7)
    assert (edit.mock_calls, rig.run.membership.present) == ([], ["r1"])
    rig.run.in_tick = False
    rig.take(None)
    edit.accept.assert_called_once()


def test_in_real_time_an_order_waits_while_its_robot_is_at_a_stop_that_does_not_count_yet() -> None:
    rig = Rig(pace=1.0)
    world = rig.run.world
    world.request("r1", Order(id="here", targets=[world.poses()[0][:2]]))
    rig.run.in_tick = True
    waits, answered = (rig.ask(ORDER, Order(id="a", targets=[(7.5, 3.5)]), robot=name) for name in ("r1", "r2"))
    assert (waits.mock_calls, len(answered.mock_calls)) == ([], 1)
    rig.run.step()
    rig.take(None)
    waits.accept.assert_called_once()
    assert [one.fate for one in world.tasks.missions.history(0)] == ["superseded", "done", "open"]


@pytest.mark.parametrize(("in_tick", "refused"), [(False, False), (True, True)])
def test_an_edit_after_the_robots_have_sensed_reaches_them_a_tick_later(in_tick: bool, refused: bool) -> None:
    """A robot that drives towards it needs more room to stop."""
    rig = Rig(pace=1.0)
    rig.run.world.bodies.wheels[0] = (SPEED, SPEED)
    rig.run.in_tick = in_tick
    edit = rig.ask(EDIT, Edit(kind=Kind.WALL, low=(3.1, 2.1), high=(3.9, 2.9)))
    assert edit.refuse.called is refused
    assert edit.accept.called is not refused


@pytest.mark.parametrize(
    ("ends", "begun", "over"), [(None, [0.0], 0.05), ("the tick", [0.0, 0.04], 0.09), ("the process", [0.0], 0.04)]
)
def test_time_is_let_pass_until_it_is_over_or_the_tick_or_the_process_ends(
    ends: str | None, begun: list[float], over: float
) -> None:
    """In lockstep, while only robots that are absent have stops left: hours would be over before they are back."""
    rig, stop, now, times = Rig(), Flag(), [0.0], list[float]()
    rig.join("r1", 7)
    rig.run.awake = Awake(lambda: now[0])
    rig.run.go_to(Phase.RUNNING)
    step(rig.run, r1={"activity": Activity.DONE, "unreachable": [0, 1]})

    def receive(timeout: float) -> None:
        if timeout == LOOK:
            raise DrainedError  # it waits for the command of r1
        now[0] += min(timeout, 0.02)
        if 0.03 < now[0] < 0.05 and ends == "the tick":
            rig.run.in_tick = False
        if now[0] > 0.03 and ends == "the process":
            stop.set()

    def send(topic: Topic[Any], message: Message, **ids: str) -> None:
        times.extend([now[0]] * (topic is SENSE))

    rig.bus.receive.side_effect, rig.bus.send.side_effect = receive, send
    with suppress(DrainedError):
        rig.host.serve(stop)
    assert times == pytest.approx(begun)
    assert now[0] == pytest.approx(over)
