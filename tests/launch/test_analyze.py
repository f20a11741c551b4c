"""`swarm analyze` of the recording of a real fleet: the figures of its report, to the last digit."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from dashboard.frames import readable
from dashboard.rerun.reader import read_account
from swarm.cli import main
from swarm.errors import ConfigError
from swarm.messages import EVENT, Phase
from tests.dashboard.recorded import Recording
from tests.launch.actors import Fleet, await_clock, await_event, await_phase, await_presence
from tests.shared import PAPER, mostly_long

pytestmark = pytest.mark.processes

SAME = ("scenario", "complete", "reason", "sim_time", "contacts", "clearance_min")  # in the report under these names


def analysed(record: Path) -> dict[str, Any]:
    """Return what the command says of a recording, in a process of its own."""
    command = [sys.executable, "-m", "swarm.cli", "analyze", str(record), "--json"]
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


@pytest.mark.costs("a recorded mission, which is run again from its tape")
@pytest.mark.parametrize("pace", mostly_long("a whole mission in real time", ["max", "20"], "max"))
def test_a_recording_and_a_tape_agree_with_the_report_to_the_last_digit(tmp_runtime: Path, pace: str) -> None:
    record, tape = tmp_runtime / "run.rrd", tmp_runtime / "run.swarm"
    options = ("--pace", pace, "--seed", "3", "--record", str(record), "--record", str(tape))
    with Fleet(PAPER, *options, robots=3, runtime=tmp_runtime) as fleet:
        assert fleet.end() == 0, fleet.text
        report = fleet.report()
    of_tape = analysed(tape)
    assert_agrees(of_tape, report)
    assert (of_tape["notes"], of_tape["over"]) == ([], True)
    found = analysed(record)
    assert_agrees(found, report)
    assert found["notes"] == []
    assert found["over"]
    assert found["total"]["reached"] == sum(len(row["reached"]) for row in report["per_robot"].values())
    assert found["total"]["detour"] > 1.0
    assert found["messages"]["heard"]["world/truth"] > 100
    waited = {name: row for name, row in found["per_robot"].items() if row["waits_for"]}
    assert all(set(row["waits_for"]) <= set(found["per_robot"]) - {name} for name, row in waited.items())


@pytest.mark.long("two recorded missions")
def test_each_run_of_a_fleet_that_restarts_has_its_own_figures(small: Path, tmp_runtime: Path) -> None:
    record = tmp_runtime / "run.rrd"
    with Fleet(small, "--pace", "max", "--wait", "--record", str(record), runtime=tmp_runtime) as fleet:
        with fleet.bus() as bus:
            fleet.await_all(bus)
            assert main(["go"]) == 0
            await_clock(bus, lambda clock: clock.tick > 40)
            assert main(["pause"]) == 0
            await_phase(bus, Phase.PAUSED)
            before = await_phase(bus, Phase.PAUSED)
            assert main(["restart"]) == 0
            assert main(["resume"]) == 0
        assert fleet.end() == 0, fleet.text
        report = fleet.report()
    second = analysed(record.with_stem("run-run2"))
    assert_agrees(second, report)
    assert (second["run"], second["notes"]) == (1, [])
    first = analysed(record)
    assert (first["run"], first["over"], first["sim_time"]) == (0, False, before.time)
    assert first["notes"] == [
        f"the recording ends before the run; the numbers are those of {before.time:.1f} s, without the shortest ways"
    ]


@pytest.mark.long("a recorded mission and a killed dashboard")
def test_what_a_killed_dashboard_left_and_what_the_next_one_recorded(small: Path, tmp_runtime: Path) -> None:
    """The second file has the figures of the whole run, since the world has measured all of it."""
    record, second = tmp_runtime / "run.rrd", tmp_runtime / "run.2.rrd"
    with Fleet(small, "--pace", "4", "--record", str(record), runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        bus.listen(EVENT)
        fleet.await_all(bus)
        await_event(bus, lambda event: event.kind == "reached")
        assert main(["pause"]) == 0
        await_clock(bus, lambda clock: has_account(record))  # the world tells its clock once a second
        fleet.member("dashboard").kill()
        await_presence(bus, "dashboard", alive=False)
        await_presence(bus, "dashboard", alive=True)
        assert main(["resume"]) == 0
        assert fleet.end() == 0, fleet.text
        report = fleet.report()
    assert_agrees(analysed(second), report)
    assert_shows_all(second, record, report["sim_time"])
    first = analysed(record)
    assert not first["over"]
    assert first["total"]["reached"] < report["robots"] * len(report["per_robot"]["r1"]["reached"])
    assert "the recording is cut: its dashboard was killed" in first["notes"][0]
    assert (
        first["notes"][1] == f"the dashboard was started again, and {second} goes on with this run; analyze that file"
    )


def has_account(record: Path) -> bool:
    """Return True if a recording that is being written has an account that counts a stop."""
    try:
        account, _ = read_account(record)
    except ConfigError:
        return False
    return any(time is not None for row in account.robots.values() for time in row.reached)


def assert_shows_all(second: Path, first: Path, over: float) -> None:
    """Check that the second file shows the run from what the first one has up to its end [s]."""
    with readable(first) as file:
        before = Recording(file).rows("/world/robots", "Points2D:positions")
    rows = Recording(second).rows("/world/robots", "Points2D:positions")
    assert rows[: len(before)] == before
    assert before[0][0] < 1.0
    assert over - rows[-1][0] < 1.0
