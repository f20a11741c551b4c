"""The line of requests: bounded, first come first served, and a share of each tick."""

from math import inf
from typing import Any
from unittest.mock import Mock

import pytest
from msgspec import Struct

from swarm.bus import Request
from swarm.messages import (
    ACTION,
    EDIT,
    JOIN,
    Edit,
    Kind,
    Message,
    Order,
    Places,
    PoolTargets,
    RobotAction,
    RobotDo,
    Topic,
)
from tests.shared import mostly_long
from world.host import requests
from world.host.requests import SHARE, WAIT, Closed, Requests, waits_in_tick

DT = 0.05  # s


def always_open(request: Request) -> bool:
    return False


def in_lockstep(request: Request) -> bool:
    return waits_in_tick(request, lockstep=True, is_there=lambda robot: False)


def request(topic: Topic[Any] = EDIT) -> Any:  # noqa: ANN401
    return Mock(spec=Request, topic=topic)


class Desk:
    """Answers requests, each of which takes some time of a clock that is moved by hand."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, seconds: float) -> None:
        self.now, self.seconds = 0.0, seconds
        self.elsewhere = 0.0  # s in which the machine did something else
        self.answered: list[Any] = []
        self.waiting = 0
        monkeypatch.setattr(requests, "perf_counter", lambda: self.now)
        monkeypatch.setattr(requests, "thread_time", lambda: self.now - self.elsewhere)
        self.line = Requests(DT)

    def answer(self, one: Request) -> None:
        self.now += self.seconds
        self.waiting -= 1
        self.answered.append(one)

    def add(self, one: Request) -> None:
        self.line.add(one)
        self.waiting = min(WAIT, self.waiting + 1)

    def serve(self, *, closed: Closed = always_open) -> int:
        """Return how many requests are answered now."""
        before = len(self.answered)
        self.line.serve(self.answer, closed=closed)
        return len(self.answered) - before


def test_who_comes_when_the_line_is_full_is_refused_with_the_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    desk = Desk(monkeypatch, 0.0)
    waiting = [request() for _ in range(WAIT + 3)]
    for one in waiting:
        desk.add(one)
    for one in waiting[:WAIT]:
        one.refuse.assert_not_called()
    for one in waiting[WAIT:]:
        one.refuse.assert_called_once_with(f"{WAIT} requests are waiting already; ask again later")
    desk.serve()
    assert desk.answered == waiting[:WAIT], "first come, first served"


@pytest.mark.parametrize("seconds", mostly_long("thousands of requests", [0.0001, 0.004, DT, 3 * DT], 0.004, 3 * DT))
def test_a_flood_gets_its_share_of_the_time_and_no_more(monkeypatch: pytest.MonkeyPatch, seconds: float) -> None:
    desk, longest = Desk(monkeypatch, seconds), 0.0
    while desk.now < 20.0:
        while desk.waiting < WAIT:
            desk.add(request())
        began = desk.now
        desk.serve()
        longest = max(longest, desk.now - began)
        if desk.waiting:
            wait = desk.line.wait(closed=always_open)
            assert wait <= seconds / SHARE
            desk.now += wait + 1e-9  # the world waits so long, and no longer
    share = len(desk.answered) * seconds / desk.now
    assert share == pytest.approx(SHARE, rel=0.05)
    assert longest <= SHARE * DT / (1 - SHARE) + seconds, "what is saved up is a tick's share, and one may take longer"


def test_who_asks_now_and_then_does_not_wait(monkeypatch: pytest.MonkeyPatch) -> None:
    desk = Desk(monkeypatch, SHARE * DT)
    for _ in range(5):
        desk.add(request())
        assert desk.line.wait(closed=always_open) == 0.0
        assert desk.serve() == 1
        assert desk.line.wait(closed=always_open) == inf, "nobody is there to wait for"
        desk.now += DT


def test_who_asks_does_not_pay_for_what_else_the_machine_does(monkeypatch: pytest.MonkeyPatch) -> None:
    desk = Desk(monkeypatch, SHARE * DT)
    desk.add(request())

    def slow(one: Request) -> None:
        desk.answer(one)
        desk.now, desk.elsewhere = desk.now + 20 * DT, desk.elsewhere + 20 * DT

    desk.line.serve(slow, closed=always_open)
    desk.add(request())
    assert desk.line.wait(closed=always_open) == 0.0


def test_answers_that_wait_for_the_disk_do_not_hold_up_a_tick(monkeypatch: pytest.MonkeyPatch) -> None:
    desk = Desk(monkeypatch, 0.0)
    for _ in range(WAIT):
        desk.add(request())

    def saved(one: Request) -> None:
        desk.answer(one)
        desk.now, desk.elsewhere = desk.now + 0.003, desk.elsewhere + 0.003

    desk.line.serve(saved, closed=always_open)
    assert desk.now <= SHARE * DT + 0.003, "the next arrival is looked at after a tick's share of the wall time"
    assert desk.waiting
    assert desk.line.wait(closed=always_open) == 0.0, "they have not used up their share"


def test_while_the_clock_stands_nobody_waits_for_a_share(monkeypatch: pytest.MonkeyPatch) -> None:
    desk = Desk(monkeypatch, DT)
    for _ in range(5):
        desk.add(request())
    answered = []
    for _ in range(6):
        desk.line.idle()
        answered.append(desk.serve())
    assert answered == [1, 1, 1, 1, 1, 0]


def test_within_a_tick_of_lockstep_edits_wait_and_let_the_others_pass(monkeypatch: pytest.MonkeyPatch) -> None:
    desk = Desk(monkeypatch, 0.0)
    edit, join, press = request(EDIT), request(JOIN), request(ACTION)
    for one in (edit, join, press):
        desk.add(one)
    assert desk.serve(closed=in_lockstep) == 2
    assert desk.answered == [join, press]
    assert desk.line.wait(closed=in_lockstep) == inf
    assert desk.serve() == 1


@pytest.mark.parametrize(
    ("message", "is_there", "waits"),
    [
        (Edit(kind=Kind.WALL, low=(0.0, 0.0), high=(1.0, 1.0)), True, False),
        (PoolTargets(id="p", targets=[(1.0, 1.0)]), True, False),
        (Places(id="p", count=1), False, True),
        (Order(id="o", targets=[(1.0, 1.0)]), False, False),
        (Order(id="o", targets=[(1.0, 1.0)]), True, True),
        *((RobotAction(do=do), False, False) for do in RobotDo),
        *((RobotAction(do=do), True, do in {RobotDo.HOME, RobotDo.CANCEL}) for do in RobotDo),
    ],
    ids=lambda value: type(value).__name__ if isinstance(value, Struct) else str(value),
)
def test_in_real_time_other_stops_wait_while_their_robot_is_at_one_that_is_not_counted_yet(
    message: Message, *, is_there: bool, waits: bool
) -> None:
    """A client hears `done` before the world has counted it: its next order must not take the old one's place."""
    one = Mock(spec=Request, message=message, ids={"robot": "r1"})
    assert waits_in_tick(one, lockstep=False, is_there=lambda robot: is_there) is waits
