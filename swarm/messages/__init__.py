"""All messages and keys of the wire: field types with unit, meaning and bounds, and the table of topics.

A payload is a MessagePack map of the message's fields and of ``v``, the version. Lengths are in metres, angles in
radians, signs as in REP-103; poses are ``base_link`` in ``map``. A receiver ignores fields that it does not know. It
refuses the whole message (``PeerError``) if a field is missing, has a wrong type or value, or is not a number.
"""

from typing import Final

from swarm.messages.enums import Activity, Do, Kind, Liveness, Phase, RobotDo, Steering
from swarm.messages.fields import DRAWING_LIMIT, VERSION, Id, Message, Point
from swarm.messages.floor import PackedMap, ProfileOnWire, ScenarioOnWire
from swarm.messages.robot import Assigned, BodyReport, Broadcast, Command, Counted, Edit, Plan, Sense, State, Took
from swarm.messages.topic import Topic
from swarm.messages.traffic import Record, Relayed, TrafficBroadcast
from swarm.messages.world import (
    Accepted,
    Account,
    Action,
    Body,
    Clock,
    Event,
    Events,
    Join,
    Leave,
    Map,
    Mover,
    Order,
    Places,
    PoolCounts,
    PoolTargets,
    RobotAction,
    RobotStatus,
    Seen,
    Setup,
    Status,
    Truth,
    Welcome,
)

__all__ = [
    "ACTION",
    "BODY",
    "CLOCK",
    "COMMAND",
    "DRAWING_LIMIT",
    "EDIT",
    "EVENT",
    "EVENTS",
    "JOIN",
    "LEAVE",
    "MAP",
    "ORDER",
    "PLACES",
    "PLAN",
    "POOL",
    "RADIO",
    "REPLIES",
    "ROBOT_ACTION",
    "SENSE",
    "SETUP",
    "STATE",
    "STATUS",
    "TOPICS",
    "TRUTH",
    "VERSION",
    "Accepted",
    "Account",
    "Action",
    "Activity",
    "Assigned",
    "Body",
    "BodyReport",
    "Broadcast",
    "Clock",
    "Command",
    "Counted",
    "Do",
    "Edit",
    "Event",
    "Events",
    "Id",
    "Join",
    "Kind",
    "Leave",
    "Liveness",
    "Map",
    "Message",
    "Mover",
    "Order",
    "PackedMap",
    "Phase",
    "Places",
    "Plan",
    "Point",
    "PoolCounts",
    "PoolTargets",
    "ProfileOnWire",
    "Record",
    "Relayed",
    "RobotAction",
    "RobotDo",
    "RobotStatus",
    "ScenarioOnWire",
    "Seen",
    "Sense",
    "Setup",
    "State",
    "Status",
    "Steering",
    "Took",
    "Topic",
    "TrafficBroadcast",
    "Truth",
    "Welcome",
]

# The table of topics: every key with its message, rate, timeout, reliability and limit.
# fmt: off
#                 key                       message    rate  timeout  reliable  limit
SENSE     = Topic("robot/{robot}/sense",    Sense,     20.0, 0.25,    True)
COMMAND   = Topic("robot/{robot}/cmd",      Command,   20.0, 0.25,    True)
BODY      = Topic("robot/{robot}/body",     BodyReport, 20.0, 0.25,   True)
RADIO     = Topic("radio/{zx}/{zy}/{robot}", Broadcast, 5.0, 1.0, False,    131_072)
STATE     = Topic("robot/{robot}/state",    State,     1.0,  3.0,     True)
PLAN      = Topic("robot/{robot}/plan",     Plan,      0.0,  0.0,     True,     262_144)
TRUTH     = Topic("world/truth",            Truth,     10.0, 1.0,     False,    1_048_576)
CLOCK     = Topic("world/clock",            Clock,     1.0,  3.0,     True,     131_072)
EVENT     = Topic("world/event",            Event,     0.0,  0.0,     True)
EVENTS    = Topic("world/events",           Events,    0.0,  0.0,     True,     1_048_576)
STATUS    = Topic("world/status",           Status,    0.0,  0.0,     True,     4_194_304, json=True)
MAP       = Topic("world/map",              Map,       0.0,  0.0,     True,     8_388_608)
# queries: the message is the request; the answer is in REPLIES
ACTION    = Topic("world/action",           Action,    0.0,  0.0)
EDIT      = Topic("world/edit",             Edit,      0.0,  0.0)
JOIN      = Topic("world/join",             Join,      0.0,  0.0,     False,    8_388_608)
LEAVE     = Topic("world/leave",            Leave,     0.0,  0.0)
ORDER     = Topic("robot/{robot}/order",    Order,     0.0,  0.0,     False,    65_536)
ROBOT_ACTION = Topic("robot/{robot}/action", RobotAction, 0.0, 0.0)
POOL      = Topic("world/pool",             PoolTargets, 0.0, 0.0,   False,    65_536)
PLACES    = Topic("world/places",           Places,    0.0,  0.0,     False,    65_536)
SETUP     = Topic("fleet/setup",            Setup,     0.0,  0.0,     False,    262_144)
# fmt: on

TOPICS: Final = (
    SENSE, COMMAND, BODY, RADIO, STATE, PLAN, TRUTH, CLOCK, EVENT, EVENTS, STATUS, MAP, ACTION, EDIT, JOIN, LEAVE,
    ORDER, ROBOT_ACTION, POOL, PLACES, SETUP,
)  # fmt: skip
REPLIES: Final[dict[str, type[Message]]] = {
    ACTION.key: Accepted, EDIT.key: Accepted, JOIN.key: Welcome, LEAVE.key: Accepted, ORDER.key: Accepted,
    ROBOT_ACTION.key: Accepted, POOL.key: Accepted, PLACES.key: Accepted, SETUP.key: Accepted,
}  # fmt: skip
