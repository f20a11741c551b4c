"""Whole missions, World and Robot in one process: what the project promises about a run."""

from dataclasses import replace
from typing import Any

import pytest

from swarm.fuzzy import load_profile
from swarm.scenario.load import Scenario
from tests.shared import constant_rules, mostly_long, with_consequents, with_settings
from world.simulate import Simulation

CRUISE = 1.5  # m/s times speed_scale: the paper's medium speed
QUICK_SEEDS = (1, 5, 12)
ALL_SEEDS = tuple(range(1, 7))


def run(scenario: Scenario, robots: int, seed: int, limit: float | None = None) -> dict[str, Any]:
    return Simulation.of(scenario, robots, seed).run(limit)


def assert_one_robot_keeps_every_promise(paper: Scenario, seed: int) -> None:
    report = run(paper, 1, seed)
    assert report["complete"], report["reason"]
    assert report["reason"] == ""
    assert report["contacts"] == {"robot": 0, "wall": 0, "obstacle": 0}
    assert report["clearance_min"] > 0.0
    cruise = CRUISE * paper.settings.robot.speed_scale
    assert report["sim_time"] <= 2.5 * report["per_robot"]["r1"]["shortest_length"] / cruise
    assert report["steering"]["angle"]["tables"] >= 0.85
    times = report["per_robot"]["r1"]["reached"]
    assert times == sorted(times)


@pytest.mark.parametrize("seed", QUICK_SEEDS)
def test_one_robot_finishes_without_a_contact_in_time_and_steers_fuzzily(paper: Scenario, seed: int) -> None:
    assert_one_robot_keeps_every_promise(paper, seed)


@pytest.mark.long("eight whole missions; make test drives some of them")
@pytest.mark.parametrize("seed", [seed for seed in ALL_SEEDS if seed not in QUICK_SEEDS])
def test_one_robot_keeps_every_promise_on_more_seeds(paper: Scenario, seed: int) -> None:
    assert_one_robot_keeps_every_promise(paper, seed)


def assert_four_robots_finish(paper: Scenario, seed: int) -> None:
    report = run(paper, 4, seed)
    assert report["complete"], report["reason"]
    assert report["contacts"] == {"robot": 0, "wall": 0, "obstacle": 0}
    assert report["traffic"]["deadlocks"] == report["traffic"]["overlaps"] == report["traffic"]["outside"] == 0
    assert report["steering"]["angle"]["tables"] >= 0.5


@pytest.mark.parametrize("seed", [1])
def test_four_robots_finish(paper: Scenario, seed: int) -> None:
    assert_four_robots_finish(paper, seed)


@pytest.mark.long("whole missions of four robots; make test drives one")
@pytest.mark.parametrize("seed", [2])
def test_four_robots_finish_on_more_seeds(paper: Scenario, seed: int) -> None:
    assert_four_robots_finish(paper, seed)


def without_wall_time(report: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in report.items() if name not in {"wall_time", "real_time_factor"}}


# fmt: off
REPRODUCIBLE: dict[str, dict[str, object]] = {
    "plain":         {},
    "sensor noise":  {"sensors": {"noise": 0.05, "bearing_noise_deg": 3.0}},
    "lossy radio":   {"radio": {"loss": 0.4}},
    "radio in view": {"radio": {"line_of_sight": True, "every": 1}},
    "all of it":     {"sensors": {"noise": 0.03}, "radio": {"loss": 0.2, "line_of_sight": True, "range": 4.0}},
}
# fmt: on


@pytest.mark.parametrize("name", mostly_long("three runs", REPRODUCIBLE, "all of it"))
def test_a_seed_names_a_run_and_another_seed_another_one(paper: Scenario, name: str) -> None:
    scenario = with_settings(paper, **REPRODUCIBLE[name])
    first, again, other = (run(scenario, 3, seed, limit=12.0) for seed in (4, 4, 5))
    assert without_wall_time(first) == without_wall_time(again)
    assert first["digest"] != other["digest"]


@pytest.mark.parametrize("name", mostly_long("two runs", sorted(REPRODUCIBLE.keys() - {"plain"}), "all of it"))
def test_noise_and_the_reach_of_the_radio_make_a_difference(paper: Scenario, name: str) -> None:
    changed = with_settings(paper, **REPRODUCIBLE[name])
    assert run(changed, 4, 1, limit=25.0)["digest"] != run(paper, 4, 1, limit=25.0)["digest"]


def test_a_mission_completes_with_noisy_sensors(paper: Scenario) -> None:
    noisy = with_settings(paper, sensors={"noise": 0.03, "bearing_noise_deg": 2.0})
    report = run(noisy, 1, 2)
    assert report["complete"], report["reason"]
    assert report["contacts"] == {"robot": 0, "wall": 0, "obstacle": 0}


# fmt: off
CONSTANT = {  # every rule says the same
    "straight on":   ("fast", "fast"),
    "slow straight": ("slow", "slow"),
    "always left":   ("slow", "fast"),
    "always right":  ("fast", "slow"),
    "a wide bend":   ("medium", "fast"),
}
# fmt: on


@pytest.mark.parametrize("name", mostly_long("a whole mission", CONSTANT, "always left"))
def test_constant_rule_tables_fail_the_mission(paper: Scenario, name: str) -> None:
    scenario = Scenario(paper.settings, paper.map, constant_rules(paper.profile, *CONSTANT[name]))
    report = run(scenario, 1, 1, limit=150.0)
    assert not report["complete"]
    assert "home" in report["reason"]
    assert report["contacts"]["wall"] == 0, "bad rules are no excuse to touch a wall"


