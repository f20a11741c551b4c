"""The one table of the wire: every key with its message, rate, timeout, reliability and limit."""

from dataclasses import dataclass
from typing import Final, Generic, TypeVar

from swarm.messages.fields import Message
from swarm.messages.robot import Broadcast, Command, Edit, Plan, Sense, State
from swarm.messages.world import Accepted, Action, Clock, Event, Join, Map, Truth, Welcome

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
MAP       = Topic("world/map",              Map,     0.0,  0.0,     True,     8_388_608)
# queries: who asks sends the message, who answers sends the reply
ACTION    = Topic("world/action",           Action,    0.0,  0.0)
EDIT      = Topic("world/edit",             Edit,      0.0,  0.0)
JOIN      = Topic("world/join",             Join,      0.0,  0.0,     False,    8_388_608)
# fmt: on

TOPICS: Final = (SENSE, COMMAND, RADIO, STATE, PLAN, TRUTH, CLOCK, EVENT, MAP, ACTION, EDIT, JOIN)
REPLIES: Final[dict[str, type[Message]]] = {ACTION.key: Accepted, EDIT.key: Accepted, JOIN.key: Welcome}
