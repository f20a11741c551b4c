"""A dashboard that comes late or again shows the story from its beginning: from the files of those before, or the world."""

import os
from collections.abc import Sequence
from pathlib import Path

import pytest
from msgspec.structs import replace

from dashboard.rerun import reader
from dashboard.rerun.reader import earlier
from swarm.messages import Account, Message, Phase, Status
from tests.dashboard.drawn import drawn, floor
from tests.dashboard.fold.test_analysis import NOTHING, account, status_of
from tests.dashboard.recorded import Recording
from tests.dashboard.rehearsal import RATE, Rehearsal

SPOTS = ("/world/robots", "Points2D:positions")
LANES = ("/progress/r1", "StateChange:state")


def status(rehearsal: Rehearsal, tick: int, row: Account) -> Status:
    rows: dict[str, Account | None] = dict.fromkeys(rehearsal.names, row)
    return replace(status_of(rows), world="here", run=rehearsal.run, time=tick / RATE, phase=Phase.RUNNING)


def shown(path: Path, ticks: range, files: Sequence[Path] = (), row: Account = NOTHING) -> Recording:
    """Record some ticks of a run, each second with what the world tells of it; the first is at the begin."""
    rehearsal = Rehearsal(2)
    messages: list[Message | None] = [floor(rehearsal), rehearsal.clock(ticks[0])]
    messages += [rehearsal.state(number, ticks[0]) for number in range(2)]
    for tick in ticks:
        messages += [message for _, message, _ in rehearsal.messages(tick)]
        messages += [status(rehearsal, tick, row), None] if tick % RATE == 0 else []
    return drawn(path, messages, files=files)


FIRST, LATER = range(201), range(300, 401)


@pytest.fixture
def first(tmp_path: Path) -> Path:
    """Return what a dashboard has recorded that was killed after ten seconds."""
    path = tmp_path / "run.rrd"
    shown(path, FIRST)
    os.truncate(path, path.stat().st_size - 100)
    return path


def test_the_next_dashboard_shows_what_the_killed_one_has_recorded(
    first: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    alone = shown(tmp_path / "alone.rrd", LATER)
    both = shown(tmp_path / "run.2.rrd", LATER, [first])
    spots = [round(time * RATE) for time, _ in both.rows(*SPOTS)]
    assert spots == [*range(0, 201, 2), *range(300, 401, 2)]
    assert both.rows(*SPOTS)[101:] == alone.rows(*SPOTS)
    assert [word for _, [word] in both.rows(*LANES)][1:4] == ["gives way", "to 1", "to 2"]
    assert both.rows(*LANES)[0][0] == 0.0
    assert len(both.rows("/events", "TextLog:text")) >= len(alone.rows("/events", "TextLog:text"))
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize(
    "fields", [{"world": "another"}, {"run": 7}, {"world": None}], ids=["another world", "another run", "not told"]
)
def test_what_is_of_another_run_is_not_shown(first: Path, tmp_path: Path, fields: dict[str, object]) -> None:
    found = earlier([first], replace(account({}), **({"world": "here", "time": 99.0} | fields)))
    assert found is None
    assert earlier([first], account({}, time=99.0)) == first
    assert earlier([first], account({}, time=1.0)) is None, "of a later time"


def test_the_newest_file_that_can_be_read_is_taken(first: Path, tmp_path: Path) -> None:
    second, third = tmp_path / "run.2.rrd", tmp_path / "run.3.rrd"
    second.write_bytes(first.read_bytes())
    third.write_bytes(b"no recording")
    asked = account({}, time=99.0)
    assert earlier([third, second, first], asked) == second
    assert earlier([tmp_path / "none.rrd", first], asked) == first
    again = first.with_stem("run-run2")
    first.rename(again)
    assert earlier([first], asked) == again, "a run after a restart has a file of its own"


def test_a_file_that_is_too_large_is_left_out(first: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reader, "LARGEST", 1000)
    assert earlier([first], account({}, time=99.0)) is None


def test_a_late_dashboard_shows_the_stops_before_as_the_world_has_recorded_them(tmp_path: Path) -> None:
    row = replace(NOTHING, reached=[2.5, 9.0, None, None])
    recording = shown(tmp_path / "late.rrd", range(600, 641), row=row)
    lanes = [(time, word) for time, [word] in recording.rows(*LANES)]
    assert lanes[:3] == [(0.0, "to 1"), (2.5, "to 2"), (9.0, "to 3")]
    assert all(time >= 30.0 for time, _ in lanes[3:])
    labels = recording.rows("/world/heading", "LineStrips2D:labels")
    assert min(time for time, _ in labels) >= 30.0, "names are those of now"
