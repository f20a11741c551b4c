"""Standing for another robot's plan: which call a robot follows, and for how long.

The functions named in the table of ``joint`` return the result of a transition, or None if it does not happen.
"""

from swarm.traffic.joint.states import Call, Collecting, Free, Frozen, Leaves, Memory, Move, Searching, Wakes
from swarm.traffic.peers.situation import Situation


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
