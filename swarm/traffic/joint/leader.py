"""Leading: a robot calls the others, waits until they stand, searches for a plan, and publishes it.

The functions named in the table of ``joint`` return the result of a transition, or None if it does not happen.
"""

from swarm.messages.traffic import Collect, Entry, Epoch, JointPlan, Refusal
from swarm.traffic.joint.following import SETTLE
from swarm.traffic.joint.problem import ATTEMPTS, members_of, question_of
from swarm.traffic.joint.states import Collecting, Free, Move, Part, Published, Searching
from swarm.traffic.lattice.cell_map import CellMap
from swarm.traffic.mapf.planner import Outcome, Result
from swarm.traffic.mapf.precedence import Order
from swarm.traffic.peers.records import Event
from swarm.traffic.peers.situation import Situation


def named(part: Part, call: Free, situation: Situation) -> Move | None:
    """Call all robots in hearing if one asks me to lead, or if a member refuses the plan that I published last."""
    if situation.tick < part.leads_from:
        return None
    asked = call.need == part.me or part.me in [record.need for record in situation.fresh.values()]
    refusals = _refusals(part, situation)
    if not asked and not refusals:
        return None
    part.shut = {join: until for join, until in part.shut.items() if until > situation.tick}
    for refusal in refusals:
        part.shut.update(dict.fromkeys(refusal.shut, situation.tick + part.settings.obstacle))
    return Move(Collecting(Collect(Epoch(situation.tick, part.me), _called(part, situation))))


def all_stand(part: Part, call: Collecting, situation: Situation) -> Move | None:
    """Begin to search when all members stand, or when the time for this is over.

    The next call then waits longer: over several relays, calls and answers may take longer than the time was.
    """
    settings, (epoch, members) = part.settings, call.collect
    late = situation.tick - epoch.tick >= part.gather
    all_in = all(
        robot == part.me or (robot in situation.fresh and situation.fresh[robot].frozen == epoch) for robot in members
    )
    if all_in or late:
        part.gather = settings.gather if all_in else min(2 * part.gather, settings.gather_longest)
        search = _searching(part, call.collect, 0, frozenset(), situation)
        return Move(search) if search is not None else None
    return None


def searched_on(part: Part, call: Searching, situation: Situation) -> Move | None:
    """Spend this tick's share of expansions on the search."""
    openings = part.settings.robot_openings // len(call.question.members)
    return Move(call._replace(answer=call.search.advance(openings)))


def found(part: Part, call: Searching, situation: Situation) -> Move | None:
    """Publish the plan, and follow it."""
    answer = call.answer
    if answer is None or answer.order is None or not _moves(answer):
        return None
    plan = _plan(call, answer, answer.order)
    part.published = part.unconfirmed = Published(plan, situation.tick)
    part.leads_from = situation.tick + part.settings.again
    names, ticks = call.question.members, situation.tick - call.epoch.tick
    said = Event("joint_plan", names, f"made a joint plan for {len(names)} robots in {ticks} ticks")
    return Move(Free(), plan, (said,))


def found_none(part: Part, call: Searching, situation: Situation) -> Move | None:
    """Ask an easier question, unless it is proven that there is no plan."""
    if call.answer is None or _is_proof(call, call.answer):
        return None
    attempts = range(call.question.attempt + 1, len(ATTEMPTS))
    easier = (_searching(part, call.collect, number, call.asked, situation) for number in attempts)
    return next((Move(search) for search in easier if search is not None), None)


def gave_up(part: Part, call: Searching, situation: Situation) -> Move | None:
    """Report that there is no plan, once for the same robots, and wait before leading again."""
    if call.answer is None:
        return None
    part.leads_from = situation.tick + part.settings.backoff
    proven, names = _is_proof(call, call.answer), call.question.members
    who = tuple(names[number] for number in call.answer.who) if proven else names
    if who in part.reported:
        return Move(Free())
    part.reported.add(who)
    if proven:
        said = Event("unsolvable", who, _proof(who, situation.cells))
    else:
        said = Event("no_plan_found", who, f"no plan found for {', '.join(who)} within the budget")
    return Move(Free(), events=(said,))