def test_rules_that_steer_away_from_the_target_fail_the_mission(paper: Scenario) -> None:
    def swapped(behaviour: str, terms: tuple[str, ...]) -> tuple[str, ...]:
        return (*terms[:-2], terms[-1], terms[-2])

    scenario = Scenario(paper.settings, paper.map, with_consequents(paper.profile, swapped))
    assert not run(scenario, 1, 1, limit=150.0)["complete"]


def test_rules_rewritten_unchanged_drive_the_very_same_run(paper: Scenario) -> None:
    same = with_consequents(load_profile("paper"), lambda behaviour, terms: terms)
    scenario = Scenario(paper.settings, paper.map, same)
    assert run(scenario, 1, 1, limit=20.0)["digest"] == run(paper, 1, 1, limit=20.0)["digest"]


@pytest.mark.parametrize("robots", mostly_long("two whole missions of four robots", [1, 4], 1))
def test_careful_finishes_the_paper_without_a_contact_and_slower(paper: Scenario, robots: int) -> None:
    careful = replace(paper, profile=load_profile("careful"))
    report, fast = run(careful, robots, 1), run(paper, robots, 1)
    assert report["complete"], report["reason"]
    assert report["contacts"] == {"robot": 0, "wall": 0, "obstacle": 0}
    assert report["traffic"]["overlaps"] == report["traffic"]["outside"] == 0
    assert fast["sim_time"] < report["sim_time"] < 2.0 * fast["sim_time"]
    assert report["steering"]["angle"]["tables"] >= 0.5, "the world asks the same tables"


Number = (int, float)
# fmt: off
REPORT: dict[str, Any] = {  # docs: the report of `swarm run --report`
    "scenario": str, "seed": int, "robots": int, "robots_per_process": int, "pace": str, "complete": bool, "passed": bool, "reason": str,
    "lost": list, "reproducible": bool, "not_reproducible": list,
    "sim_time": float, "wall_time": float, "real_time_factor": float, "ticks": int, "late_commands": int,
    "tick_wall": type(None),
    "contacts": {"robot": int, "wall": int, "obstacle": int}, "avoidable_contacts": int,
    "clearance_min": float,
    "steering": {
        **{by: {"braked": float, "tables": float, "tightened": float, "turned": float, "blended": float}
           for by in ("ticks", "metres", "angle")},
        "scaled": {"time": float, "mean": float},
    },
    "traffic": {"conflicts": int, "joint_plans": int, "deadlocks": int, "stalled": int, "longest_wait": float, "settling": float,
                "overlaps": int, "outside": int, "intrusions": int},
    "per_robot": dict,
    "digest": str,
}
PER_ROBOT = {
    "targets": int, "reached": list, "laps": int, "path_length": float, "shortest_length": float, "waiting": float,
    "replans": int, "contacts": int, "struck": int, "stalled": int, "unreachable": list,
    "waits_for": dict, "standing": float,
}
# fmt: on


def assert_of_form(value: object, form: object, where: str) -> None:
    if isinstance(form, dict):
        assert isinstance(value, dict), where
        assert value.keys() == form.keys(), where
        for name, inner in form.items():
            assert_of_form(value[name], inner, f"{where}.{name}")
    else:
        assert type(value) is form, f"{where}: {value!r}"


@pytest.mark.parametrize("robots", [1, 3])
def test_the_report_has_every_field_of_the_design_and_no_other(paper: Scenario, robots: int) -> None:
    report = run(paper, robots, 1, limit=45.0)
    assert_of_form(report, REPORT, "report")
    assert list(report["per_robot"]) == [f"r{number}" for number in range(1, robots + 1)]
    for name, row in report["per_robot"].items():
        assert_of_form(row, PER_ROBOT, name)
        assert row["targets"] == len(row["reached"]) == 4
        assert all(time is None or type(time) is float for time in row["reached"])
        assert 0 <= row["waiting"] <= report["sim_time"]
        assert 0 <= row["standing"] <= report["sim_time"]
    assert all(sum(report["steering"][by].values()) == pytest.approx(1.0) for by in ("ticks", "metres", "angle"))
    assert report["ticks"] == round(report["sim_time"] * paper.settings.rate)
    assert len(report["digest"]) == 32


def test_a_run_cut_short_says_which_stops_are_missing(paper: Scenario) -> None:
    report = run(paper, 2, 1, limit=5.0)
    assert not report["complete"]
    assert report["reason"].startswith("time limit of 5 s")
    for name in ("r1", "r2"):
        assert f"{name} target 1, target 2, target 3, home" in report["reason"]


def test_a_stop_no_path_reaches_is_given_up_and_the_run_ends_incomplete() -> None:
    """The check before a run refuses this; a robot that meets it all the same goes on with the rest."""
    from tests.shared import scenario_of

    walled = "##########\n#.....#..#\n#.....#..#\n#.....#..#\n#.....#..#\n##########\n"
    report = run(scenario_of(walled, targets=[[8.5, 2.5], [4.5, 2.5]]), 1, 1, limit=60.0)
    assert not report["complete"]
    assert report["reason"] == "not reached: r1 target 1 (no path)"
    assert report["per_robot"]["r1"]["reached"][0] is None
    assert report["per_robot"]["r1"]["reached"][1] is not None
