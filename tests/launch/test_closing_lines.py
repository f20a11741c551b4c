"""The last lines of `swarm run`."""

import os
from pathlib import Path
from typing import Any

import pytest

from dashboard.terminal import ROWS
from swarm.launch.summary import format_recordings, format_tape_line, summary_lines, summary_of
from swarm.scenario.load import Scenario
from world.simulate import Simulation

SUMMARY: dict[str, Any] = {
    "complete": True, "passed": False, "avoidable_contacts": 1, "reason": "", "sim_time": 104.25, "wall_time": 2.0, "real_time_factor": 52.125,
    "late_commands": 3, "robots_per_process": 1, "contacts": {"robot": 0, "wall": 1, "obstacle": 0}, "clearance_min": 0.1234,
    "steering": {"angle": {"tables": 0.916, "turned": 0.084}},
    "per_robot": {"r1": {"targets": 2, "reached": [12.3, None], "unreachable": [1], "laps": 0, "path_length": 50.04, "waiting": 1.5,
                         "contacts": 1}},
}  # fmt: skip
WHOLE = b"RRF2 chunks RRF2FOOT\1\0\0\0"


def test_how_it_went_is_said_in_words() -> None:
    assert summary_lines(SUMMARY, []) == [
        "complete",
        "  exit status 1: complete, but stopping would have avoided 1 contact",
        "  simulated 104.2 s in 2.0 s (52.1 x real time), 3 late commands",
        "  contacts: 0 robot, 1 wall, 0 obstacle; smallest gap 0.12 m",
        "  the fuzzy tables steered 92% of all turning",
        "  r1: targets: 12 s, no way; drove 50.0 m, waited 1.5 s, 1 contact",
    ]


def test_what_went_wrong_comes_first_and_recordings_last() -> None:
    wrong = SUMMARY | {"complete": False, "reason": "r1 stands", "clearance_min": None, "lost": ["r2", "r3"]}
    lines = summary_lines(wrong, ["recorded: run.rrd"])
    assert lines[0] == "not complete: r1 stands"
    assert lines[3].endswith("smallest gap none")
    assert lines[-2:] == [
        "  lost: r2, r3 stayed away, or crashed too often to be started again",
        "  recorded: run.rrd",
    ]


def test_the_tape_of_a_run_is_said_with_what_to_do_with_it(tmp_path: Path) -> None:
    tape = tmp_path / "small.swarm"
    assert format_tape_line(tape) == [], "its disk was full"
    tape.touch()
    assert format_tape_line(tape) == [f"tape: {tape}  (run it again with: swarm replay {tape})"]


@pytest.mark.parametrize(
    ("written", "starts", "said"),
    [
        ({}, 1, ["not recorded: {0}/run.rrd was not written"]),
        ({"run.rrd": WHOLE}, 1, ["recorded: {0}/run.rrd  (open it with: rerun {0}/run.rrd)"]),
        ({"run.rrd": WHOLE[:-9]}, 1, ["recorded without index: {0}/run.rrd  (its dashboard was killed"]),
        ({"run.rrd": b"", "run.2.rrd": WHOLE}, 2, ["recorded without index: {0}/run.rrd", "recorded: {0}/run.2.rrd"]),
        ({"run.rrd": WHOLE, "run.2.rrd": WHOLE}, 1, ["recorded: {0}/run.rrd"]),
        ({"run.rrd": WHOLE, "run-run2.rrd": WHOLE}, 1, ["recorded: {0}/run.rrd", "recorded: {0}/run-run2.rrd"]),
    ],
)
def test_every_recording_of_the_run_is_said_and_what_a_cut_one_lacks(
    tmp_path: Path, written: dict[str, bytes], starts: int, said: list[str]
) -> None:
    since = tmp_path / "card"
    since.touch()
    for name, content in written.items():
        (tmp_path / name).write_bytes(content)
    lines = format_recordings(tmp_path / "run.rrd", starts, since.stat().st_mtime_ns)
    assert len(lines) == len(said)
    assert all(line.startswith(expected.format(tmp_path)) for line, expected in zip(lines, said, strict=True))


def test_a_recording_of_another_day_is_not_said(tmp_path: Path) -> None:
    record, since = tmp_path / "run.rrd", tmp_path / "card"
    record.write_bytes(WHOLE)
    since.touch()
    os.utime(record, (0, 0))
    assert format_recordings(record, 1, since.stat().st_mtime_ns) == [f"not recorded: {record} was not written"]
    assert format_recordings(None, 0, 0) == []