def _proof(who: tuple[str, ...], cells: CellMap) -> str:
    """Return what a proof over cells says: of the floor itself only if the cells leave no floor out."""
    if not cells.leaves_out:
        return f"no way exists for {', '.join(who)} to reach their targets together"
    return (
        f"no plan exists for {', '.join(who)} on this lattice of {cells.side:g} m, which leaves free floor out; "
        "try another `traffic.offset` or `traffic.cell`"
    )


def ignored(part: Part, situation: Situation) -> tuple[Event, ...]:
    """Report, once, the members heard that do not follow the plan I made: the others go on without them."""
    if part.unconfirmed is None or situation.tick - part.unconfirmed.tick <= 2 * SETTLE:
        return ()
    (plan, published), part.unconfirmed = part.unconfirmed, None
    ignoring = [
        robot
        for robot in sorted(plan.ways)
        if (record := situation.fresh.get(robot)) is not None
        and record.stamp > published + SETTLE
        and (record.epoch is None or record.epoch < plan.epoch)
        and record.frozen is None
    ]
    return tuple(
        Event("plan_ignored", (robot,), f"finds that {robot} does not follow its joint plan") for robot in ignoring
    )


def carried(part: Part, situation: Situation) -> JointPlan | None:
    """Return the plan that my record carries: the one I published last, for a while, or until all follow it."""
    published = part.published
    if published is None or situation.tick - published.tick > part.settings.carry:
        return None
    plan, fresh = published.plan, situation.fresh
    all_follow = all(robot == part.me or (robot in fresh and fresh[robot].epoch == plan.epoch) for robot in plan.ways)
    return None if all_follow else plan


def _called(part: Part, situation: Situation) -> tuple[str, ...]:
    """Return the robots in hearing that can follow a plan: those that were told to stop cannot."""
    return tuple(sorted([part.me, *(robot for robot, record in situation.fresh.items() if not record.stands)]))


def _refusals(part: Part, situation: Situation) -> list[Refusal]:
    """List what members have said against the plan that I published last."""
    if part.published is None:
        return []
    mine = part.published.plan.epoch
    refusals = (record.refusal for record in situation.fresh.values())
    return [refusal for refusal in refusals if refusal is not None and refusal.epoch == mine]


def _searching(
    part: Part, collect: Collect, number: int, asked: frozenset[object], situation: Situation
) -> Searching | None:
    """Ask the question of an attempt, on the floor as members have corrected it; None if it was asked before."""
    cells, members = situation.cells.without(part.shut), members_of(collect.epoch, part.me, situation)
    question = question_of(number, members, situation, cells, part.settings)
    if not question.members or question.asks in asked:
        return None
    return Searching(collect, question, question.search(collect.epoch, cells, part.settings), asked | {question.asks})


def _moves(answer: Result) -> bool:
    """Return True if the plan moves any robot."""
    return answer.order is not None and any(len(way) > 1 for way in answer.order.ways)


def _is_proof(call: Searching, answer: Result) -> bool:
    """Return True if it is proven that there is no plan, for any question."""
    return answer.outcome is Outcome.UNSOLVABLE and call.question.exact


def _plan(call: Searching, answer: Result, order: Order) -> JointPlan:
    question, names = call.question, call.question.members
    return JointPlan(
        epoch=call.epoch,
        ways=dict(zip(names, order.ways, strict=True)) | {robot: (cell,) for robot, cell in question.at_rest.items()},
        until=(names[answer.who[0]],) if answer.outcome is Outcome.FOR_ONE else question.until,
        after={
            robot: tuple(Entry(step, names[before.robot], before.place) for step, before in sorted(after.items()))
            for robot, after in zip(names, order.after, strict=True)
            if after
        },
    )
