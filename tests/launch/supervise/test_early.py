"""Errors of `swarm run` before the fleet: what can be known at once is said at once, and nothing is left running."""

from multiprocessing import forkserver
from typing import Any, Never

import pytest

from swarm.cli import main
from swarm.launch.supervise import fleet

WRONG = {
    "port": ("99999", "0 (a free one) to 65535"),
    "robots": ("1001", "1 to 1000"),
    "seed": ("-1", "0 to 2**53"),
    "limit": ("0", "seconds above 0"),
    "pace": ("never", "realtime"),
    "robots-per-process": ("0", "at least 1 robot"),
}


def unwanted(*args: Any, **kwargs: Any) -> Never:  # noqa: ANN401
    raise AssertionError("a process was started")


@pytest.mark.parametrize("option", WRONG)
def test_a_wrong_number_is_refused_before_anything_is_read_or_started(
    option: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    value, expected = WRONG[option]
    monkeypatch.setattr(fleet, "warm_up", unwanted)
    assert main(["run", "paper", f"--{option}={value}"]) == 2
    said = capsys.readouterr().err
    assert expected in said
    assert f"--{option}" in said


def test_the_fork_server_is_ended_if_the_scenario_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    """It would import for seconds more on a busy machine, and keep whoever reads the output waiting."""
    assert main(["run", "paper", "--robots", "99", "--dashboard", "off"]) == 2
    assert "found 25" in capsys.readouterr().err
    assert forkserver._forkserver._forkserver_pid is None  # type: ignore[attr-defined]
