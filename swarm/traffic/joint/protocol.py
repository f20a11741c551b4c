"""One robot's part in joint plans: two state machines side by side.

The call that it takes part in. A robot goes on in the plan that it follows while it stands for the next one:

    Free --begin_call--> Collecting --begin_search--> Searching --publish_plan, report_no_plan--> Free
                                              Searching --advance_search, relax_problem--> Searching
    Free, Frozen, Collecting, Searching --take_call--> Frozen --receive_plan, abandon_call--> Free
    Free --ask_for_plan--> Free
    Frozen, Collecting, Searching --leave_calls--> Free
    Free, Frozen, Collecting, Searching --leave_after_sleep--> Free
    Free, Frozen, Collecting, Searching --report_ignored--> as before

The plan that it follows, if any:

    none, FollowedPlan --adopt_plan--> FollowedPlan --drop_plan--> none
    none, FollowedPlan --refuse_plan--> as before

There is no leader election: the lowest id in range leads. If a leader falls silent, the next request
names the next id. A plan gives no right to any cell: a plan that is lost, late or half adopted costs time only.
"""

from collections.abc import Callable
from typing import Any, Final, NamedTuple

from swarm.messages.traffic import Collect, Epoch, JointPlan, Refusal
from swarm.traffic.joint import leader, member
from swarm.traffic.joint.states import (
    BroadcastTurn,
    Call,
    Collecting,
    FollowedPlan,
    Free,
    Frozen,
    PlanArrival,
    PlanDrop,
    PlanningMemory,
    PlanningStop,
    Searching,
    TransitionResult,
    WakeUp,
)
from swarm.traffic.peers.records import TrafficNote
from swarm.traffic.peers.situation import Situation
from swarm.traffic.settings import TrafficConstants

Occasion = (
    Situation | BroadcastTurn | PlanningStop | WakeUp | PlanArrival | PlanDrop
)  # Situation: what is known in each tick
Types = type[Any] | tuple[type[Any], ...]


class Transition(NamedTuple):
    """One arrow of the drawing: if something happens, the robot goes from one state to another."""

    on: Types  # occasions
    of: Types  # states
    happens: Callable[[PlanningMemory, Any, Any], TransitionResult | None]  # of the memory, the state, the occasion
    to: Types  # the next state; the same types as in ``of``: the state stays as it is


NONE: Final = type(None)  # it follows no plan
IN_CALL: Final = (Frozen, Collecting, Searching)
ANY_CALL: Final = (Free, *IN_CALL)
ANY_PLAN: Final = (NONE, FollowedPlan)

# fmt: off
CALLS: Final = (  # tried on each occasion from top to bottom, in the state that the ones above have led to
    #          on                             in            what happens               to
    Transition(Situation,                     ANY_CALL,     leader.report_ignored,     ANY_CALL),
    Transition(Situation,                     ANY_CALL,     member.take_call,          Frozen),
    Transition(Situation,                     Free,         leader.begin_call,         Collecting),
    Transition(Situation,                     Collecting,   leader.begin_search,       Searching),
    Transition(Situation,                     Searching,    leader.advance_search,     Searching),
    Transition(Situation,                     Searching,    leader.publish_plan,       Free),
    Transition(Situation,                     Searching,    leader.relax_problem,      Searching),
    Transition(Situation,                     Searching,    leader.report_no_plan,     Free),
    Transition(Situation,                     Frozen,       member.receive_plan,       Free),
    Transition(Situation,                     Frozen,       member.abandon_call,       Free),
    Transition(BroadcastTurn,                 Free,         member.ask_for_plan,       Free),
    Transition(PlanningStop,                  IN_CALL,      member.leave_calls,        Free),
    Transition(WakeUp,                        ANY_CALL,     member.leave_after_sleep,  Free),
)
PLANS: Final = (
    Transition(PlanArrival,                   ANY_PLAN,     member.adopt_plan,         FollowedPlan),
    Transition(PlanArrival,                   ANY_PLAN,     member.refuse_plan,        ANY_PLAN),
    Transition((PlanDrop, PlanningStop),      FollowedPlan, member.drop_plan,          NONE),
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
        self.following: FollowedPlan | None = None
        self.memory = PlanningMemory(me, settings)

    def handle_occasion(self, occasion: Occasion) -> Decision:
        """Change both states as the tables say. A plan that comes is at once an occasion for the second table."""
        self.call, plan, events = _walk_table(CALLS, self.memory, self.call, occasion)
        if plan is not None and isinstance(occasion, Situation):
            occasion = PlanArrival(plan, occasion)
        self.following, _, more = _walk_table(PLANS, self.memory, self.following, occasion)
        way: tuple[int, ...] | None = None
        if plan is not None and self.following is not None and self.following.plan is plan:
            way = plan.ways[self.memory.me]
        return Decision(way, events + more)

    # ---- what the robot tells

    @property
    def leader_asked(self) -> str | None:
        """The robot that it asks to lead."""
        return self.call.need if isinstance(self.call, Free) else None

    @property
    def epoch(self) -> Epoch | None:
        """The epoch of the plan followed."""
        return self.following.epoch if self.following is not None else None

    @property
    def call_epoch(self) -> Epoch | None:
        """The epoch of the plan to come for which the robot stands, or which it makes."""
        return None if isinstance(self.call, Free) else self.call.epoch

    @property
    def own_call(self) -> Collect | None:
        """The robot's own call, while it leads."""
        return self.call.collect if isinstance(self.call, Collecting | Searching) else None

    def plan_to_carry(self, situation: Situation) -> JointPlan | None:
        """Return the plan that this robot made, while its record carries it."""
        return leader.plan_to_carry(self.memory, situation)

    def refusal_to_tell(self, tick: int) -> Refusal | None:
        """Return the refusal to tell, while the leader may still need it."""
        refused = self.memory.refused
        return refused.refusal if refused and tick - refused.tick <= self.memory.settings.carry else None


def _walk_table(
    table: tuple[Transition, ...],
    memory: PlanningMemory,
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
