"""The values that the parts of one step of traffic hand to each other."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from swarm.messages.traffic import Record
from swarm.traffic.interface import MovingObstacle
from swarm.traffic.obstacles.detector import ProtectiveStop
from swarm.traffic.peers.records import TrafficNote
from swarm.traffic.reservations.route import Footprint, RouteProgress


class LastStep(NamedTuple):
    """What is kept of the last tick, beside what each part remembers."""

    tick: int
    progress: RouteProgress
    moved: int  # tick of its last progress
    listen_until: int  # tick
    threats: tuple[MovingObstacle, ...]  # obstacles that moved near it
    then: int  # cell of the stop after its goal
    busy: bool  # it searches for a joint plan, or an obstacle is near: the next step is due in the next tick


class ListenResult(NamedTuple):
    """Where the robot is, and what the others say."""

    body: Footprint
    progress: RouteProgress
    moved: int  # tick of its last progress
    listen_until: int  # tick
    listens: bool  # it has just started or woken, and claims nothing yet
    threats: tuple[MovingObstacle, ...]  # obstacles that moved near it in the last tick
    fresh: Mapping[str, Record]
    events: Sequence[TrafficNote]


class HaltResult(NamedTuple):
    """What an unexpected obstacle has changed."""

    progress: RouteProgress
    halt: ProtectiveStop
    events: tuple[TrafficNote, ...] = ()
