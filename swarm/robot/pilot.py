"""What passes between a robot's brain and its pilot: what the brain knows goes in, a ``Move`` comes out."""

from collections.abc import Mapping, Sequence
from math import degrees
from typing import NamedTuple

from swarm.fuzzy import Controller
from swarm.geometry import Pose
from swarm.maps.occupancy import Point
from swarm.messages import Activity, Broadcast, Sense
from swarm.messages.traffic import TrafficBroadcast
from swarm.robot.navigator import Navigator
from swarm.robot.safety import WheelSpeeds
from swarm.settings import RobotSettings


class Situation(NamedTuple):
    """What the brain knows at one tick."""

    sense: Sense
    pose: Pose
    goal: Point  # the stop under way; when all are done, the last one
    done: bool  # nothing is left to do but to stand, and to make room
    target: int  # number of that stop
    navigator: Navigator  # the own path to the goal
    others: Mapping[str, Broadcast]  # the newest of each robot heard of late
    heard: Sequence[Broadcast]  # at this tick


class Move(NamedTuple):
    """What the robot does at one tick, and what others shall know of it."""

    speeds: WheelSpeeds
    heading: float  # rad, what the fuzzy controller was asked to turn towards
    activity: Activity
    held: Sequence[int] = ()
    scale: float = 1.0  # the fuzzy controller was told the sensed distances divided by this
    unconstrained: bool = False  # nobody is near: whatever its body and brake need is held
    waits: Sequence[str] = ()
    members: Sequence[str] = ()
    notes: Sequence[tuple[str, str]] = ()
    traffic: TrafficBroadcast | None = None


def fuzzy_speeds(
    controller: Controller, robot: RobotSettings, sense: Sense, heading: float, scale: float = 1.0
) -> tuple[float, float]:
    """Ask the tables for rim speeds (left, right) [m/s]; ``heading`` [rad] is left positive, their own sign right.

    ``scale`` shrinks the paper's near, medium and far: they are told the distances divided by it.
    """
    unit = robot.distance_scale * scale
    left, right = controller.wheel_speeds(sense.left / unit, sense.front / unit, sense.right / unit, -degrees(heading))
    return left * robot.speed_scale, right * robot.speed_scale
