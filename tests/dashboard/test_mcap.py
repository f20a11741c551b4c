"""`swarm replay --mcap`: the messages of a run, as a program that is not ours reads them."""

from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader

from swarm.blackbox.replay.replay import Replay
from swarm.blackbox.replay.wire import Wire
from swarm.bus.codec import decode
from swarm.cli import main
from swarm.messages import Broadcast, Clock, Event, Map, Message, Phase, Plan, State, Status, Truth
from swarm.messages.schema import schema_of
from swarm.tape.reader import TapeFile
from tests.blackbox.explain.recorded import Recorded
from tests.storm.shared import plan_of
from tests.tape.made import made

Capture = pytest.CaptureFixture[str]
KINDS = {f"swarm.{kind.__name__}": kind for kind in (Broadcast, Clock, Event, Map, Plan, State, Status, Truth)}


def read(path: Path) -> list[tuple[str, float, Message]]:
    """Return channel, time [s] and message of each row."""
    with path.open("rb") as file:
        rows: Any = list(make_reader(file).iter_messages(log_time_order=False))
    found = []
    for schema, channel, row in rows:
        kind = KINDS[schema.name]
        assert (schema.encoding, schema.data.decode(), channel.message_encoding) == (
            "jsonschema",
            schema_of(kind),
            "json",
        )
        found.append((channel.topic, row.log_time / 1e9, decode(row.data, kind, len(row.data), as_json=True)))
    return found


def test_every_message_of_the_run_is_there_at_its_time(tmp_path: Path, capsys: Capture) -> None:
    tape = Recorded(tmp_path / "run.swarm", plan_of().to_scenario(), 2).run(60).done()
    (out := tmp_path / "out.mcap").write_bytes(b"of another day")
    assert main(["replay", str(tape), "--mcap", str(out)]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == f"recorded: {out}"
    replay = Replay(TapeFile(tape))
    wire, expected = Wire(replay), list[Message]()
    while (tick := replay.step()) is not None:
        expected += wire.take(tick)
    expected += wire.end(Phase.OVER)
    rows = read(out)
    assert [message for _, _, message in rows] == expected
    for channel, time, message in rows:
        if isinstance(message, Truth):
            assert channel == "world/truth"
            assert time == pytest.approx(message.time)
        if isinstance(message, State | Broadcast):
            assert time == pytest.approx(message.tick / 20)
    assert {channel for channel, _, _ in rows} >= {
        "radio/r1",
        "radio/r2",
        "robot/r1/state",
        "robot/r2/plan",
        "world/map",
    }


def test_a_restarted_run_has_a_file_of_its_own(tmp_path: Path, capsys: Capture) -> None:
    recorded = Recorded(tmp_path / "run.swarm", plan_of().to_scenario(), 2).run(30)
    recorded.restart()
    out = tmp_path / "out.mcap"
    assert main(["replay", str(recorded.run(20).done()), "--mcap", str(out)]) == 0
    second = out.with_stem("out-run2")
    assert capsys.readouterr().out.splitlines()[-2:] == [f"recorded: {out}", f"recorded: {second}"]
    for file, run, ticks in ((out, 0, 30), (second, 1, 20)):
        times = [message.tick for _, _, message in read(file) if isinstance(message, Truth) and message.run == run]
        assert times[:ticks] == list(range(ticks))


def test_both_recordings_are_made_of_one_replay(tmp_path: Path, capsys: Capture) -> None:
    tape = made(tmp_path / "run.swarm", ticks=30)
    assert main(["replay", str(tape), "--mcap", str(tmp_path / "a.mcap"), "--rrd", str(tmp_path / "a.rrd")]) == 0
    assert [line.split()[1] for line in capsys.readouterr().out.splitlines()[-2:]] == [
        str(tmp_path / "a.rrd"), str(tmp_path / "a.mcap"),
    ]  # fmt: skip


def test_what_cannot_be_written_is_one_sentence(tmp_path: Path, capsys: Capture) -> None:
    tape = made(tmp_path / "run.swarm", ticks=10)
    for out in (tmp_path, tmp_path / "none" / "a.mcap", tape, Path("/dev/full")):
        assert main(["replay", str(tape), "--mcap", str(out)]) == 2
        said = capsys.readouterr().err
        assert said.startswith(f"swarm: --mcap {out}: ") or str(out) in said
        assert said.count("\n") == 1


def test_a_tape_without_a_tick_gives_no_file(tmp_path: Path, capsys: Capture) -> None:
    tape = made(tmp_path / "run.swarm", ticks=0)
    assert main(["replay", str(tape), "--mcap", str(tmp_path / "out.mcap")]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == f"not recorded: {tape} has no whole tick"
