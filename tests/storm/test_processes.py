"""Plans over real processes give the same run; features of the simulation only are refused or left out."""

import json
from pathlib import Path

import pytest
from msgspec.structs import replace

from swarm.cli import main
from swarm.launch import storm
from swarm.launch.storm import perform_both
from swarm.storm.history.history import record
from swarm.storm.plans.plan import only_simulated
from swarm.storm.results import Job
from tests.storm.shared import plan_of

Capture = pytest.CaptureFixture[str]

HARSH = plan_of(
    radio={"loss": 0.3, "range": 5.0},
    sensors={"noise": 0.02},
    movers=[{"waypoints": [[4.2, 1.4], [4.2, 3.4]], "speed": 0.1, "radius": 0.1}],
    edits=[
        {"at": 3.0, "kind": "wall", "low": [4.0, 2.8], "high": [4.3, 3.1]},
        {"at": 8.0, "kind": "free", "low": [4.0, 2.8], "high": [4.3, 3.1]},
    ],
)
FAULTS = [{"robot": "r1", "kind": "suspended", "tick": 10, "ticks": 40}]


@pytest.mark.long("a run over processes and the same in one")
@pytest.mark.processes
def test_a_plan_with_edits_movers_noise_and_loss_is_the_same_run_over_processes(tmp_runtime: Path) -> None:
    result = perform_both(Job("test", 1, HARSH), lambda: False)
    assert result.violations == ()
    assert result.complete
    assert result.features == ("edits", "loss", "movers", "short radio")


@pytest.mark.processes
def test_the_command_runs_a_plan_file_over_processes(tmp_runtime: Path, capsys: Capture) -> None:
    path = tmp_runtime / "plan.yaml"
    path.write_text(plan_of().to_yaml())
    assert main(["storm", str(path), "--over", "processes", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["runs"], told["failed"], told["left_out"]) == (1, 0, 0)


# fmt: off
REPORTS = {
    "another run": ({"digest": "f" * 32, "reason": ""}, "the run over processes has the digest ffffffffffff, not"),
    "no report":   ({"reason": "r1 ended"}, "the run over processes ended early (r1 ended) and has the digest none, not"),
}
# fmt: on


@pytest.mark.parametrize("name", REPORTS)
def test_another_digest_breaks_a_law(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    report, part = REPORTS[name]
    monkeypatch.setattr(storm, "run_over_processes", lambda plan, history, stop: (report, None))
    (violation,) = perform_both(Job("test", 1, plan_of()), lambda: False).violations
    assert violation.law == "same digest"
    assert violation.text.startswith(part)


def test_seeds_with_faults_of_the_simulation_are_left_out() -> None:
    result = perform_both(Job("test", 1, plan_of(faults=FAULTS, late=2)), lambda: False)
    assert result.left_out == "only the simulation has robots that are late or suspended"
    assert only_simulated(HARSH) == ""


def test_a_plan_file_with_such_faults_is_refused(tmp_path: Path, capsys: Capture) -> None:
    path = tmp_path / "plan.yaml"
    path.write_text(plan_of(faults=FAULTS).to_yaml())
    assert main(["storm", str(path), "--over", "processes"]) == 2
    assert capsys.readouterr().err == (
        f"swarm: {path}: only the simulation has robots that are suspended; run it without --over processes\n"
    )


@pytest.mark.long("two runs over processes, replayed")
@pytest.mark.processes
def test_the_first_answer_that_differs_is_named(tmp_runtime: Path) -> None:
    """The history is that of other noise."""
    history = record(HARSH)
    _, first = storm.run_over_processes(HARSH, history, lambda: False)
    assert first is None
    other = record(replace(HARSH, scenario=replace(HARSH.scenario, seed=2)))
    _, first = storm.run_over_processes(HARSH, other, lambda: False)
    assert first is not None
    pairs = zip(history.moments, other.moments, strict=False)
    tick = next(mine.tick for mine, theirs in pairs if mine.commands != theirs.commands)
    assert (first.law, first.tick) == ("same digest", tick)
    assert "answers otherwise: command." in first.text
