"""Leading: a robot calls the others, waits until they stand, searches for a plan, and publishes it.

The functions named in the tables of ``protocol`` return the result of a transition, or None if it does not happen.
"""

from swarm.messages.traffic import Collect, Entry, Epoch, JointPlan, Refusal
from swarm.traffic.joint.problem import RELAXATIONS, Problem, members_of, problem_of
from swarm.traffic.joint.states import (
    SETTLE,
    Call,
    Collecting,
    Free,
    PlanningMemory,
    PublishedPlan,
    Searching,
    TransitionResult,
)
from swarm.traffic.lattice.cell_map import CellMap
from swarm.traffic.mapf.planner import SearchOutcome, SearchResult
from swarm.traffic.mapf.precedence import Precedence
from swarm.traffic.peers.records import TrafficNote
from swarm.traffic.peers.situation import Situation


def begin_call(memory: PlanningMemory, call: Free, situation: Situation) -> TransitionResult | None:
    """Call all robots in hearing if one asks me to lead, or if a member refuses the plan that I published last."""
    if situation.tick < memory.leads_from:
        return None
    asked = call.need == memory.me or memory.me in [record.need for record in situation.fresh.values()]
    refusals = _refusals(memory, situation)
    if not asked and not refusals:
        return None
    memory.shut = {join: until for join, until in memory.shut.items() if until > situation.tick}
    for refusal in refusals:
        memory.shut.update(dict.fromkeys(refusal.shut, situation.tick + memory.settings.obstacle))
    follow = [robot for robot, record in situation.fresh.items() if not record.stands]  # who was told to stop cannot
    return TransitionResult(Collecting(Collect(Epoch(situation.tick, memory.me), tuple(sorted([memory.me, *follow])))))


def begin_search(memory: PlanningMemory, call: Collecting, situation: Situation) -> TransitionResult | None:
    """Begin to search when all members stand, or when the time for this is over.

    The next call then waits longer: over several relays, calls and answers may take longer than the time was.
    """
    settings, (epoch, members) = memory.settings, call.collect
    late = situation.tick - epoch.tick >= memory.gather
    all_in = all(
        robot == memory.me or (robot in situation.fresh and situation.fresh[robot].frozen == epoch) for robot in members
    )
    if all_in or late:
        memory.gather = settings.gather if all_in else min(2 * memory.gather, settings.gather_longest)
        return _search_next_problem(memory, call.collect, 0, frozenset(), situation)
    return None


def advance_search(memory: PlanningMemory, call: Searching, situation: Situation) -> TransitionResult | None:
    """Spend this tick's share of expansions on the search."""
    openings = memory.settings.robot_openings // len(call.problem.members)
    return TransitionResult(call._replace(answer=call.search.advance(openings)))


def publish_plan(memory: PlanningMemory, call: Searching, situation: Situation) -> TransitionResult | None:
    """Publish the plan, and follow it."""
    answer = call.answer
    if answer is None or answer.order is None or not any(len(way) > 1 for way in answer.order.ways):
        return None  # there is no plan, or it moves nobody
    plan = _plan(call, answer, answer.order)
    memory.published = memory.unconfirmed = PublishedPlan(plan, situation.tick)
    memory.leads_from = situation.tick + memory.settings.again
    names, ticks = call.problem.members, situation.tick - call.epoch.tick
    said = TrafficNote("joint_plan", names, f"made a joint plan for {len(names)} robots in {ticks} ticks")
    return TransitionResult(Free(), plan, (said,))


def relax_problem(memory: PlanningMemory, call: Searching, situation: Situation) -> TransitionResult | None:
    """Relax the problem, unless it is proven that there is no plan."""
    if call.answer is None or _is_proof(call, call.answer):
        return None
    return _search_next_problem(memory, call.collect, call.problem.relaxation + 1, call.asked, situation)


def report_no_plan(memory: PlanningMemory, call: Searching, situation: Situation) -> TransitionResult | None:
    """Report that there is no plan, and wait before leading again.

    A proof is reported again each time it is found: it still holds although others have reached their stops meanwhile.
    A search that ended at its budget is reported once for the same robots.
    """
    if call.answer is None:
        return None
    memory.leads_from = situation.tick + memory.settings.backoff
    proven, names = _is_proof(call, call.answer), call.problem.members
    who = tuple(names[number] for number in call.answer.who) if proven else names
    if proven:
        return TransitionResult(Free(), events=(TrafficNote("unsolvable", who, _proof_text(who, situation.cells)),))
    if who in memory.reported:
        return TransitionResult(Free())
    memory.reported.add(who)
    said = TrafficNote("no_plan_found", who, f"no plan found for {', '.join(who)} within the budget")
    return TransitionResult(Free(), events=(said,))


