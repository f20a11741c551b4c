"""The inputs and outputs of one robot's traffic in each tick."""

from collections.abc import Sequence
from enum import StrEnum
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm.geometry import Pose
from swarm.maps.occupancy import Disc, Point
from swarm.messages.traffic import TrafficBroadcast
from swarm.traffic.obstacles.scan import Scan
from swarm.traffic.peers.records import TrafficNote
from swarm.traffic.peers.uncooperative import MuteBroadcast

NO_RAYS: Final = Scan()


class TrafficActivity(StrEnum):
    """What a robot is doing about others, in one word."""

    LISTENING = "listening"  # just started or woken: it hears who is near before it claims anything
    DRIVING = "driving"
    WAITING = "waiting"  # for those in ``waits``
    STANDING = "standing"  # still, until a joint plan comes
    LEADING = "leading"  # making a joint plan
    HALTED = "halted"  # before an unexpected obstacle
    LOOKING = "looking"  # checking whether the cell of a silent robot is empty
    CUT_OFF = "cut_off"  # no way leads to the goal, or a body stands in its cell
    ARRIVED = "arrived"  # in the goal's cell, or there is no goal


class MovingObstacle(NamedTuple):
    """An obstacle that moves by itself, at one moment."""

    x: float  # m, its centre
    y: float
    vx: float  # m/s
    vy: float


class TrafficInputs(NamedTuple):
    """The inputs of one step."""

    tick: int
    pose: Pose
    goal: Point | None  # m, where it wants to be; None: it stays, but makes room for others
    # m, (n, 2): the path on which the body would come to rest; empty if it stands
    braking: NDArray[np.float64] | tuple[Point, ...] = ()
    speed: float = 0.0  # m/s, of its centre
    scan: Scan = NO_RAYS
    heard: Sequence[TrafficBroadcast] = ()
    mute: Sequence[MuteBroadcast] = ()  # heard broadcasts that say nothing of traffic
    sweeps: tuple[int, ...] = ()  # cells that the robot would drive over if it had them, the soonest first
    then: Point | None = None  # m, where it wants to be after the goal; None: nowhere else
    done: bool = False  # no stop is left: the goal is only a place to stand
    stands: bool = False  # it was told to stop: it drives nowhere, and takes part in no joint plan
    uncertainty: float = 0.0  # m, how far the body may be from the pose and from its braking path
    jumped: bool = False  # it is open where it is: it holds all that may be under it
    lost: bool = False  # it stands, since its pose is known too badly to drive by
    path: Sequence[Point] = ()  # m, to the goal, from the robot's own planner; (): any shortest way


class TrafficOutputs(NamedTuple):
    """The outputs of one step."""

    broadcast: TrafficBroadcast | None  # None if it is not this robot's turn
    held: tuple[int, ...]  # cells the body is in or may enter; the last is the head
    drivable: tuple[int, ...]  # cells to drive into: its own, free-drive cells, and held ones that no other robot holds
    unconstrained: bool  # no robot is near: the free-drive cells are drivable too
    waypoints: tuple[Point, ...]  # m, in the order to drive: from the cell it is in to the head
    beside: tuple[Disc, ...]  # bodies of other robots that hold the cell it is in, and silent robots and obstacles near
    may_drive: bool  # False: no forward speed; turning on the spot is safe
    threats: tuple[MovingObstacle, ...]  # obstacles that move near the robot, which must get out of their way
    room: tuple[int, ...]  # cells asked for beside the way
    looks: bool  # it drives slowly to a point from which it looks or claims
    exactly: bool  # the last waypoint must be reached: a stop, or a point to look from
    face: Point | None  # m, the point to turn to first
    waits: tuple[str, ...]  # robots that it waits for, or that shut its way
    activity: TrafficActivity
    events: tuple[TrafficNote, ...]
    way: tuple[int, ...]  # cells to come, held ones first
    members: tuple[str, ...]  # of the joint plan followed
    docks: bool = False  # it drives straight to its place, over cells that it holds for that only

    def without_messages(self) -> "TrafficOutputs":
        """Return what still holds of these outputs in a tick without a step: all but the messages."""
        return self._replace(broadcast=None, events=())
