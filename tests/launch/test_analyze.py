"""`swarm analyze` of the tape of a real fleet: the figures of its report, to the last digit."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from swarm.cli import main
from swarm.messages import EVENT
from tests.dashboard.recorded import Recording
from tests.launch.actors import Fleet, await_clock, await_event, await_presence
from tests.shared import PAPER

pytestmark = pytest.mark.processes

SAME = ("scenario", "complete", "reason", "sim_time", "contacts", "clearance_min")  # in the report under these names


def analysed(tape: Path) -> dict[str, Any]:
    """Return what the command says of a tape, in a process of its own."""
    command = [sys.executable, "-m", "swarm.cli", "analyze", str(tape), "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stderr == ""
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def assert_agrees(found: dict[str, Any], report: dict[str, Any]) -> None:
    """Check that every figure which a report has too is the same."""
    assert {name: found[name] for name in SAME} == {name: report[name] for name in SAME}
    assert found["per_robot"].keys() == report["per_robot"].keys()
    for name, row in found["per_robot"].items():
        shared = row.keys() & report["per_robot"][name].keys()
        assert shared == row.keys() - {"detour"}
        assert {field: row[field] for field in shared} == {field: report["per_robot"][name][field] for field in shared}
    rows = report["per_robot"].values()
    for field in ("path_length", "waiting", "replans", "targets"):
        assert found["total"][field] == sum(row[field] for row in rows)


@pytest.mark.long("a whole mission and its replay")
def test_a_tape_agrees_with_the_report_to_the_last_digit(tmp_runtime: Path) -> None:
    tape = tmp_runtime / "run.swarm"
    options = ("--pace", "max", "--seed", "3", "--record", str(tape))
    with Fleet(PAPER, *options, robots=3, runtime=tmp_runtime) as fleet:
        assert fleet.end() == 0, fleet.text
        report = fleet.report()
    found = analysed(tape)
    assert_agrees(found, report)
    assert found["notes"] == []
    assert found["total"]["reached"] == sum(len(row["reached"]) for row in report["per_robot"].values())
    assert found["total"]["detour"] > 1.0
    waited = {name: row for name, row in found["per_robot"].items() if row["waits_for"]}
    assert all(set(row["waits_for"]) <= set(found["per_robot"]) - {name} for name, row in waited.items())


@pytest.mark.long("two missions")
def test_of_a_fleet_that_restarts_the_last_run_counts(small: Path, tmp_runtime: Path) -> None:
    tape = tmp_runtime / "run.swarm"
    with Fleet(small, "--pace", "4", "--wait", "--record", str(tape), runtime=tmp_runtime) as fleet:
        with fleet.bus() as bus:
            fleet.await_all(bus)
            assert main(["go"]) == 0
            await_clock(bus, lambda clock: clock.tick > 40)
            assert main(["restart"]) == 0
        assert fleet.end() == 0, fleet.text
        report = fleet.report()
    found = analysed(tape)
    assert_agrees(found, report)
    assert (found["run"], found["notes"]) == (1, [])


@pytest.mark.long("a recorded mission and a killed dashboard")
def test_what_a_killed_dashboard_left_and_what_the_next_one_recorded(small: Path, tmp_runtime: Path) -> None:
    """The second file begins where the second dashboard did; the tape has the whole run."""
    record, second, tape = (tmp_runtime / name for name in ("run.rrd", "run.2.rrd", "run.swarm"))
    options = ("--pace", "4", "--record", str(record), "--record", str(tape))
    with Fleet(small, *options, runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        bus.listen(EVENT)
        fleet.await_all(bus)
        await_event(bus, lambda event: event.kind == "reached")
        fleet.member("dashboard").kill()
        await_presence(bus, "dashboard", alive=False)
        await_presence(bus, "dashboard", alive=True)
        assert fleet.end() == 0, fleet.text
        report = fleet.report()
        text = fleet.text
    assert f"recorded without index: {record}  (" in text
    assert f"recorded: {second}  (" in text
    assert_agrees(analysed(tape), report)
    late, whole = Recording(second), tmp_runtime / "whole.rrd"
    assert main(["replay", str(tape), "--rrd", str(whole)]) == 0
    (begun, *_, over), (first, *_, last) = (
        [time for time, _ in one.rows("/world/robots", "Points2D:positions")] for one in (late, Recording(whole))
    )
    assert first < 1.0 < begun
    assert last == pytest.approx(report["sim_time"])
    assert last - over < 1.0
    lanes = [time for time, _ in late.rows("/progress/r1", "StateChange:state")]
    assert lanes[0] == 0.0, "as the world has recorded it"
