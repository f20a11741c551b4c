"""`swarm drill` with real fleets: a fault that is planted there is named, and nothing of the drill is left."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from swarm.cli import main
from swarm.launch.drill import run
from swarm.launch.drill.faults import FAKETIME, lacks_faketime
from swarm.launch.drill.fleet_under_drill import MARK, LiveFleet
from swarm.launch.drill.floor import SCENARIO, undisturbed_digest
from swarm.launch.drill.judge import Observed
from swarm.launch.drill.table import LOCKSTEP, QUICK, ROWS, TABLE, Row
from tests.shared import mostly_long

QUICKLY = ("robot-killed 4", "world-killed max", "garbage max")  # in make test
# of each kind, what no other test does to a fleet; `swarm drill` runs every row
OTHERS = (
    "robot-lost 4", "door-killed 4", "all-killed max", "killed-in-turn max", "dashboard-killed 4", "robot-frozen 4",
    "router-frozen max", "late-and-lossy 4", "pose-jump 4", "pose-lost 4", "uneven-network 1", "on-all-keys max",
    "another-run 4", "false-joins 4", "edit-flood 4", "snapshot-cut max",
)  # fmt: skip


def test_the_list_has_every_row(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["drill", "--list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == [row.name for row in TABLE]


def test_what_a_machine_lacks_is_said(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr("swarm.launch.drill.faults.FAKETIME", ())
    assert main(["drill", "--row", "clock-shifted", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["pass"], told["fail"], told["skip"]) == (0, 0, 1)
    assert told["rows"][0]["seen"] == "libfaketime is not installed (apt install libfaketime)"
    assert lacks_faketime() or FAKETIME


@pytest.mark.processes
@pytest.mark.costs("a whole mission with a fault")
@pytest.mark.parametrize(
    "name",
    mostly_long("a whole mission with a fault", (*QUICKLY, *OTHERS), *QUICKLY),
)
def test_every_row_passes(name: str, tmp_path: Path) -> None:
    row, pace = name.split()
    outcome = run.run_row(ROWS[row], pace, tmp_path)
    if outcome.outcome == "skip":
        pytest.skip(outcome.seen)
    printed = "\n".join(kept.read_text(encoding="utf-8") for kept in tmp_path.glob("*/out.txt"))
    assert outcome.outcome == "pass", f"{outcome.seen}\n{printed}"


@pytest.mark.long("a whole mission with a fault")
@pytest.mark.processes
def test_a_row_is_told_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["drill", "--row", "report-full-disk", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["pass"], told["fail"]) == (1, 0)
    assert [(one["row"], one["outcome"]) for one in told["rows"]] == [("report-full-disk", "pass")]


@pytest.mark.processes
def test_a_process_that_is_left_is_named_and_ended(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    left: list[subprocess.Popen[bytes]] = []

    def leave(live: LiveFleet) -> None:
        sleeps = "import time; time.sleep(1000)"
        left.append(subprocess.Popen([sys.executable, "-c", sleeps], env=os.environ | {MARK: live.mark}))

    monkeypatch.setattr("swarm.launch.drill.fleet_under_drill.LEAVING", 0.1)
    outcome = run.run_row(Row("leaves", "leaves a process", leave, laws=(), tick=1), LOCKSTEP, tmp_path)
    assert left[0].wait(10.0) == -9, "the drill ends what is left"
    assert outcome.outcome == "fail"
    assert "nothing left: " in outcome.seen
    assert f"left: process {left[0].pid} (" in outcome.seen
    (kept,) = tmp_path.iterdir()
    assert kept.name.startswith("leaves-max-")
    assert {"drill.yaml", "out.txt", "report.json"} <= {path.name for path in kept.iterdir()}


@pytest.mark.processes
def test_a_lost_stop_and_a_contact_of_a_real_run_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """The judge gets a real report, spoilt as a fault would spoil it."""
    finish = LiveFleet.finish

    def spoilt(live: LiveFleet, digest: str, expected: tuple[str, ...]) -> Observed:
        seen = finish(live, digest, expected)
        seen.report["per_robot"]["r2"]["reached"][-1] = None
        seen.report["contacts"]["wall"] = 1
        return replace(seen, digest="another")

    monkeypatch.setattr(LiveFleet, "finish", spoilt)
    outcome = run.run_row(ROWS["on-all-keys"], LOCKSTEP)
    assert outcome.outcome == "fail"
    assert outcome.seen == (
        "no contact: contacts: 1 wall; nothing lost: r2 lacks 1 target; "
        f"same run: digest {undisturbed_digest()[:8]} instead of another"
    )


@pytest.mark.processes
def test_a_fleet_that_cannot_start_is_told_and_nothing_is_left(tmp_path: Path) -> None:
    broken = SCENARIO.replace("robots: 4", "robots: 4\nnonsense: 1")
    outcome = run.run_row(ROWS["robot-killed"]._replace(scenario=broken), QUICK)
    assert outcome.outcome == "fail"
    assert "unknown field 'nonsense'" in outcome.seen
    assert "fault could not be injected" in outcome.seen
