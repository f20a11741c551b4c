"""The file that an engine of containers looks at."""

import os
from pathlib import Path

import pytest

from swarm.bus import Bus, Endpoint
from swarm.errors import ConfigError
from swarm.heartbeat import NAMED_BY, Heartbeat


def test_the_file_is_touched_at_once_and_then_once_a_second(tmp_path: Path) -> None:
    file = tmp_path / "alive"
    heart = Heartbeat({NAMED_BY: str(file)})
    heart.beat()
    assert file.exists()
    os.utime(file, (1.0, 1.0))
    heart.beat()
    assert file.stat().st_mtime == 1.0, "a second has not passed"


def test_without_the_variable_nothing_is_touched_and_children_do_not_get_it(tmp_path: Path) -> None:
    Heartbeat({}).beat()
    environment = {NAMED_BY: str(tmp_path / "alive"), "OTHER": "x"}
    Heartbeat(environment)
    assert environment == {"OTHER": "x"}


def test_a_file_that_cannot_be_written_is_a_sentence(tmp_path: Path) -> None:
    file = tmp_path / "no folder" / "alive"
    with pytest.raises(ConfigError, match=f"{NAMED_BY}={file}: expected a file that can be written, got No such file"):
        Heartbeat({NAMED_BY: str(file)}).beat()


def test_a_bus_beats_when_its_owner_asks_for_what_has_come(endpoint: Endpoint, tmp_path: Path) -> None:
    file = tmp_path / "alive"
    with Bus(endpoint, "beats", heart=Heartbeat({NAMED_BY: str(file)})) as bus:
        assert not file.exists(), "threads do not beat"
        bus.receive(0.0)
        assert file.exists()
