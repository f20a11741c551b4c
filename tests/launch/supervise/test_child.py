"""The entry point of a fleet's processes: how one ends when nobody is left to end it."""

import os
import signal
from threading import Event as Flag
from types import SimpleNamespace

import pytest

from swarm.launch.supervise import child


def test_without_a_launcher_a_process_is_told_to_end_and_then_killed(monkeypatch: pytest.MonkeyPatch) -> None:
    here, there = os.pipe()
    done: list[object] = []
    killed = Flag()

    def kill(pid: int, number: signal.Signals) -> None:
        assert pid == os.getpid()
        done.append(number)
        if number == signal.SIGKILL:
            killed.set()

    monkeypatch.setattr(child, "parent_process", lambda: SimpleNamespace(sentinel=here))
    monkeypatch.setattr(os, "kill", kill)
    monkeypatch.setattr(child, "sleep", done.append)
    child.die_with_parent()
    assert not killed.is_set(), "the launcher lives"
    os.close(there)
    assert killed.wait(10.0)
    os.close(here)
    assert done == [signal.SIGTERM, child.GRACE, signal.SIGKILL]
