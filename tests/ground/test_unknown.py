"""Whole missions on an unknown floor."""

from typing import Any

import pytest

from swarm.scenario.load import Scenario, load
from tests.shared import ROOT, with_settings
from world.simulate import Simulation


@pytest.fixture(scope="module")
def unknown() -> Scenario:
    return load(ROOT / "scenarios" / "unknown.yaml")


def assert_complete_and_untouched(report: dict[str, Any]) -> None:
    assert report["complete"], report["reason"]
    assert report["contacts"]["wall"] == report["contacts"]["obstacle"] == 0
    assert report["clearance_min"] > 0.0


def driven(report: dict[str, Any]) -> float:
    return float(sum(row["path_length"] for row in report["per_robot"].values()))


def test_a_robot_alone_learns_the_papers_box_and_touches_nothing(unknown: Scenario) -> None:
    assert_complete_and_untouched(Simulation.of(unknown, 1, 1).run())


@pytest.mark.long("whole missions on an unknown floor; make test drives one")
@pytest.mark.parametrize("seed", [2, 3])
def test_a_robot_alone_completes_on_other_seeds(unknown: Scenario, seed: int) -> None:
    assert_complete_and_untouched(Simulation.of(unknown, 1, seed).run())


@pytest.mark.long("whole missions on an unknown floor")
@pytest.mark.parametrize("seed", [1])
def test_noise_and_a_lossy_radio_keep_nobody_from_the_end(unknown: Scenario, seed: int) -> None:
    rough = with_settings(unknown, sensors={"noise": 0.02}, radio={"loss": 0.3})
    assert_complete_and_untouched(Simulation.of(rough, 2, seed).run())


@pytest.mark.long("two whole missions of four robots")
def test_four_robots_that_share_drive_less_than_four_that_do_not(unknown: Scenario) -> None:
    alone = with_settings(unknown, map={"shared": False})
    shared, each = (Simulation.of(scenario, 4, 1).run() for scenario in (unknown, alone))
    for report in (shared, each):
        assert_complete_and_untouched(report)
    assert driven(shared) < driven(each)


def test_an_unknown_run_is_the_same_again(unknown: Scenario) -> None:
    first, again = (Simulation.of(unknown, 3, 5).run(limit=10.0)["digest"] for _ in range(2))
    assert first == again