@pytest.mark.parametrize(
    ("report", "trouble", "reason"),
    [
        (None, "", "the world ended without a report"),
        (None, "router ended", "router ended"),
        ("{", "router ended", "router ended"),
        ('{"complete": false, "reason": "interrupted"}', "router ended", "router ended"),
        ('{"complete": false, "reason": "time limit"}', "r1 was started again", "time limit"),
    ],
)
def test_the_summary_says_why_a_run_ended(tmp_path: Path, report: str | None, trouble: str, reason: str) -> None:
    path = tmp_path / "report.json"
    if report is not None:
        path.write_text(report)
    assert summary_of(path, {"robots": 2}, trouble, [])["reason"] == reason
    assert summary_of(path, {"robots": 2}, trouble, ["r2"])["lost"] == ["r2"]


def test_a_world_that_ended_without_a_report_leaves_its_reason() -> None:
    assert summary_lines({"complete": False, "reason": "world ended with status 2"}, []) == [
        "not complete: world ended with status 2",
        "  exit status 1: the world wrote no report, so nobody knows whether anything was touched",
    ]


@pytest.mark.parametrize(
    ("complete", "avoidable", "walls", "said"),
    [
        (True, 0, 0, "exit status 0: complete, and nobody touched anything"),
        (True, 0, 2, "exit status 0: complete, and stopping would not have avoided any contact"),
        (True, 1, 1, "exit status 1: complete, but stopping would have avoided 1 contact"),
        (True, 3, 4, "exit status 1: complete, but stopping would have avoided 3 contacts"),
        (False, 0, 2, "exit status 1: not complete"),
        (False, 1, 2, "exit status 1: not complete, and stopping would have avoided 1 contact"),
    ],
)
def test_the_exit_status_is_said_with_its_rule(complete: bool, avoidable: int, walls: int, said: str) -> None:
    contacts = {"contacts": {"robot": 0, "wall": walls, "obstacle": 0}, "avoidable_contacts": avoidable}
    lines = summary_lines(SUMMARY | contacts | {"complete": complete, "passed": complete and not avoidable}, [])
    assert lines[1] == f"  {said}"


def row(reached: list[float | None], **fields: object) -> dict[str, Any]:
    least: dict[str, Any] = {
        "targets": len(reached),
        "laps": 0,
        "path_length": 20.0,
        "waiting": 3.0,
        "contacts": 0,
        "unreachable": [],
    }
    return {**least, "reached": reached, **fields}


# fmt: off
FEW = {  # what is special of a large fleet's robots: the lines about robots, after the totals
    "nothing":               ({}, []),
    "one lacks a stop":      ({"r2": row([5.0, None])}, ["r2: targets: 5 s, not reached; drove 20.0 m, waited 3.0 s"]),
    "one has no way":        ({"r2": row([None, 5.0], unreachable=[0])}, ["r2: targets: no way, 5 s; drove 20.0 m, waited 3.0 s"]),
    "one touched something": ({"r2": row([1.0, 2.0], contacts=2)}, ["r2: targets: 1 s, 2 s; drove 20.0 m, waited 3.0 s, 2 contacts"]),
    "one is on patrol":      ({"r2": row([None, None], laps=4)}, []),
}
# fmt: on


@pytest.mark.parametrize("name", FEW)
def test_a_large_fleet_is_told_as_totals_and_the_few_that_need_attention(name: str) -> None:
    special, few = FEW[name]
    usual = {f"r{number}": row([4.0, 9.0]) for number in range(ROWS + 20)} | {
        "r7": row([4.0, 9.0], path_length=31.0, waiting=8.0)
    }
    fleet = usual | special
    lacking = sum(each["reached"].count(None) for each in special.values() if not each["laps"])
    assert summary_lines(SUMMARY | {"per_robot": fleet}, [])[5:] == [
        f"  {ROWS + 20} robots reached {2 * (ROWS + 20) - lacking} of {2 * (ROWS + 20)} targets",
        "  each drove 20.0 m to 31.0 m and waited at most 8.0 s",
        *(f"  {line}" for line in few),
    ]


def test_of_many_robots_that_lack_stops_only_the_first_are_told() -> None:
    fleet = {f"r{number}": row([None]) for number in range(ROWS + 5)}
    lines = summary_lines(SUMMARY | {"per_robot": fleet}, [])
    assert len([line for line in lines if line.startswith("  r")]) == ROWS
    assert lines[-1] == "  and 5 more that lack targets or touched something; --report FILE has all"


def test_robots_that_shared_a_process_are_said() -> None:
    lines = summary_lines(SUMMARY | {"robots_per_process": 8}, [])
    assert lines[5] == "  robots per process: up to 8"
    assert lines[6].startswith("  r1: ")


def test_a_report_has_all_that_is_said(paper: Scenario) -> None:
    assert len(summary_lines(Simulation.of(paper, 2, 1).run(limit=1.0), [])) == 8
