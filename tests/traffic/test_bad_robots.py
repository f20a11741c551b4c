"""Robots that lie, repeat old records, use another's name or ignore a plan: no contact, and an event names them."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest
from msgspec.structs import replace

from swarm.messages import Broadcast, Command, Event
from swarm.messages.traffic import Claim, Record, TrafficBroadcast
from swarm.robot.brain import Inputs, Robot
from swarm.robot.outputs import Outputs
from swarm.scenario.load import load
from tests.shared import mostly_long
from world.simulate import Simulation

DOORWAY = Path(__file__).parents[2] / "scenarios" / "doorway.yaml"
Change = Callable[[Record, int], Record]


def lying(robot: Robot, change: Change) -> None:
    """Let a robot drive as it should and say what it should not, now and then."""

    def step(inputs: Inputs, step: Callable[[Inputs], Outputs] = robot.step) -> Outputs:
        outputs = step(inputs)
        said = outputs.broadcast
        if said is None or said.traffic is None or inputs.sense.tick % 40 >= 8:
            return outputs
        own = change(said.traffic.own, inputs.sense.tick)
        return outputs._replace(broadcast=replace(said, traffic=replace(said.traffic, own=own)))

    robot.step = step  # type: ignore[method-assign]


def replaying(robot: Robot) -> None:
    """Let a robot say again, now and then, what it said first."""
    said: list[Broadcast] = []

    def step(inputs: Inputs, step: Callable[[Inputs], Outputs] = robot.step) -> Outputs:
        outputs = step(inputs)
        if outputs.broadcast is None:
            return outputs
        said.append(outputs.broadcast)
        return outputs._replace(broadcast=said[0]) if inputs.sense.tick % 40 < 8 else outputs

    robot.step = step  # type: ignore[method-assign]


def heedless(robot: Robot) -> None:
    """Let a robot hear no joint plan."""

    def step(inputs: Inputs, step: Callable[[Inputs], Outputs] = robot.step) -> Outputs:
        heard = []
        for one in inputs.heard:
            assert one.traffic is not None
            own, others = replace(one.traffic.own, plan=None), one.traffic.others
            relayed = tuple(each._replace(record=replace(each.record, plan=None)) for each in others)
            heard.append(replace(one, traffic=TrafficBroadcast(own=own, others=relayed)))
        return step(inputs._replace(heard=heard))

    robot.step = step  # type: ignore[method-assign]


# fmt: off
LIES: dict[str, tuple[Change, str]] = {
    "claims a cell it cannot be in": (lambda own, tick: replace(own, claims=(Claim(230, 10**6 + tick, 0),)),
                                      "holds or claims a cell far from where it is"),
    "claims a cell that is not":     (lambda own, tick: replace(own, claims=(Claim(10**9, 10**6 + tick, 0),)),
                                      "holds or claims cells that are not there"),
    "jumps":                         (lambda own, tick: replace(own, x=own.x + 3.0, held=(), claims=()),
                                      "jumped farther than a robot can drive"),
    "denies where it is":            (lambda own, tick: replace(own, held=(), claims=()),
                                      "is in a cell that it does not hold"),
    "speaks for another":            (lambda own, tick: replace(own, robot="r2"),
                                      "another robot uses my id"),
    "is ahead of its time":          (lambda own, tick: replace(own, stamp=own.stamp + 500),
                                      "it is from the future"),
}
# fmt: on


def drive(spoil: Callable[[Robot], None], name: str = "r1") -> tuple[dict[str, Any], list[str]]:
    """Drive four robots through the door, one of them spoilt; give the report, and what events said."""
    simulation = Simulation.of(load(DOORWAY), 4, 1)
    spoil(next(robot for robot in simulation.robots if robot.name == name))
    said: list[str] = []
    step = simulation.world.step

    def noted(commands: Mapping[str, Command], sent: Sequence[tuple[str, int]] = ()) -> list[Event]:
        events = step(commands, sent)
        said.extend(f"{event.kind}: {event.text}" for event in events)
        return events

    simulation.world.step = noted  # type: ignore[method-assign]
    return simulation.run(limit=200.0), said


@pytest.mark.parametrize("name", mostly_long("a whole mission", LIES, "jumps", "speaks for another"))
def test_a_liar_is_named_and_touches_nobody(name: str) -> None:
    change, fault = LIES[name]
    report, said = drive(lambda robot: lying(robot, change))
    assert report["contacts"] == {"robot": 0, "wall": 0, "obstacle": 0}
    assert any(line.startswith("refused") and fault in line for line in said)
    assert report["complete"], report["reason"]


def test_a_replayed_broadcast_is_named_and_touches_nobody() -> None:
    report, said = drive(replaying)
    assert report["contacts"]["robot"] == 0
    assert any("sent the record of tick" in line for line in said)
    assert report["complete"], report["reason"]


def test_a_member_that_ignores_the_plan_is_named_and_touches_nobody() -> None:
    report, said = drive(heedless, "r3")
    assert report["contacts"]["robot"] == 0
    assert report["traffic"]["joint_plans"] >= 1
    assert any("finds that r3 does not follow its joint plan" in line for line in said)
