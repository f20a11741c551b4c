"""A member's part in joint plans: when it asks for one and whom, which call it stands for, which plan it follows.

It asks if its way is blocked by a robot that does not clear it without a plan. The functions named in the tables of
``protocol`` return the result of a transition, or None if it does not happen.
"""

from itertools import pairwise
from typing import Final

from swarm.messages.traffic import MOST_SHUT, Record, Refusal
from swarm.traffic.joint.states import (
    NEVER,
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
    PlanRefusal,
    Searching,
    TransitionResult,
    WakeUp,
)
from swarm.traffic.peers.records import TrafficNote
from swarm.traffic.peers.situation import Situation, cells_needed_at_stop
from swarm.traffic.reservations.route import list_shut_joins
from swarm.traffic.settings import TrafficConstants

AT_REST: Final = 20  # ticks a robot has stood at its goal before it counts as resting there


def ask_for_plan(memory: PlanningMemory, call: Free, own: BroadcastTurn) -> TransitionResult | None:
    """Ask the lowest id in hearing to lead, me included, if a conflict needs a joint plan; else ask nobody."""
    if own.situation.tick >= memory.asks_from and reason_to_ask(own, memory.settings) is not None:
        return TransitionResult(name_leader(memory, call, own.situation))
    return TransitionResult(call._replace(need=None)) if call.need is not None else None


def name_leader(memory: PlanningMemory, free: Free, situation: Situation) -> Free:
    """Return the state with the robot that should lead: the lowest id that is fresh, me included.

    A leader that does not answer is passed over.
    """
    candidates = sorted([memory.me, *(robot for robot, one in situation.fresh.items() if not one.stands)])
    leader = next((robot for robot in candidates if memory.passed_over.get(robot, NEVER) < situation.tick), memory.me)
    if leader == memory.me:
        return free._replace(need=leader)
    times = free.asked.get(leader, 0) + 1
    if times > memory.settings.unanswered:
        memory.passed_over[leader] = situation.tick + memory.settings.pass_over
        times = 0
    return Free(leader, {**free.asked, leader: times})


def reason_to_ask(own: BroadcastTurn, settings: TrafficConstants) -> str | None:
    """Return why a robot that is about to speak needs a joint plan, or None."""
    if not own.ahead:
        return None
    situation = own.situation
    for robot in own.waits:
        record = situation.fresh.get(robot)
        if record is None or record.frozen is not None or record.stands:
            continue
        stays = bool(situation.docking) and (not record.ahead or bool(cells_needed_at_stop(record)))
        if own.epoch is not None and record.epoch == own.epoch and not stays:
            continue  # it follows the same plan
        if own.ahead[0] in record.held and _is_at_rest(record, situation.tick, settings):
            return "rest"
        if record.ahead and own.ahead[0] in record.held and record.ahead[0] in own.held:
            return "head-on"
        if _is_waiting_in_circle(own, robot):
            return "circle"
    for record in situation.fresh.values():
        if record.stands:
            continue  # no plan moves it
        if record.frozen is None and own.epoch is None and record.epoch is None and _will_meet(own, record):
            return "will meet"
    if own.epoch is None:
        if situation.mutes and situation.mutes.issuperset(own.waits):
            return None  # no plan makes a mute robot move
        return "stuck" if own.waits and situation.tick - own.moved > _ticks_until_stuck(own, settings) else None
    return "plan stuck" if _is_plan_stuck(own, settings) else None


def _ticks_until_stuck(own: BroadcastTurn, settings: TrafficConstants) -> int:
    """Return how long a robot may stand before it is stuck [ticks]: longer if all robots waited for are silent.

    The robot first looks then: no plan makes a dead robot move, but its cell may be empty.
    """
    looks = not any(robot in own.situation.fresh for robot in own.waits)
    return settings.stuck + (settings.surmise if looks else 0)


def _will_meet(own: BroadcastTurn, record: Record) -> bool:
    """Return True if the ways that two robots tell use the same joins in opposite directions at the same time.

    Neither makes way for the other without a plan. A plan that is made while they are far apart leads them past each
    other.
    """
    mine = {join: place for place, join in enumerate(pairwise((*own.held[-1:], *own.ahead)))}
    theirs = pairwise((*record.held[-1:], *record.ahead))
    shared = [(mine[b, a], place) for place, (a, b) in enumerate(theirs) if (b, a) in mine]
    if not shared:
        return False
    first, other = min(place for place, _ in shared), min(place for _, place in shared)
    return abs(first - other) < len(shared)


