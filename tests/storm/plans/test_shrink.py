"""Shrinking makes a plan smaller while the law stays broken; every candidate is an independent world."""

from collections.abc import Iterable

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from swarm.storm.history.history import History
from swarm.storm.history.run_facts import Found
from swarm.storm.laws import judge as laws
from swarm.storm.plans.draw import can_be_driven, draw
from swarm.storm.plans.plan import StormPlan
from swarm.storm.plans.profiles import PROFILES
from swarm.storm.plans.simpler import CUTS, cut_lanes, faults, robots, simpler, size
from swarm.storm.shrink import Trial, find_break_time, find_first, first_broken, shrink
from tests.storm.shared import plan_of

PLANTED = "nobody east of 5 m"


def nobody_east(history: History) -> Found:
    """Plant a law that somebody who drives east breaks: r2 starts there and stays excused."""
    for moment in history.moments:
        for name, pose in zip(history.robots, moment.poses, strict=True):
            if pose.x > 5.0:
                yield moment.tick, (name,), f"{name} is at {pose.x:.2f}"
                return


def alone(trials: Iterable[Trial]) -> tuple[StormPlan, float] | None:
    """Try one after the other, in this process."""
    for trial in trials:
        time = find_break_time(trial)
        if time is not None:
            return trial.plan, time
    return None


CROWDED = plan_of(
    robots=3,
    start={"poses": [[1.8, 1.8, 0.0], [3.0, 3.0, 0.0], [4.2, 1.8, 3.0]]},
    own_targets=[[[3.0, 1.8], [1.8, 1.8]], [[1.8, 3.0], [6.6, 3.0]], [[4.2, 3.0]]],
    radio={"loss": 0.3},
    return_home=True,
    faults=[
        {"robot": "r1", "kind": "held_up", "tick": 10, "ticks": 40},
        {"robot": "r2", "kind": "held_up", "tick": 10, "ticks": 40},
        {"robot": "r3", "kind": "suspended", "tick": 30, "ticks": 60},
    ],
    late=2,
)


@pytest.mark.long("many runs of a plan that shrinks")
def test_a_planted_fault_is_shrunk_to_the_one_robot_that_makes_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(laws.LAWS, PLANTED, nobody_east)
    time = find_break_time(Trial(CROWDED, PLANTED))
    assert time is not None
    small = shrink(CROWDED, PLANTED, time, alone)
    assert find_break_time(Trial(small, PLANTED)) is not None
    assert size(small)[:3] == (1, 0, 1)
    assert size(small)[3] < size(CROWDED)[3]
    assert small.scenario.own_targets[0][0][0] > 5.0
    assert small.scenario.limit == CROWDED.scenario.limit
    assert small.scenario.radio.loss == 0.0


def test_it_ends_when_told_to() -> None:
    assert shrink(CROWDED, PLANTED, 1.0, alone, stop=lambda: True) == CROWDED


def test_a_law_that_is_kept_is_not_broken_and_no_plan_is_found() -> None:
    assert find_break_time(Trial(plan_of(), "no contact")) is None
    assert find_first([Trial(plan_of(), "no contact")] * 3, workers=2, stop=lambda: False) is None


def test_a_run_whose_time_is_up_has_not_broken_the_law_of_arriving() -> None:
    assert find_break_time(Trial(plan_of(limit=2.0), "all arrive")) is None


def test_the_law_broken_first_is_the_one_to_shrink_for() -> None:
    late, soon = (laws.Violation(law, tick, (), "") for law, tick in (("all arrive", 90), ("no contact", 7)))
    assert first_broken([late, soon]) == "no contact"
    assert first_broken([]) is None


@settings(max_examples=5)
@given(st.sampled_from(sorted(PROFILES)), st.integers(0, 1000), st.sampled_from(CUTS))
def test_every_candidate_is_another_plan_that_can_be_driven_and_none_is_larger(
    profile: str, seed: int, cut: object
) -> None:
    plan = draw(profile, seed)
    for number, candidate in enumerate(simpler(plan, cut)):  # type: ignore[arg-type]
        assert candidate != plan
        assert all(small <= large for small, large in zip(size(candidate), size(plan), strict=True))
        assert can_be_driven(candidate)
        if number == 5:
            break


def test_robots_that_stay_keep_their_own_starts_stops_and_faults() -> None:
    raw = msgspec.to_builtins(CROWDED)
    last_alone, _, without_first, *_ = robots(raw)
    assert last_alone["scenario"]["start"]["poses"] == [(4.2, 1.8, 3.0)]
    assert [fault["robot"] for fault in last_alone["faults"]] == ["r1"]
    assert without_first["scenario"]["start"]["poses"] == [(3.0, 3.0, 0.0), (4.2, 1.8, 3.0)]
    assert [row[-1] for row in without_first["scenario"]["own_targets"]] == [(6.6, 3.0), (4.2, 3.0)]
    assert [(fault["robot"], fault["kind"]) for fault in without_first["faults"]] == [
        ("r1", "held_up"), ("r2", "suspended"),
    ]  # fmt: skip


def test_the_first_cut_is_the_boldest() -> None:
    assert next(faults(msgspec.to_builtins(CROWDED)))["faults"] == []


def test_a_lane_cut_out_moves_what_is_beyond_it() -> None:
    raw = msgspec.to_builtins(plan_of(edits=[{"at": 9.0, "kind": "free", "low": [2.0, 2.0], "high": [4.0, 3.0]}]))
    moved = [new["scenario"] for new in cut_lanes(raw) if new["scenario"]["start"]["poses"][1][0] < 9.0]
    assert [len(scenario["map"]["text"].splitlines()[0]) for scenario in moved] == [24] * 6
    assert {tuple(scenario["start"]["poses"][1]) for scenario in moved} == {(7.8, 3.0, 3.0)}
    between = moved[1:3]  # the lanes from 2.4 m and from 3.6 m on: r1 stays, and the edit loses what is in them
    assert [scenario["start"]["poses"][0] for scenario in between] == [[1.8, 1.8, 0.0]] * 2
    assert [scenario["edits"][0]["high"][0] for scenario in between] == [2.8, 3.6]
