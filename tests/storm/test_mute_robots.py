"""Whole missions with robots that say nothing of traffic: all of ours arrive, and nobody touches anybody."""

from collections.abc import Callable
from pathlib import Path

import pytest
from msgspec.structs import replace

from swarm.messages import RobotAction, RobotDo
from swarm.robot.brain import Inputs, Robot
from swarm.robot.outputs import Outputs
from swarm.scenario.load import load
from swarm.storm.history.history import record
from swarm.storm.laws.judge import judge
from swarm.storm.plans.draw import draw
from swarm.storm.uncooperative import make_mute
from tests.shared import mostly_long, scenario_of
from world.simulate import Simulation

SCENARIOS = Path(__file__).parents[2] / "scenarios"
TWO_WAYS = """\
##########
#........#
#.##.###.#
#........#
##########
"""
ONE_DOOR = """\
##########
#........#
####.#####
#........#
##########
"""


def drives(robot: Robot, left: float, right: float, stop: float = 0.0) -> None:
    """Let a robot drive on whatever its sensors show, until a time [s]; it says where it is as before."""

    def step(inputs: Inputs, step: Callable[[Inputs], Outputs] = robot.step) -> Outputs:
        outputs = step(inputs)
        goes = inputs.sense.time < stop
        command = replace(outputs.command, left=left if goes else 0.0, right=right if goes else 0.0)
        return outputs._replace(command=command)

    robot.step = step  # type: ignore[method-assign]


@pytest.mark.parametrize("name", mostly_long("two whole missions", ["doorway", "paper"], "doorway"))
def test_one_mute_robot_among_four_hinders_nobody_for_long(name: str) -> None:
    simulation = Simulation.of(load(SCENARIOS / f"{name}.yaml"), 4, 1)
    make_mute(simulation, ["r2"])
    report = simulation.run(300.0)
    assert report["complete"]
    assert report["contacts"] == {"robot": 0, "wall": 0, "obstacle": 0}
    assert report["traffic"]["deadlocks"] == report["traffic"]["overlaps"] == report["traffic"]["outside"] == 0
    assert report["traffic"]["longest_wait"] < 30.0


def corridor(stands: float) -> Simulation:
    """Return a simulation in which r2, mute, stands at x = ``stands`` in the lower of two corridors for ever."""
    scenario = scenario_of(
        TWO_WAYS, map={"text": TWO_WAYS, "cell": 1.2}, targets=[], own_targets=[[[10.2, 1.8]], [[stands, 1.8]]],
        return_home=False, start={"poses": [[1.8, 1.8, 0.0], [stands, 1.8, 0.0]]},
        traffic={"cell": 1.2, "offset": [0.0, 0.0]}, robots=2,
    )  # fmt: skip
    simulation = Simulation.of(scenario, 2, 1)
    make_mute(simulation, ["r2"])
    return simulation


def test_a_mute_robot_that_stands_in_the_way_for_ever_is_driven_round() -> None:
    report = corridor(5.4).run(120.0)
    assert report["complete"]
    assert report["contacts"]["robot"] == 0
    assert report["traffic"]["longest_wait"] < 10.0


def test_who_has_no_other_way_waits_and_names_it() -> None:
    simulation = corridor(10.2)  # on the target
    notes: list[str] = []
    simulation.run(100.0, watch=lambda world: notes.extend(text for _, text in world.tasks.commands[0].notes))
    assert "waits for r2, which says nothing of traffic" in notes
    assert simulation.world.tasks.commands[0].waits == ["r2"]


def test_who_rests_in_the_only_way_of_a_mute_robot_moves_aside_for_it() -> None:
    """r1 is at its target, in the door that r2, mute, has to drive through; without moving aside, r2 never arrives."""
    scenario = scenario_of(
        ONE_DOOR, map={"text": ONE_DOOR, "cell": 1.2}, targets=[], own_targets=[[[5.4, 3.0]], [[9.0, 1.8], [9.0, 4.2]]],
        return_home=False, start={"poses": [[4.2, 1.8, 0.0], [6.6, 1.8, 0.0]]},
        traffic={"cell": 1.2, "offset": [0.0, 0.0]}, robots=2,
    )  # fmt: skip
    simulation = Simulation.of(scenario, 2, 1)
    make_mute(simulation, ["r2"])
    report = simulation.run(120.0)
    assert report["complete"]
    assert report["contacts"]["robot"] == 0


def test_a_mute_robot_that_drives_into_one_that_stands_is_blamed_itself() -> None:
    simulation = corridor(5.4)
    drives(simulation.robots[1], -0.4, -0.4, stop=30.0)
    simulation.world.request("r1", RobotAction(do=RobotDo.STOP))
    report = simulation.run(30.0)
    row = report["per_robot"]["r1"]
    assert row["contacts"] == row["struck"] > 0, "it was touched, and only by who drove into it"
    assert report["traffic"]["intrusions"] > 0
    assert report["traffic"]["overlaps"] == report["traffic"]["outside"] == 0


@pytest.mark.long("two storms, each of two runs and their judge")
@pytest.mark.parametrize("seed", [0, 4])
def test_seeds_with_mute_robots_keep_every_law(seed: int) -> None:
    plan = draw("silent", seed)
    assert plan.mute
    assert judge(record(plan)) == []
