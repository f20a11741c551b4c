"""What a robot has decided to do in one step: what it tells and where it may drive follow from this."""

from typing import NamedTuple

from swarm.maps.occupancy import Point
from swarm.traffic.goal import Goal
from swarm.traffic.interface import TrafficInputs
from swarm.traffic.joint import JointPlanning
from swarm.traffic.route_progress import RouteProgress
from swarm.traffic.situation import Situation
from swarm.traffic.threat import Threat


class Doing(NamedTuple):
    """The end of one step."""

    inputs: TrafficInputs
    situation: Situation
    progress: RouteProgress
    goal: Goal
    joint: JointPlanning
    waits: tuple[str, ...]  # for these robots
    listens: bool  # it has just begun or woken, and claims nothing yet
    stopped: bool  # before an unexpected obstacle
    face: Point | None  # m, turn to this before anything else
    leans_to: int | None  # the cell that it looks into from the edge of its own
    floor: tuple[int, ...]  # cells for it alone, beside those held
    moved: int  # tick at which it last got on
    room: tuple[int, ...]  # cells asked for beside the way
    threat: Threat | None  # what comes towards it
