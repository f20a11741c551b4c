"""A moment that goes on from a keyframe is the moment that a replay from the beginning gives; what does not fit is none."""

from collections.abc import Callable
from pathlib import Path

import pytest

from swarm.blackbox.explain.clauses import Cause
from swarm.blackbox.explain.state import RobotState
from swarm.blackbox.explain.tape_moment import Taped
from swarm.blackbox.replay import keyframes
from swarm.blackbox.replay.keyframes import Keyframe, Keyframes
from swarm.tape.reader import TapeFile
from tests.blackbox.explain.recorded import Recorded
from tests.storm.shared import plan_of

TICKS = 320  # of the tape
EVERY = 100  # ticks between two keyframes, made small below
Answers = list[tuple[list[Cause], RobotState]]


@pytest.fixture
def two(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Recorded:
    """A tape of two robots with what real runs have: a process that sleeps, a new one, late answers, lost broadcasts."""
    monkeypatch.setattr(keyframes, "FRAMES", 2 * EVERY)
    found = Recorded(tmp_path / "run.swarm", plan_of().to_scenario(), 2)
    found.run(120).run(20, away=["r1"]).run(40, late={"r2": 2})
    found.join("r1")
    return found.run(TICKS - 180, unheard=[("r2", "r1")])


@pytest.fixture
def room(tmp_path: Path) -> Path:
    """The folder for keyframes."""
    path = tmp_path / "room"
    path.mkdir(mode=0o700)
    return path


def asked(taped: Taped) -> Answers:
    return [(taped.why(robot), taped.state(robot)) for robot in taped.robots]


def opened(path: Path, room: Path | None, tick: int | None) -> tuple[Taped, int]:
    """Return the moment at a tick, and how many ticks were replayed for it."""
    taped, steps = Taped(TapeFile(path), room), 0

    def count(replay: object) -> None:
        nonlocal steps
        steps += 1

    taped.run_through(None, tick, count)
    return taped, steps


def test_a_keyframe_is_gone_on_from_and_answers_the_same_to_the_end(two: Recorded, room: Path) -> None:
    path = two.done()
    _, steps = opened(path, room, None)
    assert steps == TICKS
    for tick in (99, 150, 205, TICKS - 1):
        (taped, steps), (plain, _) = opened(path, room, tick), opened(path, None, tick)
        assert steps == (tick + 1) % EVERY
        assert asked(taped) == asked(plain)
        for moment in (taped, plain):
            while moment.step():
                pass
        assert asked(taped) == asked(plain)
        assert taped.doubt is plain.doubt is None
        assert taped.replay.answers == plain.replay.answers
        assert taped.world.measures.recorder.digest == plain.world.measures.recorder.digest


def test_a_tape_that_has_grown_keeps_its_keyframes(two: Recorded, room: Path) -> None:
    path = two.done()
    whole = path.read_bytes()
    path.write_bytes(whole[: next(row.mark.end for row in TapeFile(path).rows() if row.mark.ticks == 250)])
    opened(path, room, None)
    path.write_bytes(whole)
    taped, steps = opened(path, room, None)
    assert steps == TICKS - 2 * EVERY
    assert taped.doubt is None


def test_a_tape_with_another_past_has_no_keyframe_of_it(two: Recorded, room: Path) -> None:
    path = two.done()
    opened(path, room, None)
    file = TapeFile(path)
    third = list(file.rows())[30].mark.end
    content = bytearray(path.read_bytes())
    content[third - 1] ^= 1  # a bit of the check of an answer
    path.write_bytes(content)
    taped, steps = opened(path, room, 250)
    assert steps == 251
    assert taped.doubt is not None
    assert opened(path, room, 250)[0].doubt == taped.doubt, "a keyframe keeps the doubt"


SPOILT: dict[str, Callable[[bytes], bytes]] = {
    "empty": lambda good: b"",
    "cut": lambda good: good[:-1],
    "one bit": lambda good: good[:-9] + bytes([good[-9] ^ 1]) + good[-8:],
    "another pickle": lambda good: b"\x80\x04N.",
}


@pytest.mark.parametrize("name", SPOILT)
def test_a_spoilt_keyframe_is_none(name: str, two: Recorded, room: Path) -> None:
    path = two.done()
    opened(path, room, None)
    for file in room.rglob("*.keyframe"):
        file.write_bytes(SPOILT[name](file.read_bytes()))
    taped, steps = opened(path, room, 250)
    assert steps == 251
    assert taped.doubt is None


def test_a_disk_that_is_full_costs_no_answer(two: Recorded, room: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(path: Path, content: bytes) -> int:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    taped, steps = opened(two.done(), room, None)
    assert (steps, taped.doubt) == (TICKS, None)
    assert not list(room.rglob("*.keyframe"))


def test_the_tapes_asked_about_longest_ago_lose_theirs(
    room: Path, two: Recorded, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(keyframes, "MOST_TAPES", 2)
    for number in range(3):
        (room / f"old{number}").mkdir()
    opened(two.done(), room, None)
    assert len(list(room.iterdir())) == 2


def test_only_a_folder_that_is_ones_own_is_used(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    path = keyframes.make_keyframe_folder()
    assert path is not None
    assert path.stat().st_mode & 0o777 == 0o700
    path.chmod(0o777)
    assert keyframes.make_keyframe_folder() is None
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert keyframes.make_keyframe_folder() is None


def test_without_a_folder_there_is_none(two: Recorded) -> None:
    found: Keyframe | None = Keyframes(TapeFile(two.done())).nearest(TICKS)
    assert found is None
