"""The line of requests: bounded, first come first served, and a share of each tick."""

from itertools import pairwise
from typing import Any
from unittest.mock import Mock

import pytest

from swarm.bus import Request
from swarm.messages import ACTION, EDIT, JOIN, Topic
from world import requests
from world.requests import FEW, SHARE, WAIT, Requests

DT = 0.05  # s


def request(topic: Topic[Any] = EDIT) -> Any:  # noqa: ANN401
    return Mock(spec=Request, topic=topic)


class Desk:
    """Answers requests, each of which takes some time of a clock that is moved by hand."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, seconds: float) -> None:
        self.now, self.seconds = 0.0, seconds
        self.answered: list[Any] = []
        self.line = Requests(DT)
        monkeypatch.setattr(requests, "perf_counter", lambda: self.now)

    def answer(self, one: Request) -> None:
        self.now += self.seconds
        self.answered.append(one)

    def tick(self, *, idle: bool = False, between: bool = True) -> int:
        """Return how many requests a tick answers."""
        before = len(self.answered)
        self.line.renew(idle=idle)
        self.line.serve(self.answer, between=between)
        return len(self.answered) - before


def test_who_comes_when_the_line_is_full_is_refused_with_the_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    desk = Desk(monkeypatch, 0.0)
    waiting = [request() for _ in range(WAIT + 3)]
    for one in waiting:
        desk.line.add(one)
    for one in waiting[:WAIT]:
        one.refuse.assert_not_called()
    for one in waiting[WAIT:]:
        one.refuse.assert_called_once_with(f"{WAIT} requests are waiting already; ask again later")
    while desk.tick():
        pass
    assert desk.answered == waiting[:WAIT], "first come, first served"


def test_a_tick_answers_a_few(monkeypatch: pytest.MonkeyPatch) -> None:
    desk = Desk(monkeypatch, 0.0)
    for _ in range(2 * FEW + 1):
        desk.line.add(request())
    assert [desk.tick() for _ in range(4)] == [FEW, FEW, 1, 0]


def test_slow_requests_get_their_share_of_the_time_and_no_more(monkeypatch: pytest.MonkeyPatch) -> None:
    desk = Desk(monkeypatch, DT)  # each takes a whole tick
    for _ in range(5):
        desk.line.add(request())
    ticks = [desk.tick() for _ in range(round(4 / SHARE) + 1)]
    assert ticks[0] == 1, "one is answered in any case"
    assert sum(ticks) == 5
    served = [number for number, count in enumerate(ticks) if count]
    assert all(later - earlier >= 1 / SHARE - 1 for earlier, later in pairwise(served))


def test_while_the_clock_stands_nobody_waits_for_a_share(monkeypatch: pytest.MonkeyPatch) -> None:
    desk = Desk(monkeypatch, DT)
    for _ in range(5):
        desk.line.add(request())
    assert [desk.tick(idle=True) for _ in range(6)] == [1, 1, 1, 1, 1, 0]


def test_within_a_tick_edits_wait_and_let_the_others_pass(monkeypatch: pytest.MonkeyPatch) -> None:
    desk = Desk(monkeypatch, 0.0)
    edit, join, press = request(EDIT), request(JOIN), request(ACTION)
    for one in (edit, join, press):
        desk.line.add(one)
    assert desk.tick(between=False) == 2
    assert desk.answered == [join, press]
    assert desk.tick() == 1
