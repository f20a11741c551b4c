"""The law of queues: it counts the time that a robot near its stop has a free way, and speaks of one that is starved."""

from collections.abc import Callable
from typing import Any

import pytest
from msgspec.structs import replace

from swarm.messages import Command
from swarm.traffic.reservations.claims import Claimed, Claiming
from swarm.traffic.reservations.route import RouteProgress
from tests.storm.shared import plan_of, short_run, with_commands
from world.storm.history.history import History, record
from world.storm.history.seen import cells_at
from world.storm.laws.fairness import EACH, FIRST, nobody_overtaken_for_ever
from world.storm.laws.judge import LAWS, judge

LAW = "nobody is overtaken for ever"
SHARED = [5.4, 1.8]  # m


def lengthened(history: History, seconds: float) -> History:
    """Return a run that goes on for so long from the tick before the one in which r1 reaches its stop."""
    reached = next(m.tick for m in history.moments if m.commands and m.commands["r1"].reached[0])
    last = history.moments[reached - 1]
    more = [last._replace(tick=last.tick + tick) for tick in range(1, round(seconds / history.dt) + 1)]
    return History(**vars(history) | {"moments": history.moments[:reached] + more})


def told_of_r1(history: History) -> list[str]:
    return [text for _, robots, text in nobody_overtaken_for_ever(history) if robots == ("r1",)]


@pytest.mark.parametrize(("seconds", "speaks"), [(FIRST - 15.0, False), (FIRST + 1.0, True)])
def test_it_speaks_of_a_robot_that_stays_away_from_a_stop_with_a_free_way(seconds: float, speaks: bool) -> None:
    told = told_of_r1(lengthened(short_run(), seconds))
    assert len(told) == speaks
    assert all(text.startswith(f"r1 was in reach of target 1 with a free way for {FIRST:.0f} s") for text in told)


def test_a_stop_in_the_cell_of_a_robot_that_goes_elsewhere_has_no_free_way() -> None:
    history = lengthened(short_run(), 2 * FIRST)
    stop = cells_at(history, 0).cell_of(*history.stops[0][0])

    def change(tick: int, name: str, command: Command) -> Command:
        return command if name == "r1" else replace(command, held=[*command.held, stop])

    assert told_of_r1(history)
    assert told_of_r1(with_commands(history, change)) == []


def starved(real: Callable[..., Claimed], robot: str) -> Callable[..., Claimed]:
    """Let a robot claim nothing once it is two cells or less before its goal."""

    def step(self: Claiming, progress: RouteProgress, following: Any, situation: Any, *rest: Any) -> Claimed:  # noqa: ANN401
        ahead = (progress.head, *progress.route)
        near = situation.goal in ahead and ahead.index(situation.goal) <= 2
        if self.me == robot and near:
            return Claimed(progress.without_claims(), (), took=False)
        return real(self, progress, following, situation, *rest)

    return step


@pytest.mark.costs("two robots for four minutes")
def test_it_speaks_of_a_robot_that_others_overtake_for_ever(monkeypatch: pytest.MonkeyPatch) -> None:
    """r1 and r2 visit one target and drive back; r1 lets everybody else have it."""
    plan = plan_of(own_targets=[[SHARED, [1.8, 1.8]], [SHARED, [9.0, 3.0]]], limit=FIRST + 2 * EACH + 60.0)
    assert judge(record(plan)) == []
    monkeypatch.setattr(Claiming, "step", starved(Claiming.step, "r1"))
    told = [violation for violation in judge(record(plan)) if violation.law == LAW]
    assert [violation.robots for violation in told] == [("r1",)]


def test_it_is_one_of_the_laws() -> None:
    assert LAWS[LAW] is nobody_overtaken_for_ever
