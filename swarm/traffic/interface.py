"""What goes into one robot's traffic each tick, and what comes out of it."""

from collections.abc import Sequence
from enum import StrEnum
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm.geometry import Pose
from swarm.maps.occupancy import Point
from swarm.messages.traffic import TrafficBroadcast
from swarm.traffic.look import Scan
from swarm.traffic.peer_records import Event
from swarm.traffic.threat import Threat

NO_RAYS: Final = Scan()


class TrafficActivity(StrEnum):
    """What a robot is doing about others, in one word."""

    LISTENING = "listening"  # just started or woken: hears who is near before it claims anything
    DRIVING = "driving"
    WAITING = "waiting"  # for those in ``waits``
    STANDING = "standing"  # for a joint plan to come
    LEADING = "leading"  # making one
    HALTED = "halted"  # before an unexpected obstacle
    LOOKING = "looking"  # whether a silent robot's cell is empty
    CUT_OFF = "cut_off"  # no way leads to the goal
    ARRIVED = "arrived"  # in the goal's cell, or there is no goal


class TrafficInputs(NamedTuple):
    """What one step is given."""

    tick: int
    pose: Pose
    goal: Point | None  # m, where it wants to be; None: to stay, but make room for others
    # m, (n, 2): the path on which the body would come to rest; empty when it stands
    braking: NDArray[np.float64] | tuple[Point, ...] = ()
    scan: Scan = NO_RAYS
    heard: Sequence[TrafficBroadcast] = ()
    sweeps: tuple[int, ...] = ()  # cells that the robot would drive over if it were given them, nearest in time first
    done: bool = False  # no stop is left: the goal is only where to stand
    path: Sequence[Point] = ()  # m, to the goal as the robot's own planner found it; (): any shortest way


class TrafficOutputs(NamedTuple):
    """What one step gives."""

    broadcast: TrafficBroadcast | None  # when it is this robot's turn
    held: tuple[int, ...]  # cells the body is in or may enter; the last is the head
    drivable: tuple[int, ...]  # those of them to drive into: none in which somebody else stands with a part of it too
    unconstrained: bool  # nobody is near: the cells about the body are drivable too
    waypoints: tuple[Point, ...]  # m, where to drive, in order: from the cell it is in to the head
    beside: tuple[Point, ...]  # m, robots that reach into the cell it is in, and bodies that nobody speaks for
    may_drive: bool  # False: no forward speed; turning on the spot is safe
    threat: Threat | None  # what comes towards the robot: it has to get out of its way
    room: tuple[int, ...]  # cells asked for beside the way
    looks: bool  # it has to come to a place to look or to claim from, slowly
    exactly: bool  # the last waypoint is to be come to: a stop, or a place to look from
    face: Point | None  # m, turn to this before anything else
    waits: tuple[str, ...]
    activity: TrafficActivity
    events: tuple[Event, ...]
    way: tuple[int, ...]  # cells to come, held ones first
    members: tuple[str, ...]  # of the joint plan followed
