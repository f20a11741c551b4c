"""What passes from one part of a step to the next, and from one tick to the next."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from swarm.maps.occupancy import Point
from swarm.messages.traffic import Record
from swarm.traffic.goal import Goal
from swarm.traffic.interface import TrafficInputs
from swarm.traffic.joint.protocol import JointPlanning
from swarm.traffic.obstacles.detector import ProtectiveStop
from swarm.traffic.obstacles.tracker import MovingObstacle
from swarm.traffic.peers.records import TrafficNote
from swarm.traffic.peers.situation import Situation
from swarm.traffic.reservations.presence import Footprint
from swarm.traffic.reservations.route import RouteProgress


class Before(NamedTuple):
    """What is kept of the last tick, beside what each part remembers."""

    tick: int
    progress: RouteProgress
    moved: int  # tick of its last progress
    listen_until: int  # tick
    threats: tuple[MovingObstacle, ...]  # obstacles that moved near it


class Heard(NamedTuple):
    """Where the robot is, and what the others say."""

    body: Footprint
    progress: RouteProgress
    moved: int  # tick of its last progress
    listen_until: int  # tick
    listens: bool  # it has just started or woken, and claims nothing yet
    threats: tuple[MovingObstacle, ...]  # obstacles that moved near it in the last tick
    fresh: Mapping[str, Record]
    events: Sequence[TrafficNote]


class Halted(NamedTuple):
    """What an unexpected obstacle has changed."""

    progress: RouteProgress
    halt: ProtectiveStop
    events: tuple[TrafficNote, ...] = ()


class StepResult(NamedTuple):
    """The decisions of one step. What it tells and where it may drive follow from them."""

    inputs: TrafficInputs
    body: Footprint
    situation: Situation
    progress: RouteProgress
    goal: Goal
    joint: JointPlanning
    waits: tuple[str, ...]  # the robots that it waits for
    listens: bool  # it has just started or woken, and claims nothing yet
    halt: ProtectiveStop  # before an unexpected obstacle
    face: Point | None  # m, the point to turn to first
    leans_to: int | None  # the cell that it looks into from the edge of its own cell
    free_drive: tuple[int, ...]  # cells beside those held that it may drive in while no robot is near
    moved: int  # tick of its last progress
    room: tuple[int, ...]  # cells asked for beside the way
    threats: tuple[MovingObstacle, ...]  # obstacles that moved near it in the last tick
    speaks: bool  # it is its turn to broadcast
    events: tuple[TrafficNote, ...]
