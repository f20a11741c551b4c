"""One robot in a small room, stepped by hand."""

import msgspec

from swarm.geometry import Pose
from swarm.messages import Broadcast, Sense
from swarm.robot.brain import Inputs, Outputs, Robot
from swarm.scenario.load import Scenario
from tests.shared import scenario_of

AT = Pose(2.5, 3.5, 0.0)
STOPS = [[7.5, 3.5], [7.5, 2.5], [4.5, 2.5]]


def scenario() -> Scenario:
    return scenario_of(targets=STOPS)


def robot() -> Robot:
    return Robot("r2", 1, scenario(), AT)


def step(one: Robot, tick: int, *heard: Broadcast, pose: Pose = AT, run: int = 0, **sensed: object) -> Outputs:
    """Step a robot that stands in the open; ``sensed`` is what it senses otherwise."""
    sense = Sense(
        run=run, tick=tick, time=tick * 0.05, lockstep=True, x=pose.x, y=pose.y, yaw=pose.yaw, linear=0.0, angular=0.0,
        left=1.6, front=1.6, right=1.6, bearings=[None] * 4, hears=[], rays=[1.6] * 15,
    )  # fmt: skip
    return one.step(Inputs(msgspec.structs.replace(sense, **sensed), heard))
