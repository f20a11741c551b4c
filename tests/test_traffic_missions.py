"""Fleets that reserve cells, in physics, with the paper's controller; the world's own watch checks them."""

from pathlib import Path
from typing import Any

import pytest

from benchmarks.floor import hall
from swarm.maps.occupancy import WALL
from swarm.scenario.benchmark import from_benchmark
from swarm.scenario.load import Scenario, load
from swarm.scenario.prepare import settle_lattice
from tests.shared import DATA, needs_data, with_settings
from world.simulate import Simulation

SCENARIOS = Path(__file__).parent.parent / "scenarios"
HARD = DATA / "mapf" / "hard"


def run(scenario: Scenario, robots: int, seed: int = 1, limit: float = 400.0) -> dict[str, Any]:
    return Simulation.of(scenario, robots, seed).run(limit=limit)


def assert_clean(report: dict[str, Any]) -> None:
    assert report["complete"], report["reason"]
    assert report["contacts"] == {"robot": 0, "wall": 0, "obstacle": 0}
    assert report["traffic"]["overlaps"] == report["traffic"]["outside"] == 0


@pytest.mark.parametrize("name", ["corridor", "l_corner"])
def test_two_swap_where_only_a_bay_lets_them(name: str) -> None:
    report = run(load(SCENARIOS / f"{name}.yaml"), 2)
    assert_clean(report)
    assert report["traffic"]["joint_plans"] >= 1
    assert report["steering"]["angle"]["tables"] >= 0.45


@pytest.mark.long("whole missions of 8 and 16 robots")
@pytest.mark.parametrize(
    ("name", "robots", "tables"), [("doorway", 8, 0.65), ("crossing", 16, 0.3), ("circle", 8, 0.45)]
)
def test_many_pass(name: str, robots: int, tables: float) -> None:
    report = run(load(SCENARIOS / f"{name}.yaml"), robots)
    assert_clean(report)
    assert report["steering"]["angle"]["tables"] >= tables


@pytest.mark.long("a whole mission of 8 robots")
def test_broadcasts_lost_cost_time_and_nothing_else() -> None:
    scenario = with_settings(load(SCENARIOS / "doorway.yaml"), radio={"loss": 0.3, "range": 5.0})
    assert_clean(run(scenario, 8, seed=2))


@pytest.mark.long("whole missions of 4 and 8 robots")
@pytest.mark.parametrize("robots", [4, 8])
def test_shared_targets_are_taken_in_turn(paper: Scenario, robots: int) -> None:
    assert_clean(run(paper, robots, limit=600.0))


def test_a_swap_without_a_bay_is_found_out_and_named() -> None:
    """Two bodies of 0.4 m with 5 cm on each side of both do not fit beside each other in 0.9 m."""
    report = run(hall(0.9, 2), 2)
    assert not report["complete"]
    assert "exists for r1, r2" in report["reason"]
    assert report["sim_time"] < 40.0
    assert report["contacts"]["robot"] == 0


def test_the_same_seed_under_holds_is_the_same_run() -> None:
    scenario = load(SCENARIOS / "corridor.yaml")
    assert run(scenario, 2)["digest"] == run(scenario, 2)["digest"]


def test_a_wall_put_up_while_running_moves_no_cell() -> None:
    before = settle_lattice(load(SCENARIOS / "doorway.yaml"))
    walled, _, _ = before.map.edit_rectangle(WALL, (2.0, 2.0), (3.0, 5.0))
    after = settle_lattice(Scenario(before.settings, walled, before.profile))
    assert after.settings.traffic == before.settings.traffic
    assert after.settings.traffic.offset is not None


@needs_data
@pytest.mark.long("four whole missions of many robots on mazes")
@pytest.mark.parametrize("name", ["tree", "corners", "tunnel", "string"])
def test_the_hard_cases_complete(name: str) -> None:
    scenario = from_benchmark(HARD / f"{name}.map", HARD / f"{name}.scen", None)
    assert_clean(run(scenario, scenario.settings.count, limit=900.0))


def test_more_robots_than_rows_are_refused(tmp_path: Path) -> None:
    (tmp_path / "a.map").write_text("type octile\nheight 3\nwidth 4\nmap\n....\n....\n....\n", encoding="utf-8")
    (tmp_path / "a.scen").write_text("version 1\n0\ta.map\t4\t3\t0\t0\t3\t0\t3\n", encoding="utf-8")
    with pytest.raises(Exception, match="expected a row for each of 2 robots, got 1"):
        from_benchmark(tmp_path / "a.map", tmp_path / "a.scen", 2)
