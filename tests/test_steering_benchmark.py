"""The wrong tables of the steering benchmark are wrong as they say, and its rows add up."""

from typing import Any

import pytest

from benchmarks.steering import FEW, WRONG, row, run, swapped, wrong_row
from swarm.fuzzy import Profile, load_profile

PAPER = load_profile("paper")


def consequents(profile: Profile, behaviour: str) -> list[tuple[str, ...]]:
    return [rule.terms[-2:] for rule in profile.behaviours[behaviour].rules]


@pytest.mark.parametrize("name", [name for name in WRONG if name.startswith("always")])
def test_constant_tables_say_one_thing(name: str) -> None:
    profile = WRONG[name](PAPER)
    said = {pair for behaviour in PAPER.behaviours for pair in consequents(profile, behaviour)}
    assert said == {tuple(name.removeprefix("always ").split("/"))}


def test_swapped_wheels_are_the_other_ones() -> None:
    for behaviour in PAPER.behaviours:
        assert consequents(swapped(PAPER), behaviour) == [pair[::-1] for pair in consequents(PAPER, behaviour)]


def test_aimless_tables_avoid_as_the_paper_does() -> None:
    aimless = WRONG["goal seeking always medium/medium"](PAPER)
    assert set(consequents(aimless, "goal_seeking")) == {("medium", "medium")}
    assert consequents(aimless, "obstacle_avoidance") == consequents(PAPER, "obstacle_avoidance")


def report(time: float, scaled: float, scale: float, **angle: float) -> dict[str, Any]:
    return {
        "complete": time < 90.0, "robots": 2, "sim_time": time, "contacts": {"robot": 1, "wall": 2},
        "traffic": {"overlaps": 3}, "steering": {"angle": angle, "scaled": {"time": scaled, "mean": scale}},
        "per_robot": {"r1": {"reached": [1.0, None]}, "r2": {"reached": [2.0, 3.0]}},
    }  # fmt: skip


def test_rows_sum_runs_up() -> None:
    one = report(50.0, 30.0, 0.5, tables=0.5, tightened=0.25)
    other = report(100.0, 10.0, 0.9, tables=0.7, tightened=0.05)
    assert row([one, other]) == ("1 of 2", "75", "6", "6", "0.60", "0.75", "0.13", "0.60")
    assert row([report(50.0, 0.0, 1.0, tables=1.0, tightened=0.0)])[-2:] == ("0.00", "")
    assert wrong_row(312.4, [one]) == ("312", "3 of 4", "3", "3", "0.50")


def test_the_short_run_knows_how_long_wrong_tables_may_take() -> None:
    assert set(FEW.wrong_robots) <= set(FEW.robots)


def test_tables_that_ignore_what_they_are_told_get_nowhere() -> None:
    """Nothing but the tables turns to an aim: a robot that always drives straight on stands at the first wall."""
    report = run("paper", 1, 1, limit=295.0, rules="always medium/medium")
    assert wrong_row(295.0, [report])[1:4] == ("0 of 4", "0", "0")
    assert report["steering"]["angle"]["turned"] == 0.0
