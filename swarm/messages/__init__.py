"""Every message and every key of the wire: types with unit, meaning and bounds, and the one table of topics.

Payloads are MessagePack maps of these fields and ``v``, the version. Lengths in metres, angles in radians, REP-103
signs; poses are ``base_link`` in ``map``. Fields that a receiver does not know are ignored; a field that is missing,
of a wrong type, out of its bounds or not a number makes the whole message refused (``PeerError``).
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
from swarm.messages.traffic import TrafficBroadcast
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
    "Sense",
    "State",
    "Steering",
    "Topic",
    "TrafficBroadcast",
    "Truth",
    "Welcome",
]
