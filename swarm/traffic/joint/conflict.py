"""When a robot asks for a joint plan, and whom: its way is blocked by a robot that does not clear it without one."""

from itertools import pairwise
from typing import Final

from swarm.messages.traffic import Record
from swarm.traffic.joint.states import NEVER, Free, Memory, Move, Speaks
from swarm.traffic.peers.situation import Situation
from swarm.traffic.settings import TrafficConstants

AT_REST: Final = 20  # ticks a robot has stood at its goal before it counts as resting there


def asks(memory: Memory, call: Free, own: Speaks) -> Move | None:
    """Ask the lowest id in hearing to lead, me included, if a conflict needs a joint plan; else ask nobody."""
    if own.situation.tick >= memory.asks_from and reason(own, memory.settings) is not None:
        return Move(named_leader(memory, call, own.situation))
    return Move(call._replace(need=None)) if call.need is not None else None


def named_leader(memory: Memory, free: Free, situation: Situation) -> Free:
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


def reason(own: Speaks, settings: TrafficConstants) -> str | None:
    """Return why a robot that is about to speak needs a joint plan, or None."""
    if not own.ahead:
        return None
    situation = own.situation
    for robot in own.waits:
        record = situation.fresh.get(robot)
        if record is None or record.frozen is not None or record.stands:
            continue
        if own.epoch is not None and record.epoch == own.epoch:
            continue  # it follows the same plan
        if own.ahead[0] in record.held and _rests(record, situation.tick, settings):
            return "rest"
        if record.ahead and own.ahead[0] in record.held and record.ahead[0] in own.held:
            return "head-on"
        if _circle(own, robot):
            return "circle"
    for record in situation.fresh.values():
        if record.stands:
            continue  # no plan moves it
        if record.frozen is None and own.epoch is None and record.epoch is None and _will_meet(own, record):
            return "will meet"
    if own.epoch is None:
        if situation.mutes and situation.mutes.issuperset(own.waits):
            return None  # no plan makes a mute robot move
        return "stuck" if own.waits and situation.tick - own.moved > _patience(own, settings) else None
    return "plan stuck" if _plan_stands(own, settings) else None


def _patience(own: Speaks, settings: TrafficConstants) -> int:
    """Return how long a robot may stand before it is stuck [ticks]: longer if all robots waited for are silent.

    The robot first looks then: no plan makes a dead robot move, but its cell may be empty.
    """
    looks = not any(robot in own.situation.fresh for robot in own.waits)
    return settings.stuck + (settings.surmise if looks else 0)


def _will_meet(own: Speaks, record: Record) -> bool:
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


def _rests(record: Record, tick: int, settings: TrafficConstants) -> bool:
    """Return True if a robot rests at its goal. One with stops left rests only after longer: it may go on by itself."""
    lasts = AT_REST if record.done or record.idle else settings.stuck
    standing = not record.ahead and not record.claims and len(record.held) == 1
    return standing and tick - record.moved > lasts


def _circle(own: Speaks, robot: str) -> bool:
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


def _plan_stands(own: Speaks, settings: TrafficConstants) -> bool:
    """Return True if the robot has waited long and, as far as it hears, no member of its plan has made progress."""
    limit = own.situation.tick - settings.plan_stuck
    members = [record for record in own.situation.fresh.values() if record.epoch == own.epoch]
    return own.moved < limit and all(record.moved < limit for record in members)
