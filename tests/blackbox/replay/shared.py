"""A replay under test: its answers and digest are those of the run, and its laws are kept."""

from pathlib import Path
from typing import Any

from swarm.blackbox.replay.judge import Watch
from swarm.blackbox.replay.replay import Replay, replay_tape
from swarm.tape.reader import TapeFile


def assert_replayed(tape: Path, report: dict[str, Any]) -> Replay:
    """Check that a tape gives the run again of which the world has written a report, and that it broke no law."""
    watch = Watch()
    replay = replay_tape(TapeFile(tape), watch.take)
    assert replay.difference is None, replay.difference
    assert replay.file.left_out == 0
    assert replay.world.measures.recorder.digest == report["digest"]
    assert watch.judge_laws() == []
    return replay
