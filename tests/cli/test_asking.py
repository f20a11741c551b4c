"""`swarm why` and `swarm open`: they run a run again; one sentence for what is wrong."""

import json
from pathlib import Path

import pytest

from swarm.cli import main
from tests.storm.shared import plan_of

Capture = pytest.CaptureFixture[str]


@pytest.fixture
def plan(tmp_path: Path) -> str:
    """A plan of a storm in which r2 dies."""
    path = tmp_path / "plan.yaml"
    fault = [{"robot": "r2", "kind": "dead", "tick": 40}]
    path.write_text(plan_of(faults=fault).to_yaml(), encoding="utf-8")
    return str(path)


def test_why_names_the_cause_in_a_plan_of_a_storm(plan: str, capsys: Capture) -> None:
    assert main(["why", "r2", plan, "--at", "3"]) == 0
    assert capsys.readouterr().out.startswith("r2 at 3.00 s:\nr2 has not answered since 1.95 s")
    assert main(["why", "r2", plan, "--at", "3", "--json"]) == 0
    (cause,) = json.loads(capsys.readouterr().out)
    assert (cause["robot"], cause["clause"], cause["depth"]) == ("r2", "gone", 0)


def test_open_prints_the_state_in_a_shipped_scenario(capsys: Capture) -> None:
    assert main(["open", "r1", "corridor", "--at", "8"]) == 0
    state = json.loads(capsys.readouterr().out)
    assert (state["robot"], state["tick"], state["traffic"]["knows"].keys()) == ("r1", 160, {"r2"})


def test_a_time_after_the_end_is_the_end(plan: str, capsys: Capture, tmp_path: Path) -> None:
    calm = tmp_path / "calm.yaml"
    calm.write_text(plan_of().to_yaml(), encoding="utf-8")
    assert main(["why", "r1", str(calm), "--at", "1e6"]) == 0
    assert "has no stop left" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["r9", "corridor", "--at", "2"], "robot: expected one of r1, r2, got 'r9'"),
        (["r1", "corridor", "--at", "-1"], "--at: expected 0 to 1e6 s, got -1"),
        (["r1", "corridor", "--at", "nan"], "--at: expected 0 to 1e6 s, got nan"),
        (["r1", "corridor", "--at", "1", "--robots", "0"], "--robots: expected 1 to 1000, got 0"),
        (["r1", "corridor", "--at", "1", "--robots", "3"], "own_targets: expected a list for each of 3 robots"),
        (["r1", "corridor", "--at", "1", "--seed", "-1"], "--seed: expected 0 to 2**53, got -1"),
        (["r1", "no_such.yaml", "--at", "1"], "no_such.yaml"),
    ],
)
def test_what_is_wrong_is_one_sentence(words: list[str], text: str, capsys: Capture) -> None:
    for command in ("why", "open"):
        assert main([command, *words]) == 2
        said = capsys.readouterr()
        assert text in said.err
        assert said.err.count("\n") == 1
        assert said.out == ""


def test_a_file_that_is_neither_is_one_sentence(tmp_path: Path, capsys: Capture) -> None:
    path = tmp_path / "odd.yaml"
    for text in ("[1, 2", "storm: 7\n", "name: x\n"):
        path.write_text(text, encoding="utf-8")
        assert main(["why", "r1", str(path), "--at", "1"]) == 2
        assert capsys.readouterr().err.startswith("swarm: ")
