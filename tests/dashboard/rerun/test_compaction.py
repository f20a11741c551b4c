"""A recording that is finished is made smaller, and has the same rows; what cannot be done is left as it is."""

from pathlib import Path

import pytest

from dashboard.rerun import recorder
from dashboard.rerun.recorder import compact
from tests.dashboard.drawn import played
from tests.dashboard.recorded import Recording
from tests.dashboard.rehearsal import Rehearsal

ROWS = (
    ("/world/robots", "Points2D:positions"),
    ("/progress/r1", "StateChange:state"),
    ("/distance", "Scalars:scalars"),
    ("/events", "TextLog:text"),
)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """Return a recording in as many chunks as a fleet's: one for each kind of thing and drawing."""
    played(tmp_path / "run.rrd", Rehearsal(2), ticks=400)
    return tmp_path / "run.rrd"


def test_a_compact_recording_has_the_same_rows_in_less_room(path: Path) -> None:
    before, size = Recording(path), path.stat().st_size
    compact(path, within=60.0)
    after = Recording(path)
    assert path.stat().st_size < size / 2
    assert after.entities == before.entities
    for entity, component in ROWS:
        assert after.rows(entity, component) == before.rows(entity, component)
    assert list(path.parent.iterdir()) == [path]


def test_a_recording_that_cannot_be_read_stays_as_it_is(path: Path) -> None:
    good = path.read_bytes()
    path.write_bytes(spoilt := good[:1000] + b"\xff" * 3000 + good[4000:])
    compact(path, within=60.0)
    assert path.read_bytes() == spoilt
    assert list(path.parent.iterdir()) == [path]


def test_without_time_room_or_program_it_stays_as_it_is(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = path.read_bytes()
    compact(path, within=0.0)
    monkeypatch.setattr(recorder, "LARGEST", 1000)
    compact(path, within=60.0)
    monkeypatch.undo()
    monkeypatch.setattr(recorder, "viewer_program", lambda: None)
    compact(path, within=60.0)
    assert path.read_bytes() == before
    assert list(path.parent.iterdir()) == [path]


def test_what_is_no_file_is_left_alone() -> None:
    compact(Path("/dev/full"), within=60.0)
    compact(Path("/dev/zero"), within=60.0)
    compact(Path("/nowhere/run.rrd"), within=60.0)
