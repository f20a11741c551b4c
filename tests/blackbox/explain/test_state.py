"""`open`: a robot's state at a tick is what the world, the wire and the robot itself have of it."""

import msgspec
import pytest

from swarm.blackbox.explain.moment import Instant, Simulated, run_moment_until
from swarm.blackbox.explain.run_history import KEPT
from swarm.blackbox.explain.state import RobotState
from tests.storm.shared import plan_of
from world.faults import Faults
from world.simulate import Simulation


@pytest.fixture
def moment() -> Instant:
    return run_moment_until(Simulated(Simulation.of(plan_of().to_scenario(), 2, 1)), 80)


@pytest.mark.parametrize("robot", ["r1", "r2"])
def test_the_state_is_that_of_the_wire(moment: Instant, robot: str) -> None:
    state, sense, command = moment.state(robot), moment.past.senses[robot], moment.past.commands[robot]
    assert (state.tick, state.time, state.answered, state.activity) == (80, 4.0, True, command.activity.value)
    assert state.pose == (sense.x, sense.y, sense.yaw)
    assert state.wheels == (command.left, command.right)
    assert state.heard == sense.hears
    assert state.traffic is not None
    assert list(state.traffic.held) == command.held
    assert abs(sum(state.tables["weights"].values()) - 1.0) < 1e-9


def test_it_has_what_is_known_of_the_other(moment: Instant) -> None:
    mine, theirs = moment.state("r1").traffic, moment.past.said["r2"]
    assert mine is not None
    known = mine.knows["r2"]
    said = {words.tick: words.traffic.own for words in theirs if words.traffic is not None}
    assert (known.held, known.claims, known.silent) == (said[known.stamp].held, said[known.stamp].claims, False)


def test_it_is_plain_data(moment: Instant) -> None:
    state = moment.state("r1")
    assert msgspec.json.decode(msgspec.json.encode(state), type=RobotState) == state


def test_a_dead_robot_has_not_answered_and_falls_silent() -> None:
    moment = run_moment_until(Simulated(Simulation.of(plan_of().to_scenario(), 2, 1, Faults(killed={"r2": 1.0}))), 100)
    assert not moment.state("r2").answered
    mine = moment.state("r1").traffic
    assert mine is not None
    assert mine.knows["r2"].silent


def test_a_long_run_needs_no_more_memory_than_a_minute() -> None:
    """r2 is dead for longer than that: its last words stay."""
    moment = run_moment_until(
        Simulated(Simulation.of(plan_of().to_scenario(), 2, 1, Faults(killed={"r2": 1.0}))), 2 * KEPT
    )
    past = moment.past
    assert past.tick == 2 * KEPT
    spoken = [words.tick for words in past.words.values() if words.robot == "r1"]
    assert min(spoken) >= KEPT
    assert max(spoken) >= past.tick - 20
    assert [words.tick <= 20 for words in past.said["r2"]] == [True]
