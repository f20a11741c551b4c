"""The plan of a run: what happened to its robots and was asked for is in it, and in lockstep it is the same run."""

from pathlib import Path

import pytest

from swarm.blackbox.replay.storm_plan import as_plan
from swarm.cli import main
from swarm.errors import ConfigError
from swarm.storm.laws.judge import Violation
from swarm.storm.plans.plan import PlannedFault, StormPlan, read
from swarm.storm.results import Job, perform
from swarm.tape.reader import TapeFile
from tests.blackbox.explain.recorded import Recorded
from tests.launch.actors import Fleet, judge_tapes
from tests.shared import ROOT
from tests.storm.shared import plan_of

Capture = pytest.CaptureFixture[str]


@pytest.fixture
def two(tmp_path: Path) -> Recorded:
    """Two robots that change sides on the small floor of storm's tests."""
    return Recorded(tmp_path / "run.swarm", plan_of().to_scenario(), 2)


def planned(recorded: Recorded) -> StormPlan:
    plan, left_out = as_plan(TapeFile(recorded.done()))
    assert left_out == []
    return plan


def test_a_run_without_faults_has_none(two: Recorded) -> None:
    plan = planned(two.run(60))
    assert (plan.faults, plan.mute, plan.late, plan.slow) == ([], [], 0, 0)
    assert plan.scenario.map.text == plan_of().scenario.map.text


def test_who_slept_was_replaced_or_died_is_told_apart(two: Recorded) -> None:
    two.run(50).run(20, away=["r1"]).run(10).run(30, away=["r2"])
    two.join("r2")
    plan = planned(two.run(20).run(60, away=["r1"]))
    assert plan.faults == [
        PlannedFault(robot="r1", kind="suspended", tick=50, ticks=20),
        PlannedFault(robot="r1", kind="dead", tick=130),
        PlannedFault(robot="r2", kind="away", tick=80, ticks=30),
    ]


def test_late_answers_are_in_it(two: Recorded) -> None:
    plan = planned(two.run(40, late={"r1": 2, "r2": 2}).run(10, late={"r1": 3, "r2": 2}))
    assert (plan.late, plan.slow) == (2, 1)


def test_a_robot_of_other_code_is_mute(two: Recorded) -> None:
    two.join("r2", ours=False)
    assert planned(two.run(30)).mute == ["r2"]


def test_a_request_is_in_it_at_its_time(two: Recorded) -> None:
    two.run(50)
    two.stop("r2")
    (order,) = planned(two.run(30)).scenario.orders
    assert (order.at, order.robot, order.do) == (2.5, "r2", "stop")


@pytest.mark.long("a run over processes and its plan")
@pytest.mark.processes
def test_the_plan_of_a_run_in_lockstep_is_the_same_run(tmp_runtime: Path, capsys: Capture) -> None:
    tape, out = tmp_runtime / "run.swarm", tmp_runtime / "kept.yaml"
    options = ("--pace", "max", "--limit", "60", "--record", str(tape))
    with Fleet(ROOT / "scenarios" / "corridor.yaml", *options, robots=2, runtime=tmp_runtime) as fleet:
        assert fleet.end() in {0, 1}
        report = fleet.report()
    assert main(["storm", "--from", str(tape), "--out", str(out)]) == 0
    assert capsys.readouterr().out.splitlines()[-3:-1] == ["the run breaks no law", "its plan breaks no law"]
    plan = read(out)
    assert perform(Job(plan.profile, plan.seed, plan)).digest == report["digest"]


def test_a_run_that_broke_a_law_is_told(two: Recorded, monkeypatch: pytest.MonkeyPatch, capsys: Capture) -> None:
    found = [Violation("no contact", 7, ("r1",), "r1 touches r2")]
    monkeypatch.setattr("swarm.blackbox.replay.judge.Watch.judge_laws", lambda watch: found)
    assert main(["storm", "--from", str(two.run(30).done())]) == 1
    assert "the run breaks no contact, tick 7: r1 touches r2\n" in capsys.readouterr().out


def test_the_tapes_of_process_tests_are_judged(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tape = tmp_path / "zenoh-swarm-0" / "fleet.swarm"
    tape.parent.mkdir()
    Recorded(tape, plan_of().to_scenario(), 2).run(30).done()
    judge_tapes(tmp_path)
    content = bytearray(tape.read_bytes())
    content[-1] ^= 1
    tape.write_bytes(content)
    with pytest.raises(AssertionError, match="its answer is another one"):
        judge_tapes(tmp_path)
    content[-1] ^= 1
    tape.write_bytes(content)
    found = Violation("no contact", 7, ("r1",), "r1 touches r2")
    monkeypatch.setattr("swarm.blackbox.replay.judge.Watch.judge_laws", lambda watch: [found])
    with pytest.raises(AssertionError, match="r1 touches r2"):
        judge_tapes(tmp_path)


def test_no_tape_is_one_sentence(tmp_path: Path, capsys: Capture) -> None:
    file = tmp_path / "run.swarm"
    file.write_text("storm: 1")
    assert main(["storm", "--from", str(file)]) == 2
    assert "expected the head of a tape" in capsys.readouterr().err
    with pytest.raises(ConfigError, match="No such file"):
        as_plan(TapeFile(tmp_path / "none.swarm"))
