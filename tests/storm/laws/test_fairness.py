"""The law of queues: it counts the time that a robot near its stop has a free way, and speaks of one that stays away."""

import pytest
from msgspec.structs import replace

from swarm.messages import Command
from swarm.storm.history.history import History, record
from swarm.storm.history.run_facts import cells_at
from swarm.storm.laws.fairness import EACH, EVERY, FIRST, nobody_overtaken_for_ever, queueing_robots
from swarm.storm.laws.judge import LAWS
from tests.storm.shared import plan_of, short_run, with_commands

LAW = "nobody is overtaken for ever"


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


def test_it_is_one_of_the_laws_and_the_docs_tell_its_bound() -> None:
    assert LAWS[LAW] is nobody_overtaken_for_ever
    assert f"in {FIRST:.0f} s, and {EACH:.0f} s for each" in str(nobody_overtaken_for_ever.__doc__)


@pytest.mark.long("minutes of a simulated patrol")
def test_a_patrol_waits_anew_each_time_it_comes_to_a_stop() -> None:
    """It passes the same stop again and again: all its waits together are longer than the bound."""
    plan = plan_of(own_targets=[[[9.0, 1.8], [1.8, 1.8]], [[1.8, 3.0], [9.0, 3.0]]], patrol=True, limit=240.0)
    history = record(plan)
    waits = [one.waited for _, one in queueing_robots(history)]
    assert EVERY * history.dt * len(waits) > FIRST > 4 * max(waits)
    assert list(nobody_overtaken_for_ever(history)) == []
