"""Every message and every key of the wire, with unit, rate, timeout and limit: the one table the rest is made from.

Payloads are MessagePack maps of these fields and ``v``, the version. Lengths in metres, angles in radians, REP-103
signs; poses are ``base_link`` in ``map``. Fields that a receiver does not know are ignored; a field that is missing,
of a wrong type, out of its bounds or not a number makes the whole message refused (``PeerError``).
"""

from dataclasses import dataclass
from enum import StrEnum
from math import pi
from typing import Annotated, Any, Final, Generic, TypeVar

import msgspec
from msgspec import Meta

from swarm.traffic.record import TrafficBroadcast

VERSION: Final = 1

Id = Annotated[str, Meta(pattern=r"^[A-Za-z0-9_.:-]{1,64}\Z")]
Metres = Annotated[float, Meta(ge=-1e6, le=1e6)]
Length = Annotated[float, Meta(ge=0, le=1e6)]
Angle = Annotated[float, Meta(ge=-pi - 1e-9, le=pi + 1e-9)]
Speed = Annotated[float, Meta(ge=-20, le=20)]  # m/s or rad/s
Seconds = Annotated[float, Meta(ge=0, le=1e9)]
Scale = Annotated[float, Meta(ge=0.1, le=1)]
Count = Annotated[int, Meta(ge=0, le=2**53)]
Text = Annotated[str, Meta(max_length=2000)]
Point = tuple[Metres, Metres]


class Activity(StrEnum):
    """What a robot is doing, in one word."""

    READY = "ready"  # nothing to do yet
    DRIVE = "drive"  # under way to its target
    GIVE_WAY = "give_way"  # stands for another robot
    BLOCKED = "blocked"  # no path just now, asks for one again and again
    DONE = "done"  # the whole sequence, and home where that is asked for


class Steering(StrEnum):
    """What became of the fuzzy tables' wheel speeds, as the world works it out; the report gives the share of each."""

    BRAKED = "braked"  # the wheels stand, though the tables would move
    TABLES = "tables"  # unaltered, or slower in the same ratio
    TIGHTENED = "tightened"  # the same yaw rate with less forward speed
    TURNED = "turned"  # a turn on the spot at another rate
    BLENDED = "blended"  # anything else


class Phase(StrEnum):
    """Where the world's run stands."""

    WAITING = "waiting"  # robots still missing, or nobody said go
    RUNNING = "running"
    PAUSED = "paused"
    OVER = "over"


class Do(StrEnum):
    """The paper's buttons, and those beside them."""

    GO = "go"
    PAUSE = "pause"
    RESUME = "resume"
    RESTART = "restart"
    STOP = "stop"


class Message(msgspec.Struct, frozen=True, kw_only=True):
    """What every message is."""


class Kind(StrEnum):
    """What an edit puts on the floor."""

    WALL = "wall"
    OBSTACLE = "obstacle"
    FREE = "free"


class Edit(Message, frozen=True, kw_only=True):
    """Walls added or removed while the fleet runs: all cells of the map that a rectangle touches."""

    kind: Kind
    low: Point  # m, two opposite corners
    high: Point


class Sense(Message, frozen=True, kw_only=True):
    """What the world lets one robot know at one tick."""

    run: Count  # goes up with each restart; everything of an older run is void
    tick: Count
    time: Seconds  # since the run began
    lockstep: bool  # the world waits for this robot's command, the robot for all it ``hears``
    x: Metres
    y: Metres
    yaw: Angle
    linear: Speed  # m/s, as the wheels turn now
    angular: Speed  # rad/s
    left: Length  # m, free distance from the robot's edge: nearest hit in the sector's rays
    front: Length
    right: Length
    bearings: list[Angle | None]  # rad, of each target, None where it is out of sight
    hears: list[tuple[Id, Count]]  # broadcasts (robot, tick) that reach this robot
    rays: list[Length]  # m, every ray of left, front, right in turn
    edits_before: Count = 0  # how many edits there have been before those in ``edits``
    edits: list[Edit] = []  # of the last second


class Command(Message, frozen=True, kw_only=True):
    """What a robot's wheels shall do, and what the world must know at the same tick."""

    run: Count
    tick: Count  # of the sense it answers
    left: Speed  # m/s, rim speed
    right: Speed
    heading: Angle  # rad, what the fuzzy controller was asked to turn towards; left is positive
    activity: Activity
    reached: list[bool]  # of each stop: the targets, then home where the mission returns
    unreachable: list[Count]  # stops given up because no path led there
    held: list[Count] = []  # cells it holds; the last is the head
    scale: Scale = 1.0  # the fuzzy controller was told the sensed distances divided by this
    unconstrained: bool = False  # nobody is near: it holds whatever cells its body and brake need
    waits: list[Id] = []  # for whom
    members: list[Id] = []  # of the joint plan it follows
    notes: list[tuple[Id, Text]] = []  # what happened: kind, in words
    sent: bool  # a broadcast of this tick was put on the radio before this
    replans: Count


class Broadcast(Message, frozen=True, kw_only=True):
    """The paper's radio (section 3.1): position, how far from the target, whether reached; and what it is about."""

    robot: Id
    run: Count
    tick: Count
    x: Metres
    y: Metres
    yaw: Angle
    activity: Activity
    target: Count  # index of the stop it drives to; the number of stops when all are reached
    distance: Length  # m, to that stop, along its path
    reached: list[bool]
    traffic: TrafficBroadcast | None = None  # holds, claims, acknowledgements, joint plans; of others too
    walls: list[Count] = []  # cells it has learned to be solid (row * columns + column); where the map is unknown


