"""One robot in a small room, stepped by hand."""

from typing import Final

import msgspec

from swarm.geometry import Pose
from swarm.messages import Broadcast, Sense
from swarm.robot.brain import Inputs, Robot
from swarm.robot.outputs import Outputs
from swarm.scenario.load import Scenario
from swarm.scenario.starts import number_of
from tests.shared import scenario_of

AT = Pose(2.5, 3.5, 0.0)
STOPS = [[7.5, 3.5], [7.5, 2.5], [4.5, 2.5]]


def scenario() -> Scenario:
    return scenario_of(targets=STOPS, traffic={"cell": 1.2})


def robot(name: str = "r2") -> Robot:
    return Robot(name, number_of(name), scenario(), AT)


FITS: Final = Sense(
        world="local",
    run=0, tick=7, time=0.35, lockstep=True, x=AT.x, y=AT.y, yaw=AT.yaw, linear=0.0, angular=0.0,
    left=1.6, front=1.6, right=1.6, bearings=[None] * 4, hears=[], rays=[1.6] * 15,
)  # fmt: skip


def step(one: Robot, tick: int, *heard: Broadcast, pose: Pose = AT, run: int = 0, **sensed: object) -> Outputs:
    """Step a robot that stands in the open; ``sensed`` is what it senses otherwise."""
    here = {"run": run, "tick": tick, "time": tick * 0.05, "x": pose.x, "y": pose.y, "yaw": pose.yaw}
    return one.step(Inputs(msgspec.structs.replace(FITS, **here | sensed), heard))
