"""The turns that are told of a real fleet are those in which its robots arrive."""

from typing import Final

import pytest

from dashboard.fold.state import QueuePlace, RunState
from swarm.messages import Clock, Map, Phase
from swarm.robot.brain import Inputs, Robot
from swarm.robot.outputs import Outputs
from swarm.scenario.load import load
from swarm.scenario.prepare import settle_lattice
from tests.shared import PAPER
from world.simulate import Simulation
from world.views.truth import make_truth

RATE: Final = 20  # ticks between two looks
TARGETS: Final = 3


@pytest.mark.long("four robots drive the paper's mission")
def test_robots_reach_their_targets_in_the_order_of_their_turns(monkeypatch: pytest.MonkeyPatch) -> None:
    """A later joint plan may change a turn, so a few of those that were told are not those of the arrivals."""
    said: list[Outputs] = []
    step = Robot.step

    def listened(robot: Robot, inputs: Inputs) -> Outputs:
        said.append(step(robot, inputs))
        return said[-1]

    monkeypatch.setattr(Robot, "step", listened)
    scenario = settle_lattice(load(PAPER))
    simulation = Simulation.of(scenario, 4, 1)
    world, known = simulation.world, RunState()
    settings, packed = scenario.to_wire()
    known.take(Map(packed=packed, scenario=settings))
    looks: list[tuple[float, dict[str, int], dict[str, QueuePlace]]] = []
    while not world.is_finished:
        if world.tick % RATE == 0:
            names = list(world.robots)
            known.take(Clock(run=0, tick=world.tick, time=world.time, phase=Phase.RUNNING, robots=names, present=names))
            known.take(make_truth(world))
            to = {name: known.progress.robot(name).target for name in names}
            looks.append((world.time, to, known.turns()))
        said.clear()
        simulation.step()
        for outputs in said:
            for message in (outputs.broadcast, outputs.state, outputs.plan):
                known.take(message)
    rows = simulation.report(0.0, world.time)["per_robot"]
    right = []
    for time, to, turns in looks:
        for target in range(TARGETS):
            reached = {name: rows[name]["reached"][target] for name in rows if to[name] == target}
            queue = sorted((name for name in reached if reached[name] > time), key=reached.__getitem__)
            if len(queue) == len(reached) > 1:  # nobody has reached it in this moment
                right += [
                    turns.get(name) == QueuePlace(number, len(queue)) for number, name in enumerate(queue, start=1)
                ]
    assert len(right) > 100
    assert sum(right) > 0.85 * len(right)
