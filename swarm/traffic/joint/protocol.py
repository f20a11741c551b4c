"""One robot's part in joint plans: two state machines side by side.

The call that it takes part in. A robot goes on in the plan that it follows while it stands for the next one:

    Free --called--> Frozen --plan_came, stood_in_vain--> Free
    Free --named--> Collecting --all_stand--> Searching --found, gave_up--> Free
                                              Searching --searched_on, found_none--> Searching
    Frozen, Collecting, Searching --called--> Frozen
    Free --asks--> Free
    Frozen, Collecting, Searching --left--> Free
    Free, Frozen, Collecting, Searching --woke--> Free

The plan that it follows, if any:

    none --adopts--> Following --leaves--> none
                     Following --adopts--> Following

There is no leader election: the lowest id in range leads. If a leader falls silent, the next request
names the next id. A plan gives no right to any cell: a plan that is lost, late or half adopted costs time only.
"""

from collections.abc import Callable
from typing import Any, Final, NamedTuple

from swarm.messages.traffic import MOST_SHUT, Collect, Epoch, JointPlan, Refusal
from swarm.traffic.joint import leader, member
from swarm.traffic.joint.conflict import asks
from swarm.traffic.joint.following import Following
from swarm.traffic.joint.states import (
    Call,
    Collecting,
    Free,
    Frozen,
    Leaves,
    Memory,
    Move,
    Refused,
    Searching,
    Speaks,
    Wakes,
)
from swarm.traffic.peers.records import TrafficNote
from swarm.traffic.peers.situation import Situation
from swarm.traffic.reservations.route import shut_joins
from swarm.traffic.settings import TrafficConstants

Occasion = Situation | Speaks | Leaves | Wakes  # Situation: what is known in each tick


class Transition(NamedTuple):
    """One arrow of the drawing: if something happens, the robot goes from one state to another."""

    on: type[Occasion]
    of: type[Call]
    happens: Callable[[Memory, Any, Any], Move | None]  # the last argument is the occasion
    to: type[Call]


# fmt: off
TRANSITIONS: Final = (  # tried on each occasion from top to bottom, in the state that the ones above have led to
    #          on         in          what happens            to
    Transition(Situation, Free,       member.called,        Frozen),
    Transition(Situation, Frozen,     member.called,        Frozen),
    Transition(Situation, Collecting, member.called,        Frozen),
    Transition(Situation, Searching,  member.called,        Frozen),
    Transition(Situation, Free,       leader.named,          Collecting),
    Transition(Situation, Collecting, leader.all_stand,      Searching),
    Transition(Situation, Searching,  leader.searched_on,    Searching),
    Transition(Situation, Searching,  leader.found,          Free),
    Transition(Situation, Searching,  leader.found_none,     Searching),
    Transition(Situation, Searching,  leader.gave_up,        Free),
    Transition(Situation, Frozen,     member.plan_came,     Free),
    Transition(Situation, Frozen,     member.stood_in_vain, Free),
    Transition(Speaks,    Free,       asks,                   Free),
    Transition(Leaves,    Frozen,     member.left,          Free),
    Transition(Leaves,    Collecting, member.left,          Free),
    Transition(Leaves,    Searching,  member.left,          Free),
    Transition(Wakes,     Free,       member.woke,          Free),
    Transition(Wakes,     Frozen,     member.woke,          Free),
    Transition(Wakes,     Collecting, member.woke,          Free),
    Transition(Wakes,     Searching,  member.woke,          Free),
)
# fmt: on


class Decision(NamedTuple):
    """The decisions of one step."""

    way: tuple[int, ...] | None = None  # of a plan adopted in this step, from the head on
    events: tuple[TrafficNote, ...] = ()


class JointPlanning:
    """The two state machines of one robot."""

    def __init__(self, me: str, settings: TrafficConstants) -> None:
        self.call: Call = Free()
        self.following: Following | None = None
        self.memory = Memory(me, settings)

    def step(self, situation: Situation) -> Decision:
        """Answer calls, lead if named, continue the search, and adopt a plan that came."""
        events = leader.ignored(self.memory, situation)
        plan, said = self._take(situation)
        if plan is None:
            return Decision(events=events + said)
        adopted = self._adopt(plan, situation)
        return Decision(adopted.way, events + said + adopted.events)

    def ask(self, own: Speaks) -> None:
        """Decide which robot to ask to lead, if any; call it before each broadcast."""
        self._take(own)

    def leave(self) -> None:
        """Stop following the plan."""
        self.following = None

    def void(self) -> None:
        """Leave the plan followed and the call: the robot was told to stop, or they were for another floor."""
        self.leave()
        self._take(Leaves())

    def wake(self, tick: int) -> None:
        """Leave the call: the robot was away. The plan followed stays."""
        self._take(Wakes(tick))

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

    # ---- from state to state

    def _take(self, occasion: Occasion) -> tuple[JointPlan | None, tuple[TrafficNote, ...]]:
        """Go through the table on an occasion; return the plan that came and the events."""
        plan: JointPlan | None = None
        events: tuple[TrafficNote, ...] = ()
        for on, state, happens, _ in TRANSITIONS:
            if isinstance(self.call, state) and isinstance(occasion, on):
                move = happens(self.memory, self.call, occasion)
                if move is not None:
                    self._go(move.to)
                    plan, events = move.plan or plan, events + move.events
        return plan, events

    def _go(self, to: Call) -> None:
        """Enter a state; the robot never takes part again in a call that it has left."""
        if not isinstance(self.call, Free) and (isinstance(to, Free) or to.epoch != self.call.epoch):
            self.memory.spent[self.call.epoch.leader] = self.call.epoch.tick
        self.call = to

    def _adopt(self, plan: JointPlan, situation: Situation) -> Decision:
        """Follow a plan if it begins where the robot stands; refuse it if the map lacks a join of the robot's way."""
        memory, way = self.memory, plan.ways.get(self.memory.me)
        if way is None or way[0] != situation.head:
            return Decision()
        if shut_joins(way, situation.cells):
            return Decision(events=(self._refuse(plan, way, situation),))
        entries = {entry.step: entry for entry in plan.after.get(memory.me, ())}
        self.following = Following(
            memory.me, plan, tuple(sorted(plan.ways)), situation.tick, memory.settings.absent, entries
        )
        memory.asks_from = situation.tick + memory.settings.calm
        if plan.epoch.leader != memory.me:
            memory.published = None
        return Decision(way)

    def _refuse(self, plan: JointPlan, way: tuple[int, ...], situation: Situation) -> TrafficNote:
        """Refuse a plan: tell the leader which joins are shut, those of the robot's own way first."""
        memory, cells = self.memory, situation.cells
        shut = tuple(dict.fromkeys(join for one in (way, *plan.ways.values()) for join in shut_joins(one, cells)))
        memory.refused = Refused(Refusal(plan.epoch, shut[:MOST_SHUT]), situation.tick)
        text = f"refuses the joint plan of {plan.epoch.leader}: no way from cell {shut[0][0]} to {shut[0][1]}"
        return TrafficNote("plan_refused", (memory.me,), text)
