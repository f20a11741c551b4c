"""All messages and keys of the wire: field types with unit, meaning and bounds, and the table of topics.

A payload is a MessagePack map of the message's fields and of ``v``, the version. Lengths are in metres, angles in
radians, signs as in REP-103; poses are ``base_link`` in ``map``. A receiver ignores fields that it does not know. It
refuses the whole message (``PeerError``) if a field is missing, has a wrong type or value, or is not a number.
"""

from swarm.messages.enums import Activity, Do, Kind, Phase, Steering
from swarm.messages.fields import VERSION, Id, Message, Point
from swarm.messages.robot import Broadcast, Command, Edit, Plan, Sense, State
from swarm.messages.table import (
    ACTION,
    CLOCK,
    COMMAND,
    EDIT,
    EVENT,
    JOIN,
    MAP,
    PLAN,
    RADIO,
    REPLIES,
    SENSE,
    STATE,
    TOPICS,
    TRUTH,
    Topic,
)
from swarm.messages.traffic import Record, Relayed, TrafficBroadcast
from swarm.messages.world import (
    Accepted,
    Action,
    Body,
    Clock,
    Event,
    Join,
    Map,
    Mover,
    Truth,
    Welcome,
)

__all__ = [
    "ACTION",
    "CLOCK",
    "COMMAND",
    "EDIT",
    "EVENT",
    "JOIN",
    "MAP",
    "PLAN",
    "RADIO",
    "REPLIES",
    "SENSE",
    "STATE",
    "TOPICS",
    "TRUTH",
    "VERSION",
    "Accepted",
    "Action",
    "Activity",
    "Body",
    "Broadcast",
    "Clock",
    "Command",
    "Do",
    "Edit",
    "Event",
    "Id",
    "Join",
    "Kind",
    "Map",
    "Message",
    "Mover",
    "Phase",
    "Plan",
    "Point",
    "Record",
    "Relayed",
    "Sense",
    "State",
    "Steering",
    "Topic",
    "TrafficBroadcast",
    "Truth",
    "Welcome",
]
