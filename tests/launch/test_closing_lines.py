"""The last lines of `swarm run`."""

from pathlib import Path
from typing import Any

from swarm.launch.run import closing_lines
from swarm.scenario.load import Scenario
from world.simulate import Simulation

SUMMARY: dict[str, Any] = {
    "complete": True, "reason": "", "sim_time": 104.25, "wall_time": 2.0, "real_time_factor": 52.125,
    "late_commands": 3, "robots_per_process": 1, "contacts": {"robot": 0, "wall": 1, "obstacle": 0}, "clearance_min": 0.1234,
    "steering": {"angle": {"tables": 0.916, "turned": 0.084}},
    "per_robot": {"r1": {"reached": [12.3, None], "path_length": 50.04, "waiting": 1.5}},
}  # fmt: skip


def test_how_it_went_is_said_in_words() -> None:
    assert closing_lines(SUMMARY, None) == [
        "complete",
        "  simulated 104.2 s in 2.0 s (52.1 x real time), 3 late commands",
        "  contacts: 0 robot, 1 wall, 0 obstacle; smallest gap 0.12 m; the fuzzy tables steered 92% of all turning",
        "  r1: stops at 12 s, -; drove 50.0 m, waited 1.5 s",
    ]


def test_what_went_wrong_comes_first_and_a_recording_last(tmp_path: Path) -> None:
    record = tmp_path / "run.rrd"
    record.touch()
    lines = closing_lines(SUMMARY | {"complete": False, "reason": "r1 stands", "clearance_min": None}, record)
    assert lines[0] == "not complete: r1 stands"
    assert "smallest gap none;" in lines[2]
    assert lines[-1] == f"  recorded: {record}  (open it with: rerun {record})"


def test_a_world_that_ended_without_a_report_leaves_its_reason() -> None:
    assert closing_lines({"complete": False, "reason": "world ended with status 2"}, None) == [
        "not complete: world ended with status 2"
    ]


def test_robots_that_shared_a_process_are_said() -> None:
    lines = closing_lines(SUMMARY | {"robots_per_process": 8}, None)
    assert lines[3] == "  not a process for each robot: up to 8 robots shared one"
    assert lines[4].startswith("  r1: ")


def test_a_report_has_all_that_is_said(paper: Scenario) -> None:
    assert len(closing_lines(Simulation.of(paper, 2, 1).run(limit=1.0), None)) == 6