def _is_at_rest(record: Record, tick: int, settings: TrafficConstants) -> bool:
    """Return True if a robot rests at its goal. One with stops left rests only after longer: it may go on by itself."""
    lasts = AT_REST if record.done or record.idle else settings.stuck
    standing = not record.ahead and not record.claims and len(record.held) == 1
    return standing and tick - record.moved > lasts


def _is_waiting_in_circle(own: BroadcastTurn, robot: str) -> bool:
    """Return True if the chain of robots that wait, from ``robot`` on, leads back to the robot that asks."""
    seen, front = {robot}, [robot]
    while front:
        record = own.situation.fresh.get(front.pop())
        for other in record.waits if record is not None else ():
            if other == own.robot:
                return True
            if other not in seen:
                seen.add(other)
                front.append(other)
    return False


def _is_plan_stuck(own: BroadcastTurn, settings: TrafficConstants) -> bool:
    """Return True if the robot has waited long and, as far as it hears, no member of its plan has made progress."""
    limit = own.situation.tick - settings.plan_stuck
    members = [record for record in own.situation.fresh.values() if record.epoch == own.epoch]
    return own.moved < limit and all(record.moved < limit for record in members)


def take_call(memory: PlanningMemory, call: Call, situation: Situation) -> TransitionResult | None:
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
        return TransitionResult(Frozen(lowest, situation.tick))
    return None


def receive_plan(memory: PlanningMemory, call: Frozen, situation: Situation) -> TransitionResult | None:
    """Adopt the plan that the robot stands for."""
    leader = situation.others.get(call.epoch.leader)
    if leader is None or leader.plan is None or leader.plan.epoch != call.epoch:
        return None
    return TransitionResult(Free(), leader.plan)


def abandon_call(memory: PlanningMemory, call: Frozen, situation: Situation) -> TransitionResult | None:
    """Stop standing: it took too long, or the leader has given the call up or fallen silent."""
    leader = situation.fresh.get(call.epoch.leader)
    calls = leader is not None and leader.collect is not None and leader.collect.epoch == call.epoch
    if calls and situation.tick - call.since <= memory.settings.freeze:
        return None
    return TransitionResult(Free())


def leave_calls(
    memory: PlanningMemory, call: Frozen | Collecting | Searching, event: PlanningStop
) -> TransitionResult | None:
    """Take part in no call: the robot was told to stop, or the floor has changed."""
    return TransitionResult(Free())


def leave_after_sleep(memory: PlanningMemory, call: Call, event: WakeUp) -> TransitionResult | None:
    """Take part in no call, ask nobody to lead, and lead nobody until I have listened: I was away."""
    memory.leads_from = event.tick + memory.settings.listen
    return TransitionResult(call._replace(need=None) if isinstance(call, Free) else Free())


def adopt_plan(memory: PlanningMemory, before: FollowedPlan | None, event: PlanArrival) -> TransitionResult | None:
    """Follow the plan if it begins where the robot stands and the map has every join of the robot's way."""
    (plan, situation), me = event, memory.me
    way = plan.ways.get(me)
    if way is None or way[0] != situation.head or list_shut_joins(way, situation.cells):
        return None
    memory.asks_from = situation.tick + memory.settings.calm
    if plan.epoch.leader != me:
        memory.published = None
    entries = {entry.step: entry for entry in plan.after.get(me, ())}
    return TransitionResult(
        FollowedPlan(me, plan, tuple(sorted(plan.ways)), situation.tick, memory.settings.absent, entries)
    )


def refuse_plan(memory: PlanningMemory, before: FollowedPlan | None, event: PlanArrival) -> TransitionResult | None:
    """Tell the leader which joins the map lacks, those of the robot's own way first; the plan followed stays."""
    (plan, situation), way = event, event.plan.ways.get(memory.me, ())
    if not list_shut_joins(way, situation.cells) or way[0] != situation.head:
        return None
    ways = (way, *plan.ways.values())
    shut = tuple(dict.fromkeys(join for one in ways for join in list_shut_joins(one, situation.cells)))
    memory.refused = PlanRefusal(Refusal(plan.epoch, shut[:MOST_SHUT]), situation.tick)
    text = f"refuses the joint plan of {plan.epoch.leader}: no way from cell {shut[0][0]} to {shut[0][1]}"
    return TransitionResult(before, events=(TrafficNote("plan_refused", (memory.me,), text),))


def drop_plan(
    memory: PlanningMemory, following: FollowedPlan, event: PlanDrop | PlanningStop
) -> TransitionResult | None:
    """Follow no plan: it has led the robot where it could, does not fit any more, or the robot was told to stop."""
    return TransitionResult(None)
