"""`swarm analyze` of files that a test has written: recordings whole, cut and spoilt, and files that are none."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import rerun as rr
from msgspec.structs import replace

from dashboard.frames import is_whole
from swarm.cli import main
from swarm.messages import Account, Message, Phase, Status
from tests.dashboard.drawn import drawn, floor
from tests.dashboard.fold.test_analysis import DONE, HALF, status_of
from tests.dashboard.rehearsal import RATE, Rehearsal

Capture = pytest.CaptureFixture[str]
SECONDS = 10


def recorded(path: Path, robots: dict[str, Account], *, keep: bool = True) -> Path:
    """Record the first seconds of a run, whose world tells its status once a second; it is over at the end."""
    rehearsal = Rehearsal(2)
    messages: list[Message | None] = [floor(rehearsal)]
    for tick in range(SECONDS * RATE + 1):
        messages += [message for _, message, _ in rehearsal.messages(tick)]
        if tick % RATE == 0 and keep:
            messages += [told(robots, tick // RATE), None]
    drawn(path, messages)
    return path


def told(robots: dict[str, Account], second: int) -> Status:
    """Return what the world tells: the way of each robot grows by a metre a second."""
    phase = Phase.OVER if second == SECONDS else Phase.RUNNING
    ways = {name: replace(one, path_length=float(second)) for name, one in robots.items()}
    status = replace(status_of(ways), scenario="small", run=0, time=float(second), phase=phase)
    return replace(status, complete=phase is Phase.OVER, reason="")


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    return recorded(tmp_path_factory.mktemp("good") / "run.rrd", {"r1": DONE, "r2": HALF}).read_bytes()


def analysed(path: Path, capsys: Capture) -> dict[str, Any]:
    capsys.readouterr()
    assert main(["analyze", str(path), "--json"]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    found: dict[str, Any] = json.loads(out)
    return found


def test_a_whole_recording_has_the_numbers_of_its_end(good: bytes, tmp_path: Path, capsys: Capture) -> None:
    path = tmp_path / "run.rrd"
    path.write_bytes(good)
    found = analysed(path, capsys)
    assert found["per_robot"]["r1"]["path_length"] == SECONDS
    assert found["notes"] == []
    assert main(["analyze", str(path)]) == 0
    assert "small, run 0: complete after 10.0 s" in capsys.readouterr().out


@pytest.mark.parametrize("share", [0.6, 0.8, 0.99])
def test_a_cut_recording_has_the_numbers_before_the_cut_and_says_so(
    good: bytes, share: float, tmp_path: Path, capsys: Capture
) -> None:
    path = tmp_path / "run.rrd"
    path.write_bytes(good[: int(len(good) * share)])
    found = analysed(path, capsys)
    assert 0 < found["per_robot"]["r1"]["path_length"] <= SECONDS
    assert len(found["notes"]) == 1
    assert "the recording is cut" in found["notes"][0]


def spoilt(good: bytes) -> bytes:
    middle = len(good) // 2
    return good[:middle] + b"\xff" * 2000 + good[middle + 2000 :]


# fmt: off
BAD: dict[str, tuple[Callable[[bytes], bytes], str]] = {
    "empty":               (lambda good: b"",                         "got an empty file; give the FILE of `swarm run --record FILE`"),
    "another file":        (lambda good: b"name: small\nmap:\n",      "expected a recording (.rrd), got another file"),
    "cut in its head":     (lambda good: good[:7],                    "cut at its begin"),
    "cut before all":      (lambda good: good[:200],                  "expected an account of the run, found none: it is cut before the first"),
    "of a later Rerun":    (lambda good: good[:5] + b"c" + good[6:],  "got one of 0.99; analyze it with the version"),
    "spoilt":              (spoilt,                                   "expected a recording, got one that is spoilt"),
}
# fmt: on


@pytest.mark.parametrize("name", BAD)
def test_a_file_that_cannot_be_read_is_a_sentence_and_exit_status_2(
    good: bytes, name: str, tmp_path: Path, capfd: Capture
) -> None:
    spoil, reason = BAD[name]
    path = tmp_path / "run.rrd"
    path.write_bytes(spoil(good))
    assert main(["analyze", str(path)]) == 2
    out, err = capfd.readouterr()
    assert out == ""
    assert err.startswith(f"swarm: {path}: ")
    assert reason in err
    assert err.count("\n") == 1, "a sentence, no warning beside it"


def test_no_file_a_folder_and_two_files_are_sentences(tmp_path: Path, capsys: Capture) -> None:
    assert main(["analyze", str(tmp_path / "none.rrd")]) == 2
    assert "none.rrd: expected a recording that can be read, got: No such file or directory" in capsys.readouterr().err
    assert main(["analyze", str(tmp_path)]) == 2
    assert "got: Is a directory" in capsys.readouterr().err
    assert main(["analyze", "a.rrd", "b.rrd"]) == 2
    assert "expected one file, got 2" in capsys.readouterr().err


def test_a_recording_of_another_program_is_refused(tmp_path: Path, capsys: Capture) -> None:
    stream = rr.RecordingStream("somebody_else")
    stream.set_sinks(rr.FileSink(str(tmp_path / "other.rrd"), write_footer=True))
    stream.log("account", rr.TextDocument("{}"))
    stream.disconnect()
    assert main(["analyze", str(tmp_path / "other.rrd")]) == 2
    assert "expected a recording of a fleet, got one of somebody_else" in capsys.readouterr().err


def test_a_recording_without_an_account_says_why(tmp_path: Path, capsys: Capture) -> None:
    assert main(["analyze", str(recorded(tmp_path / "run.rrd", {}, keep=False))]) == 2
    assert "found none: its dashboard ended before the world had told it any" in capsys.readouterr().err


def test_the_file_of_a_dashboard_that_was_started_again_is_named(good: bytes, tmp_path: Path, capsys: Capture) -> None:
    first, second = tmp_path / "run.rrd", tmp_path / "run.2.rrd"
    first.write_bytes(good[: int(len(good) * 0.6)])
    second.write_bytes(good)
    (note,) = analysed(first, capsys)["notes"][1:]
    assert note == f"the dashboard was started again, and {second} goes on with this run; analyze that file"


@pytest.mark.parametrize("less", [0, 1, 16, 17, 40])
def test_a_recording_without_an_index_is_whole_if_it_has_its_end(good: bytes, less: int, tmp_path: Path) -> None:
    """The index is written when the file is made smaller, which may be impossible."""
    path = tmp_path / "run.rrd"
    path.write_bytes(good[: len(good) - less])
    assert is_whole(path) is (less == 0)
    path.write_bytes(good[: len(good) - 16 - 8] + bytes(24))
    assert is_whole(path), "zeros are data too"
    path.write_bytes(good[: len(good) - 24] + bytes(16))
    assert not is_whole(path), "zeros at a cut are no end"


@pytest.mark.parametrize("path", ["/dev/full", "/dev/zero", "/nowhere/run.rrd", "/tmp"])
def test_what_is_no_file_is_not_whole(path: str) -> None:
    assert not is_whole(Path(path))
