"""Tapes that are cut, changed, of another make, or no tapes: the last whole row counts, and a sentence says the rest."""

import re
from pathlib import Path
from typing import Any, Final

import msgpack
import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm.blackbox.replay.replay import replay_tape
from swarm.errors import ConfigError
from swarm.tape.reader import TapeFile
from swarm.tape.rows import FORMAT
from swarm.tape.writer import Tape
from tests.tape.made import made

LAST: Final = 1024  # bytes that are cut one by one


@pytest.fixture(scope="module")
def tape(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the tape of a run of eight seconds."""
    return made(tmp_path_factory.mktemp("tape") / "good.swarm", ticks=160)


def count(path: Path) -> tuple[int, int]:
    """Return the number of whole rows of a tape, and the bytes that are left out."""
    file = TapeFile(path)
    return sum(1 for _ in file.rows()), file.left_out


def said(path: Path) -> str:
    """Return what a replay says of a tape: why it is refused, what differs, that it is cut; "" for nothing."""
    try:
        replay = replay_tape(TapeFile(path))
    except ConfigError as fault:
        return str(fault)
    if replay.difference is not None:
        return f"tick {replay.difference.tick}: {replay.difference.text}"
    return f"cut: {replay.file.left_out} bytes" if replay.file.left_out else ""


def found_at(path: Path) -> int | None:
    """Return the tick at which the replay of a tape ends early or differs."""
    try:
        replay = replay_tape(TapeFile(path))
    except ConfigError as fault:
        return int(re.findall(r"tick (\d+):", str(fault))[0])
    if replay.difference is not None:
        return replay.difference.tick
    return replay.done if replay.file.left_out else None


def test_the_replay_of_a_tape_is_the_run(tape: Path) -> None:
    replay = replay_tape(TapeFile(tape))
    assert replay.difference is None
    assert (replay.done, replay.world.tick) == (160, 160)


def test_two_worlds_do_not_write_one_tape(tmp_path: Path) -> None:
    told, tape = list[str](), made(tmp_path / "one.swarm", ticks=1)
    world = TapeFile(tape).head.identity
    first, second = Tape(tape, told.append), Tape(tape, told.append)
    first.go_on(1, world)
    second.go_on(1, world)
    assert (first.is_on, second.is_on) == (True, False)
    assert told == [f"tape {tape}: cannot be written (another world writes it); this run has no tape"]
    first.close()


@pytest.mark.parametrize(("row", "ours"), [(0, True), (99, True), (1, False)])
def test_a_world_does_not_go_on_with_the_tape_of_another_run(row: int, ours: bool, tmp_path: Path) -> None:
    told, tape = list[str](), made(tmp_path / "other.swarm", ticks=1)
    before, one = tape.read_bytes(), Tape(tape, told.append)
    one.go_on(row, TapeFile(tape).head.identity if ours else "w9")
    assert not one.is_on
    assert told == [f"tape {tape}: it is of another run, or ends before this one was saved; this run has no tape"]
    assert tape.read_bytes() == before


LOST: Final = {("r1", 30), ("r1", 31), ("r2", 30), ("r2", 31)}


def test_a_step_whose_answer_is_lost_is_on_the_tape_if_the_robot_tells_of_it(tmp_path: Path) -> None:
    assert said(made(tmp_path / "lost.swarm", ticks=40, lost=LOST)) == ""


def test_a_step_that_is_not_on_the_tape_is_named_by_the_first_difference(tmp_path: Path) -> None:
    text = "its answer is another one; what it may have done in ticks 30 to 31 is not on the tape: "
    assert text in said(made(tmp_path / "lost.swarm", ticks=40, lost=LOST, told=False))


def test_a_tape_that_is_cut_at_any_byte_ends_with_its_last_whole_row(tape: Path, tmp_path: Path) -> None:
    whole, cut = tape.read_bytes(), tmp_path / "cut.swarm"
    rows, _ = count(tape)
    before = rows
    for size in range(len(whole) - 1, len(whole) - LAST, -1):
        cut.write_bytes(whole[:size])
        file = TapeFile(cut)
        found = sum(1 for _ in file.rows())
        assert before - 1 <= found <= before
        assert file.size + file.left_out == size, "what is behind the last whole row is told"
        before = found
    assert before < rows
    assert replay_tape(TapeFile(cut)).difference is None


def test_a_flipped_byte_is_found_at_its_tick(tape: Path, tmp_path: Path) -> None:
    whole, other, file = tape.read_bytes(), tmp_path / "flipped.swarm", TapeFile(tape)
    begin, tick = file.size, 0
    for row in file.rows():
        for at in range(begin, file.size, 11):  # a replay takes long
            flipped = bytearray(whole)
            flipped[at] ^= 1 << at % 8
            other.write_bytes(flipped)
            assert found_at(other) in {tick, tick + (not row.whole)}, f"byte {at} of row {row.number}"
        begin, tick = file.size, tick + row.whole


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (b"", "expected the head"),
        (b"hello", "expected the head"),
        (b"\xdd\xff\xff\xff\xff", "expected the head"),
        (msgpack.packb([b"x", 1]), "expected the head"),
        (b"\x91" * 5000, "expected the head"),
    ],
)
def test_what_is_no_tape_is_refused_in_a_sentence(content: bytes, told: str, tmp_path: Path) -> None:
    path = tmp_path / "bad.swarm"
    path.write_bytes(content)
    with pytest.raises(ConfigError, match=told):
        TapeFile(path)


def test_a_tape_of_another_format_is_refused(tmp_path: Path) -> None:
    path = made(tmp_path / "other.swarm", ticks=1, format="zenoh-swarm tape 99")
    with pytest.raises(ConfigError, match=f"expected '{FORMAT}', got 'zenoh-swarm tape 99'"):
        TapeFile(path)


plain = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**31), 2**32) | st.text(max_size=8) | st.binary(max_size=8),
    lambda inside: st.lists(inside, max_size=5),
    max_leaves=12,
)


@given(rows=st.lists(st.tuples(st.lists(plain, max_size=4) | st.none(), st.binary(max_size=10)) | plain, max_size=4))
def test_random_rows_end_in_a_sentence_or_in_a_replay(
    rows: list[Any], tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = made(tmp_path_factory.getbasetemp() / "random.swarm", ticks=2)
    with path.open("ab") as file:
        file.writelines(msgpack.packb(row) for row in rows)
    said(path)  # and raises no other error
