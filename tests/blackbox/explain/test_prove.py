"""`why --prove`: the run goes on as it would have, and with one thing changed that a chain of causes names."""

from collections.abc import Callable
from pathlib import Path

import pytest

from swarm.blackbox.explain.clauses import Cause, Clause
from swarm.blackbox.explain.continuation import Onward
from swarm.blackbox.explain.moment import Instant, Simulated, run_moment_until
from swarm.blackbox.explain.prove import Proof, prove
from swarm.blackbox.explain.tape_moment import Taped
from swarm.errors import ConfigError
from swarm.messages import RobotAction, RobotDo
from swarm.tape.reader import TapeFile
from tests.blackbox.explain.recorded import Recorded
from tests.blackbox.explain.test_why import deaf, first, one_behind_the_other, shipped, two
from tests.storm.shared import plan_of
from world.faults import Faults
from world.simulate import Simulation


def proofs(make: Callable[[], Simulation], robot: str, tick: int, causes: list[Cause] | None = None) -> list[Proof]:
    def again() -> Instant:
        return run_moment_until(Simulated(make()), tick)

    moment = again()
    return prove(robot, causes or moment.why(robot), moment, again)


def test_a_moment_goes_on_as_the_run_did() -> None:
    as_it_was, moment = (
        Simulated(shipped("crossing", 8, radio={"loss": 0.2})),
        shipped("crossing", 8, radio={"loss": 0.2}),
    )
    onward = Onward(run_moment_until(Simulated(moment), 199))
    for _ in range(100):
        onward.step()
    run_moment_until(as_it_was, 299)
    assert onward.world.tick == as_it_was.world.tick == 300
    assert onward.world.poses() == as_it_was.world.poses()


def test_a_dead_robot_that_answered_would_have_gone_out_of_the_way() -> None:
    def make() -> Simulation:
        return one_behind_the_other(Faults(killed={"r2": 2.0}))

    tick = first(make(), Clause.HELD, "r1", after=160).moment.past.tick
    (proof,) = proofs(make, "r1", tick)
    assert (proof.change, proof.before, proof.changes_wait) == ("r2 answering", None, True)
    assert proof.after is not None
    assert proof.text == f"With r2 answering, r1 waits {proof.after:.2f} s more, instead of longer than 20 s."


def test_a_robot_that_stands_by_order_would_have_gone_on() -> None:
    def make() -> Simulation:
        simulation = one_behind_the_other()
        simulation.world.request("r2", RobotAction(do=RobotDo.STOP))
        return simulation

    tick = first(make(), Clause.CUT_OFF, "r1", after=160).moment.past.tick
    (proof,) = proofs(make, "r1", tick)
    assert (proof.change, proof.before, proof.changes_wait) == ("r2 told to go on", None, True)


def test_a_lost_broadcast_that_is_delivered_ends_the_wait() -> None:
    stood = first(shipped("corridor", 2), Clause.STANDS, "r2").moment.past.tick

    def make() -> Simulation:
        return deaf(shipped("corridor", 2), 1, 0, stood)

    tick = first(make(), Clause.LOST, "r2").moment.past.tick
    (proof,) = proofs(make, "r2", tick)
    assert "r1's broadcast of" in proof.change
    assert "delivered to r2" in proof.change
    assert proof.after is not None
    assert proof.before is None or proof.after < proof.before


@pytest.mark.long("runs that are run again from a moment")
def test_a_root_that_is_stopped_makes_the_wait_longer() -> None:
    (proof,) = proofs(lambda: shipped("office", 8), "r4", 790)
    assert proof.change == "r7 stopped"
    assert proof.before is not None
    assert proof.after is None or proof.after > proof.before


@pytest.mark.long("runs that are run again from a moment")
def test_a_robot_that_has_nothing_to_do_with_it_changes_nothing_and_the_proof_says_so() -> None:
    causes = [Cause(0, "r4", Clause.TURN, "", "r1"), Cause(1, "r1", Clause.DRIVES, "")]
    (proof,) = proofs(lambda: shipped("office", 8), "r4", 790, causes)
    assert not proof.changes_wait
    assert proof.text.startswith("With r1 stopped, nothing changes: r4 waits ")


def test_a_robot_that_drives_has_nothing_to_prove() -> None:
    tick = first(two(), Clause.DRIVES, "r1").moment.past.tick
    assert proofs(two, "r1", tick) == []


def test_what_a_robot_of_other_code_would_have_done_is_not_known(tmp_path: Path) -> None:
    recorded = Recorded(tmp_path / "run.swarm", plan_of().to_scenario(), 2).run(20)
    recorded.join("r2", ours=False)
    taped = Taped(TapeFile(recorded.run(40).done()))
    taped.run_through(None, 50)
    with pytest.raises(ConfigError, match="--prove: expected only robots whose code and body are here, got r2"):
        prove("r1", taped.why("r1"), taped, lambda: taped)


def test_a_process_that_sleeps_comes_back_when_it_did(tmp_path: Path) -> None:
    recorded = Recorded(tmp_path / "run.swarm", plan_of().to_scenario(), 2)
    taped = Taped(TapeFile(recorded.run(50).run(20, away=["r1"]).run(30).done()))
    taped.run_through(None, 60)
    onward = Onward(taped)
    steps = []
    for _ in range(12):
        onward.step()
        steps.append(onward.robots["r1"].last_decision)
    same = [one is steps[0] for one in steps]
    assert same == [True] * 9 + [False] * 3
