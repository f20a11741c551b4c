"""`why` and `open` on tapes: as in a simulation, and what only real runs have: late, sleeping and killed processes."""

from pathlib import Path

import pytest

from swarm.blackbox.explain.clauses import Cause, Clause
from swarm.blackbox.explain.moment import Simulated, run_moment_until
from swarm.blackbox.explain.tape_moment import Taped
from swarm.blackbox.explain.timeline import Timeline
from swarm.errors import ConfigError
from swarm.scenario.load import load
from swarm.tape.reader import TapeFile
from swarm.tape.writer import Tape
from tests.blackbox.explain.recorded import Recorded
from tests.shared import ROOT
from tests.storm.shared import plan_of
from world.fleet.publisher import floor
from world.simulate import Simulation


@pytest.fixture
def two(tmp_path: Path) -> Recorded:
    """Two robots that change sides on the small floor of storm's tests."""
    return Recorded(tmp_path / "run.swarm", plan_of().to_scenario(), 2)


def why(recorded: Recorded, robot: str, tick: int) -> list[Cause]:
    taped = Taped(TapeFile(recorded.done()))
    taped.run_through(None, tick)
    assert taped.past.tick == tick
    assert taped.replay.difference is None
    return taped.why(robot)


def test_a_tape_has_the_answers_and_states_of_the_simulation(tmp_path: Path) -> None:
    scenario = load(ROOT / "scenarios" / "corridor.yaml")
    taped = Taped(TapeFile(Recorded(tmp_path / "run.swarm", scenario, 2).run(400).done()))
    simulated = Simulated(Simulation.of(scenario, 2, 1))
    for tick in range(0, 400, 10):
        taped.run_through(None, tick)
        run_moment_until(simulated, tick)
        for robot in ("r1", "r2"):
            assert taped.why(robot) == simulated.why(robot)
            assert taped.state(robot) == simulated.state(robot)


@pytest.mark.parametrize("robot", ["r1", "r2"])
def test_a_process_that_sleeps_is_gone_until_it_answers_again(two: Recorded, robot: str) -> None:
    (cause,) = why(two.run(50).run(20, away=[robot]).run(10), robot, 60)
    assert cause.clause is Clause.GONE
    assert cause.text == f"{robot} is gone since 2.45 s: its process sleeps, and answers again at 3.50 s."


def test_a_process_that_leaves_out_a_tick_is_there(two: Recorded) -> None:
    (cause,) = why(two.run(50).run(2, away=["r1"]).run(10), "r1", 51)
    assert cause.clause is not Clause.GONE


def test_a_killed_process_is_gone_until_a_new_one_answers(two: Recorded) -> None:
    two.run(50).run(20, away=["r1"])
    two.join("r1")
    (cause,) = why(two.run(10), "r1", 60)
    assert cause.text == "r1 is gone since 2.45 s: its process has ended, and a new one answers at 3.50 s."


def test_the_new_process_listens_first(two: Recorded) -> None:
    two.run(50).run(20, away=["r1"])
    two.join("r1")
    (cause,) = why(two.run(10), "r1", 75)
    assert (cause.clause, "began to answer at 3.50 s" in cause.text) == (Clause.LISTENS, True)


def test_a_killed_process_that_nobody_replaces_is_gone(two: Recorded) -> None:
    (cause,) = why(two.run(50).run(30, away=["r1"]), "r1", 60)
    assert cause.text == "r1 is gone since 2.45 s: it does not answer again on this tape."


def test_an_answer_that_comes_too_late_is_named_with_its_times(two: Recorded) -> None:
    two.run(50).run(1, late={"r1": 12}).run(11, away=["r1"]).run(10)
    (cause,) = why(two, "r1", 58)
    assert cause.clause is Clause.LATE
    assert "its answer for 2.50 s came late, at 3.10 s" in cause.text


def test_answers_that_are_always_too_late_are_named(two: Recorded) -> None:
    (cause,) = why(two.run(10).run(60, late={"r1": 8}), "r1", 50)
    assert cause.text == (
        "r1 is late: what it answers at 2.50 s is for 2.10 s; a command lasts 0.25 s, so its wheels stand."
    )


def test_an_answer_that_is_a_little_late_moves_the_wheels(two: Recorded) -> None:
    (cause,) = why(two.run(60, late={"r1": 3, "r2": 2}), "r1", 55)
    assert cause.clause is Clause.DRIVES


def test_a_robot_that_was_told_to_stop_stands_by_order(two: Recorded) -> None:
    two.run(50)
    two.stop("r2")
    (cause,) = why(two.run(30), "r2", 70)
    assert cause.clause is Clause.ORDER


def test_a_robot_of_other_code_is_named_as_one(two: Recorded) -> None:
    two.run(20)
    two.join("r2", ours=False)
    two.run(40)
    (cause,) = why(two, "r2", 50)
    assert cause.clause is Clause.FOREIGN


def test_a_broadcast_that_the_radio_carried_and_the_network_did_not_is_under_way(two: Recorded) -> None:
    taped = Taped(TapeFile(two.run(31).run(60, unheard=[("r2", "r1")]).done()))
    found = [cause for _ in iter(taped.step, False) for cause in taped.why("r1")]
    coming = [cause for cause in found if "still on its way through the network" in cause.text]
    assert {(cause.robot, cause.clause) for cause in coming} == {("r1", Clause.COMING)}


def test_the_last_run_and_the_last_life_of_a_tick_count(tmp_path: Path) -> None:
    """A world that was killed lives ticks again; a restart begins a new run, from tick 0."""
    path, scenario = tmp_path / "run.swarm", plan_of().to_scenario()
    world = Simulation.of(scenario, 2, 1).world
    tape = Tape(path, lambda line: None)
    tape.begin(
        seed=1, pace="1", limit=9.0, identity="local", run=0, outside=[], map=floor(scenario, world),
    )  # fmt: skip
    for number in range(12):
        if number == 4:
            saved = tape.note_save()
        if number == 6:
            tape.close()
            tape.go_on(saved, "local")
        if number == 9:
            tape.note_restart()
        tape.step()
    tape.close()
    timeline = Timeline.read_timeline(TapeFile(path))
    assert timeline.ticks == [*((0, tick) for tick in (0, 1, 2, 3, 4, 5, 4, 5, 6)), (1, 0), (1, 1), (1, 2)]
    assert timeline.last(0, 5) == 8
    assert timeline.last(None, 1) == 11
    with pytest.raises(ConfigError, match="--run: expected 0 to 1, got 2"):
        timeline.last(2, 0)
