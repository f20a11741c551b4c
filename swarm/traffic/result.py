"""The decisions of a robot in one step. What it tells and where it may drive follow from them."""

from typing import NamedTuple

from swarm.maps.occupancy import Point
from swarm.traffic.goal import Goal
from swarm.traffic.interface import TrafficInputs
from swarm.traffic.joint.protocol import JointPlanning
from swarm.traffic.obstacles.tracker import Threat
from swarm.traffic.peers.situation import Situation
from swarm.traffic.reservations.route import RouteProgress


class Doing(NamedTuple):
    """The decisions of one step."""

    inputs: TrafficInputs
    situation: Situation
    progress: RouteProgress
    goal: Goal
    joint: JointPlanning
    waits: tuple[str, ...]  # the robots that it waits for
    listens: bool  # it has just started or woken, and claims nothing yet
    stopped: bool  # before an unexpected obstacle
    face: Point | None  # m, the point to turn to first
    leans_to: int | None  # the cell that it looks into from the edge of its own cell
    free_drive: tuple[int, ...]  # cells beside those held that it may drive in while no robot is near
    moved: int  # tick of its last progress
    room: tuple[int, ...]  # cells asked for beside the way
    threats: tuple[Threat, ...]  # obstacles that move near it
