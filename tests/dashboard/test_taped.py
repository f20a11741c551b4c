"""`swarm replay --rrd`: the recording that is made of a tape is the one that a dashboard makes of the run."""

from pathlib import Path

import numpy as np
import pytest

from swarm.cli import main
from swarm.messages import STATUS, Phase, Status
from tests.blackbox.replay.test_processes import CASES, driven
from tests.dashboard.recorded import Recording
from tests.launch.actors import Fleet, await_clock, await_message
from tests.shared import mostly_long
from tests.tape.made import made

Capture = pytest.CaptureFixture[str]
SPOTS = ("/world/robots", "Points2D:positions")
TICKS = 60  # of a tape that a test makes, 20 in a second
EVENTS = ("/events", "TextLog:text")
# plans are drawn once a dashboard listens to their robots, which depends on the machine; a tape has no phases
LESS = ("/world/plans", EVENTS[0])


def spots(recording: Recording) -> dict[float, list[tuple[float, float]]]:
    return dict(recording.rows(*SPOTS))


def assert_the_same(drawn: Recording, live: Recording, share: float = 0.8) -> None:
    """Check that two recordings of a run have the same entities, and the same poses at all times that both have.

    ``share`` of the live one's times must be among them: it also asks for the newest truth, at any tick.
    """
    ours, theirs = ({one for one in each.components if not one[0].startswith(LESS)} for each in (drawn, live))
    assert ours == theirs
    assert drawn.rows(*EVENTS) == [row for row in live.rows(*EVENTS) if not row[1][0].startswith("phase: ")]
    taped, heard = spots(drawn), spots(live)
    both = taped.keys() & heard.keys()
    assert len(both) >= share * len(heard)
    for time in both:
        np.testing.assert_array_equal(taped[time], heard[time])
    assert drawn.rows("/world/map", "Image:buffer") == live.rows("/world/map", "Image:buffer")


@pytest.mark.long("a fleet with a dashboard, and its replay")
@pytest.mark.processes
def test_a_tape_gives_the_recordings_that_a_dashboard_has_made(small: Path, tmp_runtime: Path, capsys: Capture) -> None:
    record, tape, out = (tmp_runtime / name for name in ("live.rrd", "run.swarm", "out.rrd"))
    options = ("--pace", "5", "--limit", "25", "--record", str(record), "--record", str(tape))
    with Fleet(small, "--wait", *options, runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        fleet.await_all(bus, "dashboard")
        assert main(["go"]) == 0
        await_clock(bus, lambda clock: clock.tick > 40)
        assert main(["restart"]) == 0
        bus.listen(STATUS)
        last = await_message(bus, Status, lambda status: status.phase is Phase.OVER, "the world tells no end")
        fleet.end()
    assert main(["replay", str(tape), "--rrd", str(out)]) == 0
    second = out.with_stem("out-run2")
    assert capsys.readouterr().out.splitlines()[-2:] == [
        f"recorded: {file}  (open it with: rerun {file})" for file in (out, second)
    ]
    # a slow dashboard hears nothing of the first run but the tick of the restart, which no tape has: nobody moved in it
    assert_the_same(Recording(out), Recording(record), share=0.0)
    assert_the_same(Recording(second), Recording(record.with_stem("live-run2")))
    time, places = max(spots(Recording(second)).items())
    assert time == pytest.approx(last.time)
    np.testing.assert_allclose(places, [(row.pose[0], row.pose[1]) for row in last.robots], atol=1e-5)


@pytest.mark.processes
@pytest.mark.parametrize("name", mostly_long("a run of many seconds", ["killed world", "places, pool"]))
def test_whatever_happened_in_a_run_it_is_drawn_to_its_end_and_replayed_the_same(
    name: str, tmp_runtime: Path, capsys: Capture
) -> None:
    tape, out = tmp_runtime / "run.swarm", tmp_runtime / "out.rrd"
    report = driven(CASES[name], tape, tmp_runtime)
    capsys.readouterr()
    assert main(["replay", str(tape), "--rrd", str(out), "--laws"]) == 0
    *_, line = [Path(line.split()[1]) for line in capsys.readouterr().out.splitlines() if line.startswith("recorded: ")]
    times = list(spots(Recording(line)))
    assert times == sorted(set(times))
    assert times[-1] == pytest.approx(report["sim_time"])
    assert len(spots(Recording(line))[times[-1]]) == len(report["per_robot"])


@pytest.fixture
def tape(tmp_path: Path) -> Path:
    return made(tmp_path / "run.swarm", ticks=TICKS)


@pytest.mark.parametrize("lost", [0, 100])
def test_a_tape_that_is_cut_gives_a_recording_up_to_its_end(tape: Path, lost: int, tmp_path: Path) -> None:
    tape.write_bytes(tape.read_bytes()[: tape.stat().st_size - lost])
    (out := tmp_path / "out.rrd").write_bytes(b"of another day")
    assert main(["replay", str(tape), "--rrd", str(out)]) == 0
    recording = Recording(out)
    times = list(spots(recording))
    assert times[:-1] == pytest.approx([number / 10 for number in range(len(times) - 1)])
    assert TICKS / 20 - (1.5 if lost else 0.0) <= times[-1] <= TICKS / 20 - (0.05 if lost else 0.0)
    lanes = recording.rows("/progress/r1", "StateChange:state")
    assert lanes[0] == (0.0, ["ready"])


def test_a_tape_without_a_tick_gives_no_recording(tmp_path: Path, capsys: Capture) -> None:
    tape = made(tmp_path / "run.swarm", ticks=0)
    assert main(["replay", str(tape), "--rrd", str(tmp_path / "out.rrd")]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == f"not recorded: {tape} has no whole tick"
    assert not (tmp_path / "out.rrd").exists()


def test_the_rules_are_those_of_the_robot_that_is_named(tape: Path, tmp_path: Path, capsys: Capture) -> None:
    out = tmp_path / "out.rrd"
    for options, robot in (([], "r1"), (["--rules", "r2"], "r2")):
        assert main(["replay", str(tape), "--rrd", str(out), *options]) == 0
        texts = Recording(out).rows("/rules", "TextDocument:text")
        assert len(texts) >= TICKS / 20
        assert all(text.startswith(f"**{robot}**") for _, [text] in texts)
    capsys.readouterr()
    assert main(["replay", str(tape), "--rules", "r2"]) == 2
    assert capsys.readouterr().err.startswith("swarm: --rules: expected --rrd OUT.rrd too")


# fmt: off
WRONG = {
    "a folder":         ("{folder}",             "expected a file's name, got a folder"),
    "no folder":        ("{folder}/none/o.rrd",  "expected a folder that can be written"),
    "a full disk":      ("/dev/full",            "record: expected to write /dev/full"),
    "the tape":         ("{folder}/run.swarm",   "expected another file than a tape"),
    "another tape":     ("{folder}/old.swarm",   "expected another file than a tape"),
    "the tape's other name": ("{folder}/link.rrd", "expected another file than a tape"),
}
# fmt: on


@pytest.mark.parametrize("name", WRONG)
def test_a_file_that_cannot_be_written_is_a_sentence(name: str, tape: Path, tmp_path: Path, capsys: Capture) -> None:
    place, reason = WRONG[name]
    (tmp_path / "link.rrd").symlink_to(tape)
    before = tape.read_bytes()
    assert main(["replay", str(tape), "--rrd", place.format(folder=tmp_path)]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert reason in err
    assert err.count("\n") == 1
    assert tape.read_bytes() == before