class State(Message, frozen=True, kw_only=True):
    """Where one robot's mission stands: on change and at least once a second."""

    robot: Id
    run: Count
    tick: Count
    activity: Activity
    target: Count
    reached: list[bool]
    unreachable: list[Count]  # stops given up because no path led there
    distance: Length
    replans: Count


class Plan(Message, frozen=True, kw_only=True):
    """The path a robot follows now."""

    robot: Id
    run: Count
    tick: Count
    points: list[Point]


class Body(Message, frozen=True, kw_only=True):
    """One robot as the world knows it."""

    robot: Id
    x: Metres
    y: Metres
    yaw: Angle
    left_v: Speed
    right_v: Speed
    left: Length
    front: Length
    right: Length
    heading: Angle  # of its last command, as is all below
    steering: Steering | None  # None: no command is in force
    activity: Activity
    scale: Scale = 1.0
    held: list[Count] = []
    waits: list[Id] = []
    members: list[Id] = []


class Mover(Message, frozen=True, kw_only=True):
    """A moving obstacle, as the world knows it: a disc, or a box along its way."""

    x: Metres
    y: Metres
    yaw: Angle
    radius: Length  # m; 0 for a box
    size: tuple[Length, Length]  # m, along and across; (0, 0) for a disc


class Truth(Message, frozen=True, kw_only=True):
    """All bodies at one tick, for those who watch; robots never hear it."""

    run: Count
    tick: Count
    time: Seconds
    bodies: list[Body]
    movers: list[Mover] = []


class Clock(Message, frozen=True, kw_only=True):
    """Where the run stands: on change and once a second."""

    run: Count
    tick: Count
    time: Seconds
    phase: Phase
    robots: list[Id]  # all that belong to the run
    present: list[Id]  # those whose process is there now


class Event(Message, frozen=True, kw_only=True):
    """Something worth a line."""

    run: Count
    tick: Count
    time: Seconds
    robot: Id | None
    kind: Id
    text: Text


class Floor(Message, frozen=True, kw_only=True):
    """What stands still: the map, packed by ``swarm.maps.wire``, and the scenario's settings and fuzzy profile."""

    packed: dict[str, Any]
    scenario: dict[str, Any]
    edits: Count = 0  # edits that are in it


class Action(Message, frozen=True, kw_only=True):
    """One of the buttons."""

    do: Do


class Join(Message, frozen=True, kw_only=True):
    """A robot process asks for its place in the fleet."""

    robot: Id | None  # None: whichever place is free


class Welcome(Message, frozen=True, kw_only=True):
    """The place: which robot it is, what the scenario says, and where that robot's mission stood."""

    robot: Id
    scenario: dict[str, Any]
    packed: dict[str, Any]
    edits: Count  # edits that are in the map
    start: tuple[Metres, Metres, Angle]  # its pose when the run began: home
    state: State | None


class Accepted(Message, frozen=True, kw_only=True):
    """Done as asked."""

    text: Text


M = TypeVar("M", bound=Message)


@dataclass(frozen=True, slots=True)
class Topic(Generic[M]):
    """One row of the table."""

    key: str  # below swarm/v1/<fleet>/
    message: type[M]
    rate: float  # Hz, as a rule; 0: on change or on request
    timeout: float  # s; older than this is stale, for everyone; 0: never
    reliable: bool = False  # the sender waits rather than drops
    limit: int = 16_384  # bytes; a longer payload is refused unread


# fmt: off
#                 key                       message    rate  timeout  reliable  limit
SENSE     = Topic("robot/{robot}/sense",    Sense,     20.0, 0.25,    True)
COMMAND   = Topic("robot/{robot}/cmd",      Command,   20.0, 0.25,    True)
RADIO     = Topic("radio/{zx}/{zy}/{robot}", Broadcast, 5.0, 1.0, False,    131_072)
STATE     = Topic("robot/{robot}/state",    State,     1.0,  3.0,     True)
PLAN      = Topic("robot/{robot}/plan",     Plan,      0.0,  0.0,     True,     262_144)
TRUTH     = Topic("world/truth",            Truth,     10.0, 1.0,     False,    1_048_576)
CLOCK     = Topic("world/clock",            Clock,     1.0,  3.0,     True,     131_072)
EVENT     = Topic("world/event",            Event,     0.0,  0.0,     True)
MAP       = Topic("world/map",              Floor,     0.0,  0.0,     True,     8_388_608)
# queries: who asks sends the message, who answers sends the reply
ACTION    = Topic("world/action",           Action,    0.0,  0.0)
EDIT      = Topic("world/edit",             Edit,      0.0,  0.0)
JOIN      = Topic("world/join",             Join,      0.0,  0.0,     False,    8_388_608)
# fmt: on

TOPICS: Final = (SENSE, COMMAND, RADIO, STATE, PLAN, TRUTH, CLOCK, EVENT, MAP, ACTION, EDIT, JOIN)
REPLIES: Final[dict[str, type[Message]]] = {ACTION.key: Accepted, EDIT.key: Accepted, JOIN.key: Welcome}
