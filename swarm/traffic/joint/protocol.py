"""One robot's part in joint plans: two state machines side by side.

The call that it takes part in. A robot goes on in the plan that it follows while it stands for the next one:

    Free --named--> Collecting --all_stand--> Searching --found, gave_up--> Free
                                              Searching --searched_on, found_none--> Searching
    Free, Frozen, Collecting, Searching --called--> Frozen --plan_came, stood_in_vain--> Free
    Free --asks--> Free
    Frozen, Collecting, Searching --left--> Free
    Free, Frozen, Collecting, Searching --woke--> Free
    Free, Frozen, Collecting, Searching --ignored--> as before

The plan that it follows, if any:

    none, Following --adopts--> Following --dropped--> none
    none, Following --refuses--> as before

There is no leader election: the lowest id in range leads. If a leader falls silent, the next request
names the next id. A plan gives no right to any cell: a plan that is lost, late or half adopted costs time only.
"""

from collections.abc import Callable
from typing import Any, Final, NamedTuple

from swarm.messages.traffic import Collect, Epoch, JointPlan, Refusal
from swarm.traffic.joint import leader, member
from swarm.traffic.joint.states import (
    Call,
    Collecting,
    Drops,
    Following,
    Free,
    Frozen,
    Gets,
    Leaves,
    Memory,
    Move,
    Searching,
    Speaks,
    Wakes,
)
from swarm.traffic.peers.records import TrafficNote
from swarm.traffic.peers.situation import Situation
from swarm.traffic.settings import TrafficConstants

Occasion = Situation | Speaks | Leaves | Wakes | Gets | Drops  # Situation: what is known in each tick
Types = type[Any] | tuple[type[Any], ...]


class Transition(NamedTuple):
    """One arrow of the drawing: if something happens, the robot goes from one state to another."""

    on: Types  # occasions
    of: Types  # states
    happens: Callable[[Memory, Any, Any], Move | None]  # its arguments: the memory, the state, the occasion
    to: Types  # the next state; the same types as in ``of``: the state stays as it is


NONE: Final = type(None)  # it follows no plan
IN_CALL: Final = (Frozen, Collecting, Searching)
ANY_CALL: Final = (Free, *IN_CALL)
ANY_PLAN: Final = (NONE, Following)

# fmt: off
CALLS: Final = (  # tried on each occasion from top to bottom, in the state that the ones above have led to
    #          on               in          what happens          to
    Transition(Situation,       ANY_CALL,   leader.ignored,       ANY_CALL),
    Transition(Situation,       ANY_CALL,   member.called,        Frozen),
    Transition(Situation,       Free,       leader.named,         Collecting),
    Transition(Situation,       Collecting, leader.all_stand,     Searching),
    Transition(Situation,       Searching,  leader.searched_on,   Searching),
    Transition(Situation,       Searching,  leader.found,         Free),
    Transition(Situation,       Searching,  leader.found_none,    Searching),
    Transition(Situation,       Searching,  leader.gave_up,       Free),
    Transition(Situation,       Frozen,     member.plan_came,     Free),
    Transition(Situation,       Frozen,     member.stood_in_vain, Free),
    Transition(Speaks,          Free,       member.asks,          Free),
    Transition(Leaves,          IN_CALL,    member.left,          Free),
    Transition(Wakes,           ANY_CALL,   member.woke,          Free),
)
PLANS: Final = (
    Transition(Gets,            ANY_PLAN,   member.adopts,        Following),
    Transition(Gets,            ANY_PLAN,   member.refuses,       ANY_PLAN),
    Transition((Drops, Leaves), Following,  member.dropped,       NONE),
)
# fmt: on


class Decision(NamedTuple):
    """The decisions on one occasion."""

    way: tuple[int, ...] | None = None  # of a plan adopted now, from the head on
    events: tuple[TrafficNote, ...] = ()


class JointPlanning:
    """The two state machines of one robot."""

    def __init__(self, me: str, settings: TrafficConstants) -> None:
        self.call: Call = Free()
        self.following: Following | None = None
        self.memory = Memory(me, settings)

    def take(self, occasion: Occasion) -> Decision:
        """Change both states as the tables say. A plan that comes is at once an occasion for the second table."""
        self.call, plan, events = _through(CALLS, self.memory, self.call, occasion)
        if plan is not None and isinstance(occasion, Situation):
            occasion = Gets(plan, occasion)
        self.following, _, more = _through(PLANS, self.memory, self.following, occasion)
        way: tuple[int, ...] | None = None
        if plan is not None and self.following is not None and self.following.plan is plan:
            way = plan.ways[self.memory.me]
        return Decision(way, events + more)

    # ---- what the robot tells

    @property
    def need(self) -> str | None:
        """The robot that it asks to lead."""
        return self.call.need if isinstance(self.call, Free) else None

    @property
    def epoch(self) -> Epoch | None:
        """The epoch of the plan followed."""
        return self.following.epoch if self.following is not None else None

    @property
    def frozen(self) -> Epoch | None:
        """The epoch of the plan to come for which the robot stands, or which it makes."""
        return None if isinstance(self.call, Free) else self.call.epoch

    @property
    def collect(self) -> Collect | None:
        """The robot's own call, while it leads."""
        return self.call.collect if isinstance(self.call, Collecting | Searching) else None

    def carried(self, situation: Situation) -> JointPlan | None:
        """Return the plan that this robot made, while its record carries it."""
        return leader.carried(self.memory, situation)

    def refused(self, tick: int) -> Refusal | None:
        """Return the refusal to tell, while the leader may still need it."""
        refused = self.memory.refused
        return refused.refusal if refused and tick - refused.tick <= self.memory.settings.carry else None


def _through(
    table: tuple[Transition, ...],
    memory: Memory,
    state: Any,  # noqa: ANN401, of this table
    occasion: Occasion,
) -> tuple[Any, JointPlan | None, tuple[TrafficNote, ...]]:
    """Go through a table on an occasion; return the state that it leads to, the plan that came, and the events.

    A robot never takes part again in a call that it has left.
    """
    plan: JointPlan | None = None
    events: tuple[TrafficNote, ...] = ()
    for on, of, happens, _ in table:
        if not (isinstance(occasion, on) and isinstance(state, of)):
            continue
        move = happens(memory, state, occasion)
        if move is None:
            continue
        if isinstance(state, IN_CALL) and (not isinstance(move.to, IN_CALL) or move.to.epoch != state.epoch):
            memory.spent[state.epoch.leader] = state.epoch.tick
        state, plan, events = move.to, move.plan or plan, events + move.events
    return state, plan, events