def _proof_text(who: tuple[str, ...], cells: CellMap) -> str:
    """Return what a proof over cells says: of the floor itself only if the cells leave no floor out."""
    if not cells.has_unused_floor:
        return f"no way exists for {', '.join(who)} to reach their targets together"
    return (
        f"no plan exists for {', '.join(who)}: the floor is too narrow there for robots that reserve squares of "
        f"{cells.side:g} m; move a target or widen the way"
    )


def report_ignored(memory: PlanningMemory, call: Call, situation: Situation) -> TransitionResult | None:
    """Report, once, the members heard that do not follow the plan I made: the others go on without them."""
    if memory.unconfirmed is None or situation.tick - memory.unconfirmed.tick <= 2 * SETTLE:
        return None
    (plan, published), memory.unconfirmed = memory.unconfirmed, None
    ignoring = [
        robot
        for robot in sorted(plan.ways)
        if (record := situation.fresh.get(robot)) is not None
        and record.stamp > published + SETTLE
        and (record.epoch is None or record.epoch < plan.epoch)
        and record.frozen is None
    ]
    said = [
        TrafficNote("plan_ignored", (robot,), f"finds that {robot} does not follow its joint plan")
        for robot in ignoring
    ]
    return TransitionResult(call, events=tuple(said))


def plan_to_carry(memory: PlanningMemory, situation: Situation) -> JointPlan | None:
    """Return the plan that my record carries: the one I published last, for a while, or until all follow it."""
    published = memory.published
    if published is None or situation.tick - published.tick > memory.settings.carry:
        return None
    plan, fresh = published.plan, situation.fresh
    all_follow = all(robot == memory.me or (robot in fresh and fresh[robot].epoch == plan.epoch) for robot in plan.ways)
    return None if all_follow else plan


def _refusals(memory: PlanningMemory, situation: Situation) -> list[Refusal]:
    """List what members have said against the plan that I published last."""
    if memory.published is None:
        return []
    mine = memory.published.plan.epoch
    refusals = (record.refusal for record in situation.fresh.values())
    return [refusal for refusal in refusals if refusal is not None and refusal.epoch == mine]


def _search_next_problem(
    memory: PlanningMemory, collect: Collect, first: int, asked: frozenset[object], situation: Situation
) -> TransitionResult | None:
    """Begin to search for an answer to the next problem that was not asked before, on the corrected floor.

    Where cells that a dead robot held cut robots off from their goals, a plan leads nobody on: such a problem is asked
    only if there is no other at all.
    """
    cells, members = situation.cells.without_joins(memory.shut), members_of(collect.epoch, memory.me, situation)
    vain: Problem | None = None
    for number in range(first, len(RELAXATIONS)):
        problem = problem_of(number, members, situation, cells, memory.settings)
        if problem.members and problem.identity not in asked:
            if problem.is_useful:
                break
            vain = vain or problem
    else:
        if vain is None or first > 0:
            return None
        problem = vain
    search = problem.search(collect.epoch, cells, memory.settings)
    return TransitionResult(Searching(collect, problem, search, asked | {problem.identity}))


def _is_proof(call: Searching, answer: SearchResult) -> bool:
    """Return True if it is proven that there is no plan, for any problem."""
    return answer.outcome is SearchOutcome.UNSOLVABLE and call.problem.exact


def _plan(call: Searching, answer: SearchResult, order: Precedence) -> JointPlan:
    problem, names = call.problem, call.problem.members
    return JointPlan(
        epoch=call.epoch,
        ways=dict(zip(names, order.ways, strict=True)) | {robot: (cell,) for robot, cell in problem.at_rest.items()},
        through=bool(problem.vias),
        until=(names[answer.who[0]],) if answer.outcome is SearchOutcome.FOR_ONE else problem.until,
        after={
            robot: tuple(Entry(step, names[before.robot], before.place) for step, before in sorted(after.items()))
            for robot, after in zip(names, order.after, strict=True)
            if after
        },
    )
