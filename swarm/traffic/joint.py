"""The life of a joint plan: somebody needs one, one leads, all near stand, the leader plans, each follows.

    free --named leader--> collecting --all stand--> planning --found--> following
    free --called-------> frozen ------------------- plan heard -------> following

Nobody is appointed and nobody dissolves anything: a leader that falls silent is not fresh, so the next need names the
next; whoever is called by two follows the lower id; who stood in vain for ``freeze`` ticks goes on alone. A plan never
gives a right to a cell: lost, late or half adopted it costs time only.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from random import Random
from typing import NamedTuple

from swarm.geometry import distance
from swarm.traffic.assign import Aside, assign
from swarm.traffic.cells import CellMap
from swarm.traffic.hearsay import Event
from swarm.traffic.joint_search import Budget, JointSearch, Outcome, Result
from swarm.traffic.record import MOST_SHUT, Collect, Entry, Epoch, JointPlan, Record, Refusal
from swarm.traffic.settings import TrafficSettings
from swarm.traffic.situation import Situation
from swarm.traffic.walk import Join, shut_joins

NEVER = -(10**9)
SETTLE = 20  # ticks after which a member that shows no sign of the plan is taken to go without it


class Attempt(NamedTuple):
    """How a leader puts the question to its search; an easier one follows where there is no answer."""

    strangers: bool  # plan round all that those hold who take no part, not only round bodies
    everybody: bool  # those that are where they want to be move too, where they are in the way
    aside: Aside


ATTEMPTS = (
    Attempt(True, True, Aside.NEAR),
    Attempt(True, False, Aside.NEAR),  # a smaller question: a search among many now and then loses itself
    Attempt(False, True, Aside.NEAR),
    Attempt(True, True, Aside.STAY),
    Attempt(True, True, Aside.AWAY),
    Attempt(True, False, Aside.AWAY),
    Attempt(False, True, Aside.AWAY),
)


class Task(NamedTuple):
    """What a leader gave to its search, to write the answer down by."""

    members: tuple[str, ...]
    starts: tuple[int, ...]
    goals: tuple[int, ...]
    attempt: int  # which of ATTEMPTS
    exact: bool  # walls alone are in the way and each has its own goal: "unsolvable" is true of the mission
    at_rest: dict[str, int]  # who stays where it is, and where that is
    until: tuple[str, ...]  # for whom the others make room


class JointPlanning:
    """One robot's part in joint plans."""

    def __init__(self, me: str, cells: CellMap, settings: TrafficSettings) -> None:
        self.me = me
        self.epoch: Epoch | None = None  # followed
        self.frozen: Epoch | None = None
        self.need: str | None = None
        self.collect: Collect | None = None
        self.plan: JointPlan | None = None  # published, or followed
        self.way: tuple[int, ...] | None = None  # just adopted; the caller takes it
        self.adopted = NEVER
        self.plans_made = 0
        self.cells = cells
        self._settings = settings
        self._since = NEVER  # frozen
        self._lead_from = NEVER
        self._published = NEVER
        self._unconfirmed: JointPlan | None = None  # made by me, and not yet seen whether all take it up
        self._spent: set[Epoch] = set()
        self._asked: dict[str, int] = {}  # leader -> how often it was named without answering
        self._passed_over: dict[str, int] = {}  # leader -> until when
        self._search: JointSearch | None = None
        self._task: Task | None = None
        self._entries: dict[int, Entry] = {}
        self._reported: set[tuple[str, ...]] = set()
        self._asked_before: set[tuple[object, ...]] = set()  # the questions put to the search for this plan
        self._news: list[Event] = []  # to be told with the next step
        self._refusal: Refusal | None = None  # mine
        self._refused_at = NEVER
        self._shut: dict[Join, int] = {}  # joins that members have refused, and until when that is believed

    # ---- what others may read

    def carried(self, tick: int) -> JointPlan | None:
        """Give the plan this robot made, as long as its record carries it."""
        mine = self.plan is not None and self.plan.epoch.leader == self.me
        return self.plan if mine and tick - self._published <= self._settings.carry else None

    def follows(self, robot: str) -> bool:
        """Tell whether a robot has a part in the plan followed."""
        return self.epoch is not None and self.plan is not None and robot in self.plan.ways

    def waits_for(self, step: int, situation: Situation) -> str | None:
        """Name the robot that must first leave the ``step``-th cell of the way, if it has not."""
        entry = self._entries.get(step) if self.epoch is not None else None
        if entry is None:
            return None
        record = situation.others.get(entry.robot)
        if record is None or situation.tick - record.stamp > self._settings.absent:
            return None  # silent or out of reach: the holds alone decide
        if record.epoch == self.epoch:
            return None if record.left > entry.place else entry.robot
        return entry.robot if self._about_to_follow(record) else None

    def next_after(self, step: int, situation: Situation) -> bool:
        """Tell whether the robot waited for is in that very visit now, so that nobody else comes in between."""
        entry = self._entries[step]
        record = situation.fresh.get(entry.robot)
        return record is not None and record.epoch == self.epoch and record.left <= entry.place <= record.entered

    def first_at(self, cell: int, fresh: Mapping[str, Record]) -> str | None:
        """Name the member, still following, whose way ends in a cell it is not just put into: it has the first turn."""
        if self.epoch is None or self.plan is None:
            return None
        for robot, way in sorted(self.plan.ways.items()):
            record = fresh.get(robot) if way[-1] == cell and robot != self.me else None
            if record is None or record.idle or record.goal != cell:
                continue  # it was only put there, or has been there: it wants to be elsewhere now
            if record.epoch == self.epoch or self._about_to_follow(record):
                return robot
        return None

    def makes_room(self, situation: Situation, *, under_way: bool) -> bool:
        """Return True if the plan is for some only, and one of them has still to arrive, or this robot to make room."""
        if self.epoch is None or self.plan is None or not self.plan.until:
            return False
        if under_way:
            return True
        for robot in self.plan.until:
            record = situation.fresh.get(robot) if robot != self.me else None
            if record is None:
                continue
            if record.epoch == self.epoch and record.left < len(self.plan.ways[robot]) - 1:
                return True
            if record.epoch != self.epoch and self._about_to_follow(record):
                return True
        return False

    def is_waited_for(self, leaves: Collection[int], situation: Situation) -> bool:
        """Return True if a member of the plan followed has claimed a cell that this robot is about to leave."""
        return any(
            self.follows(robot) and any(claim.cell in leaves for claim in record.claims)
            for robot, record in situation.fresh.items()
        )

    def _about_to_follow(self, record: Record) -> bool:
        """Tell whether a member may not have adopted my plan yet when it said this."""
        if self.epoch is None or (record.epoch is not None and record.epoch > self.epoch):
            return False
        return record.stamp <= self.adopted + SETTLE or record.frozen == self.epoch

    # ---- the cycle

    def leave(self) -> None:
        """Go on alone."""
        self.epoch = None
        self._entries = {}

    def void(self) -> None:
        """Drop a plan made, followed or waited for: it was for another floor."""
        self.leave()
        self.way = None
        self._thaw()

    def refused(self, tick: int) -> Refusal | None:
        """Return the refusal to tell, as long as its leader can still be told."""
        return self._refusal if tick - self._refused_at <= self._settings.carry else None

    def reset(self, tick: int) -> None:
        """Stand for nobody's plan any more: the robot was away."""
        self._thaw()
        self.need = None
        self._lead_from = tick + self._settings.listen

    def ask(self, situation: Situation) -> None:
        """Name who shall lead: the lowest id that is fresh, me included; who does not answer is passed over."""
        tick = situation.tick
        candidates = sorted([self.me, *situation.fresh])
        leader = next((robot for robot in candidates if self._passed_over.get(robot, NEVER) < tick), self.me)
        self.need = leader
        if leader != self.me:
            self._asked[leader] = self._asked.get(leader, 0) + 1
            if self._asked[leader] > self._settings.unanswered:
                self._passed_over[leader] = tick + self._settings.pass_over
                self._asked[leader] = 0

    def step(self, situation: Situation) -> list[Event]:
        """Follow calls, lead when named, plan a little, adopt what came."""
        events, self._news = [*self._news, *self._name_who_ignores(situation)], []
        self._join_a_call(situation)
        if self.frozen is None and self._named(situation):
            self._begin_to_collect(situation)
        if self.collect is not None:
            return events + self._lead(situation)
        if self.frozen is not None:
            self._await_plan(situation)
        return events

    def _name_who_ignores(self, situation: Situation) -> list[Event]:
        """Name, once, the members heard that have not taken up the plan I made: the others go on without them."""
        plan = self._unconfirmed
        if plan is None or situation.tick - self._published <= 2 * SETTLE:
            return []
        self._unconfirmed = None
        ignoring = tuple(
            robot
            for robot in sorted(plan.ways)
            if (record := situation.fresh.get(robot)) is not None
            and record.stamp > self._published + SETTLE
            and (record.epoch is None or record.epoch < plan.epoch)
            and record.frozen is None
        )
        return [Event("plan_ignored", (robot,), f"{robot} does not follow the plan of {self.me}") for robot in ignoring]

    def _named(self, situation: Situation) -> bool:
        if situation.tick < self._lead_from:
            return False
        if self.need == self.me or self.me in [record.need for record in situation.fresh.values()]:
            return True
        return bool(self._refusals(situation))

    def _refusals(self, situation: Situation) -> list[Refusal]:
        """List what members have said against the plan that I published last."""
        mine = self.plan.epoch if self.plan is not None and self.plan.epoch.leader == self.me else None
        refusals = (record.refusal for record in situation.fresh.values())
        return [refusal for refusal in refusals if refusal is not None and refusal.epoch == mine]

    def _begin_to_collect(self, situation: Situation) -> None:
        self._shut = {join: until for join, until in self._shut.items() if until > situation.tick}
        for refusal in self._refusals(situation):
            self._shut.update(dict.fromkeys(refusal.shut, situation.tick + self._settings.obstacle))
        epoch = Epoch(situation.tick, self.me)
        self.collect = Collect(epoch, tuple(sorted([self.me, *situation.fresh])))
        self._freeze(epoch, situation.tick)

    def _freeze(self, epoch: Epoch, tick: int) -> None:
        self.frozen = epoch
        self._since = tick
        self.need = None
        self._asked.clear()

    def _thaw(self) -> None:
        if self.frozen is not None:
            self._spent.add(self.frozen)
        self.frozen = None
        self.collect = None
        self._search = None
        self._task = None

    def _join_a_call(self, situation: Situation) -> None:
        """Stand for the lowest leader that calls me, giving up a higher one or my own lead."""
        calls = [
            record.collect.epoch
            for robot, record in situation.fresh.items()
            if record.collect is not None and self.me in record.collect.members and record.collect.epoch.leader == robot
        ]
        calls = [epoch for epoch in calls if epoch not in self._spent]
        if not calls:
            return
        lowest = min(calls, key=lambda epoch: (epoch.leader, -epoch.tick))
        if self.frozen is None or (lowest != self.frozen and lowest.leader <= self.frozen.leader):
            self._thaw()
            self._freeze(lowest, situation.tick)

    def _await_plan(self, situation: Situation) -> None:
        """Adopt the plan I stand for, or end standing: too long, or the leader has given it up."""
        epoch = self.frozen
        if epoch is None:
            return
        leader = situation.others.get(epoch.leader)
        if leader is not None and leader.plan is not None and leader.plan.epoch == epoch:
            self._adopt(leader.plan, situation)
            self._thaw()
            return
        calls = situation.fresh.get(epoch.leader)  # a leader that fell silent calls nobody
        called = calls is not None and calls.collect is not None and calls.collect.epoch == epoch
        if not called or situation.tick - self._since > self._settings.freeze:
            self._thaw()

    def _adopt(self, plan: JointPlan, situation: Situation) -> None:
        way = plan.ways.get(self.me)
        if way is None or way[0] != situation.head:
            return
        if shut_joins(way, self.cells):
            self._refuse(plan, way, situation.tick)
            return
        self.plan = plan
        self.epoch = plan.epoch
        self.adopted = situation.tick
        self.way = way
        self._entries = {entry.step: entry for entry in plan.after.get(self.me, ())}

    def _refuse(self, plan: JointPlan, way: Sequence[int], tick: int) -> None:
        """Tell the leader which joins of the plan are shut, those of the own way first."""
        ways = (way, *plan.ways.values())
        shut = tuple(dict.fromkeys(join for one in ways for join in shut_joins(one, self.cells)))
        self._refusal, self._refused_at = Refusal(plan.epoch, shut[:MOST_SHUT]), tick
        text = f"{self.me} refuses the plan of {plan.epoch.leader}: no way from cell {shut[0][0]} to {shut[0][1]}"
        self._news.append(Event("plan_refused", (self.me,), text))

    # ---- leading

    def _lead(self, situation: Situation) -> list[Event]:
        if self._search is None:
            if not self._all_stand(situation):
                return []
            self._begin_to_search(situation, 0)
        search, task = self._search, self._task
        assert search is not None
        assert task is not None
        result = search.advance(max(1, self._settings.robot_openings // max(1, len(task.members))))
        if result is None:
            return []
        moves = result.order is not None and any(len(way) > 1 for way in result.order.ways)
        proven = result.outcome is Outcome.UNSOLVABLE and task.exact
        if not moves and not proven and self._begin_next_attempt(situation, task.attempt + 1):
            return []
        return self._finish(situation, task, result if moves else replace(result, order=None))

    def _all_stand(self, situation: Situation) -> bool:
        assert self.collect is not None
        epoch, members = self.collect
        if situation.tick - self._since >= self._settings.gather:
            return True
        return all(
            robot == self.me or (robot in situation.fresh and situation.fresh[robot].frozen == epoch)
            for robot in members
        )

    def _begin_next_attempt(self, situation: Situation, first: int) -> bool:
        """Begin the first attempt from a number on that asks something new; return False where none is left."""
        return any(self._begin_to_search(situation, number) for number in range(first, len(ATTEMPTS)))

    def _begin_to_search(self, situation: Situation, number: int) -> bool:
        """Put a question to the search; return False where it is the same that an earlier attempt put."""
        assert self.collect is not None
        attempt, epoch = ATTEMPTS[number], self.collect.epoch
        heads, wishes = self._members(situation, epoch)
        in_the_way = situation.bodies | situation.blocked
        in_the_way |= self._strangers(situation, heads) if attempt.strangers else frozenset()
        in_the_way -= set(heads.values())
        idle = {robot for robot, record in situation.fresh.items() if record.idle}
        since = {self.me: situation.moved} | {robot: record.moved for robot, record in situation.fresh.items()}
        idle |= {self.me} if situation.idle else set()
        done = {robot for robot, record in situation.fresh.items() if record.done}
        done |= {self.me} if situation.done else set()
        if attempt.aside is Aside.AWAY:
            idle |= done
        cells = self.cells.without(self._shut)
        goals = assign(cells, heads, wishes, in_the_way, since, done, idle, attempt.aside)
        resting = set() if attempt.everybody else {robot for robot, head in heads.items() if goals[robot] == head}
        members = tuple(sorted(heads.keys() - resting))
        blocked = frozenset(in_the_way | {heads[robot] for robot in resting})
        starts, ends = tuple(heads[robot] for robot in members), tuple(goals[robot] for robot in members)
        question = (members, ends, blocked)
        if not members or (number and question in self._asked_before):
            return False
        self._asked_before = {question} if number == 0 else self._asked_before | {question}
        settings = self._settings
        eager = self._eager(situation, members, ends, wishes, idle)
        self._search = JointSearch(
            [[cell for cell in near if cell not in blocked] for near in cells.neighbours]
            if blocked
            else cells.neighbours,
            [cells.distances(goal, blocked) for goal in ends],
            starts,
            ends,
            budget=Budget(
                settings.starts, settings.expansions // (2 if number else 1), settings.enough // len(members)
            ),
            random=Random(f"{epoch.tick} {epoch.leader}"),
            eager=eager,
        )
        exact = not blocked and not settings.learns
        at_rest = {robot: heads[robot] for robot in sorted(resting)}
        until = tuple(members[index] for index in eager) if number else ()
        self._task = Task(members, starts, ends, number, exact, at_rest, until)
        return True

    def _eager(
        self,
        situation: Situation,
        members: Sequence[str],
        ends: Sequence[int],
        wishes: Mapping[str, int],
        idle: Collection[str],
    ) -> list[int]:
        """Number the members that have to come to their own goals, who has waited longest first.

        Those that have stops left: the others only go back to where they stood.
        """
        told = {robot: (record.done, record.wants, record.held[-1:]) for robot, record in situation.fresh.items()}
        told[self.me] = (situation.done, situation.wants, (situation.head,))
        wanting = [
            (*told[robot][:2], index)
            for index, robot in enumerate(members)
            if robot not in idle and ends[index] == wishes[robot] and told[robot][2] != (ends[index],)
        ]
        return [index for done, _, index in sorted(wanting) if done == min(wanting)[0]]

    def _members(self, situation: Situation, epoch: Epoch) -> tuple[dict[str, int], dict[str, int]]:
        """Return the heads and the goals of all that stand for a plan."""
        heads = {self.me: situation.head}
        wishes = {self.me: situation.goal}
        for robot, record in situation.fresh.items():
            if record.frozen == epoch and record.held and record.held[-1] not in heads.values():
                heads[robot] = record.held[-1]
                wishes[robot] = record.goal
        return heads, wishes

    def _strangers(self, situation: Situation, heads: Mapping[str, int]) -> set[int]:
        """Return the cells of those near the members that take no part."""
        return {
            cell
            for robot, record in situation.others.items()
            if robot not in heads and self._is_among(record, heads.values())
            for cell in (*record.held, *(claim.cell for claim in record.claims))
            if (robot, cell) not in situation.cleared
        }

    def _is_among(self, record: Record, heads: Collection[int]) -> bool:
        """Tell whether somebody who takes no part was last heard so near the members that it must be asleep or dead.

        Who was farther off has gone out of hearing, and on: it is nowhere that could be planned round.
        """
        near = self._settings.radio_range / 2
        return any(distance(self.cells.centre(head), (record.x, record.y)) <= near for head in heads)

    def _finish(self, situation: Situation, task: Task, result: Result) -> list[Event]:
        """Publish the plan, or say that there is none and wait before trying again."""
        assert self.collect is not None
        epoch, tick = self.collect.epoch, situation.tick
        names = task.members
        if result.order is None:
            self._lead_from = tick + self._settings.backoff
            self._thaw()
            return self._report(task, result)
        self.plan = JointPlan(
            epoch=epoch,
            ways=dict(zip(names, result.order.ways, strict=True))
            | {robot: (cell,) for robot, cell in task.at_rest.items()},
            until=(names[result.who[0]],) if result.outcome is Outcome.FOR_ONE else task.until,
            after={
                robot: tuple(Entry(step, names[before.robot], before.place) for step, before in sorted(after.items()))
                for robot, after in zip(names, result.order.after, strict=True)
                if after
            },
        )
        self._published = tick
        self._unconfirmed = self.plan
        self._lead_from = tick + self._settings.again
        self.plans_made += 1
        self._adopt(self.plan, situation)
        self._thaw()
        return [Event("joint_plan", names, f"{self.me} leads {len(names)} robots, {tick - epoch.tick} ticks to plan")]

    def _report(self, task: Task, result: Result) -> list[Event]:
        proven = result.outcome is Outcome.UNSOLVABLE and task.exact
        who = tuple(task.members[index] for index in result.who) if proven else task.members
        if who in self._reported:
            return []
        self._reported.add(who)
        if proven:
            return [Event("unsolvable", who, f"no way exists for {', '.join(who)} to reach their targets together")]
        return [Event("no_plan_found", who, f"no plan found for {', '.join(who)} within the budget")]
