"""A member's part: which call it stands for, and for how long; which plan it adopts, refuses and drops.

The functions named in the tables of ``protocol`` return the result of a transition, or None if it does not happen.
"""

from swarm.messages.traffic import MOST_SHUT, Refusal
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
    Refused,
    Searching,
    Wakes,
)
from swarm.traffic.peers.records import TrafficNote
from swarm.traffic.peers.situation import Situation
from swarm.traffic.reservations.route import shut_joins


def called(memory: Memory, call: Call, situation: Situation) -> Move | None:
    """Stand for the lowest leader that calls me. A robot that already stands or leads changes to a lower leader."""
    calls = [
        record.collect.epoch
        for robot, record in situation.fresh.items()
        if record.collect is not None and memory.me in record.collect.members and record.collect.epoch.leader == robot
    ]
    calls = [epoch for epoch in calls if epoch.tick > memory.spent.get(epoch.leader, -1)]
    if not calls:
        return None
    lowest = min(calls, key=lambda epoch: (epoch.leader, -epoch.tick))
    if isinstance(call, Free) or (lowest != call.epoch and lowest.leader <= call.epoch.leader):
        return Move(Frozen(lowest, situation.tick))
    return None


def plan_came(memory: Memory, call: Frozen, situation: Situation) -> Move | None:
    """Adopt the plan that the robot stands for."""
    leader = situation.others.get(call.epoch.leader)
    if leader is None or leader.plan is None or leader.plan.epoch != call.epoch:
        return None
    return Move(Free(), leader.plan)


def stood_in_vain(memory: Memory, call: Frozen, situation: Situation) -> Move | None:
    """Stop standing: it took too long, or the leader has given the call up or fallen silent."""
    leader = situation.fresh.get(call.epoch.leader)
    calls = leader is not None and leader.collect is not None and leader.collect.epoch == call.epoch
    if calls and situation.tick - call.since <= memory.settings.freeze:
        return None
    return Move(Free())


def left(memory: Memory, call: Frozen | Collecting | Searching, event: Leaves) -> Move | None:
    """Take part in no call: the robot was told to stop, or the floor has changed."""
    return Move(Free())


def woke(memory: Memory, call: Call, event: Wakes) -> Move | None:
    """Take part in no call, ask nobody to lead, and lead nobody until I have listened: I was away."""
    memory.leads_from = event.tick + memory.settings.listen
    return Move(call._replace(need=None) if isinstance(call, Free) else Free())


def adopts(memory: Memory, before: Following | None, event: Gets) -> Move | None:
    """Follow the plan if it begins where the robot stands and the map has every join of the robot's way."""
    (plan, situation), me = event, memory.me
    way = plan.ways.get(me)
    if way is None or way[0] != situation.head or shut_joins(way, situation.cells):
        return None
    memory.asks_from = situation.tick + memory.settings.calm
    if plan.epoch.leader != me:
        memory.published = None
    entries = {entry.step: entry for entry in plan.after.get(me, ())}
    return Move(Following(me, plan, tuple(sorted(plan.ways)), situation.tick, memory.settings.absent, entries))


def refuses(memory: Memory, before: Following | None, event: Gets) -> Move | None:
    """Tell the leader which joins the map lacks, those of the robot's own way first, and keep to the plan so far."""
    (plan, situation), way = event, event.plan.ways.get(memory.me, ())
    if not shut_joins(way, situation.cells) or way[0] != situation.head:
        return None
    ways = (way, *plan.ways.values())
    shut = tuple(dict.fromkeys(join for one in ways for join in shut_joins(one, situation.cells)))
    memory.refused = Refused(Refusal(plan.epoch, shut[:MOST_SHUT]), situation.tick)
    text = f"refuses the joint plan of {plan.epoch.leader}: no way from cell {shut[0][0]} to {shut[0][1]}"
    return Move(before, events=(TrafficNote("plan_refused", (memory.me,), text),))


def dropped(memory: Memory, following: Following, event: Drops | Leaves) -> Move | None:
    """Follow no plan: it has led the robot where it could, does not fit any more, or the robot was told to stop."""
    return Move(None)
