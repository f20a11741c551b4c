"""The search for a good joint plan, spread over many calls: LaCAM from several starts, the quickest plan improved.

If no plan is found soon, each pair of robots is tried alone. If two robots cannot both arrive even with nobody else
there, there is no plan. This proof takes moments; a search over all robots would try everything that the others can do
meanwhile. If no plan for all is found, one robot is brought to its goal while the others only make room; only if that
is impossible for the one asked about is it proven that there is no plan. One robot is also brought to its goal alone
where a plan for all would take longer than one such plan after the other: many robots on few cells move for minutes
until all stand at their goals at once.

Straight and random ties take turns: turning on the spot costs a wheeled robot more than a step, but always going
straight jams narrow places. A plan is judged by when its last robot arrives, if each robot goes as soon as the order of
entries lets it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from itertools import combinations
from random import Random
from typing import Final

from swarm.traffic.mapf.best_first import BestFirst
from swarm.traffic.mapf.lacam import LacamSearch, SearchState, Steps, Vias, remove_detours
from swarm.traffic.mapf.lns import PlanImprover
from swarm.traffic.mapf.one_robot import OneRobot
from swarm.traffic.mapf.pibt import Configuration, Floors, Joined, Tables, TieBreak
from swarm.traffic.mapf.precedence import Precedence, order_of
from swarm.traffic.mapf.schedule import CORNER, Schedule, schedule_plan

PATIENCE: Final = 4  # once there is a plan, a restart may cost this many times its expansions: more is rarely better
TURNS: Final = (TieBreak.STRAIGHT, TieBreak.RANDOM)  # the ties of the starts, in turn (docs/decisions/0033-ties.md)
EXTRA: Final = 30  # expansions that any start may cost, beyond its share
LATE: Final = 4  # starts without a plan, after which each pair is tried alone
PAIR: Final = 2_000  # expansions for one pair at most
CHANGE: Final = 20  # expansions of one robot that take as long as a change of a plan
POPS: Final = 10  # expansions in improving that take as long as one expansion of one robot
FRUITLESS: Final = 100  # changes in a row that make the plan no quicker, after which improving ends
THROUGH: Final = 5  # times as many where ways lead through vias: such plans are longer
QUEUE: Final = 4  # expansions for each robot that a start may cost besides, where robots queue at vias
LONG: Final = 3  # times the longest way: a plan that takes longer is compared with one robot after the other
NEXT: Final = 2.0  # steps that the robots stand until the plan for the next robot is made
BEST_FIRST: Final = 10_000  # expansions for one question to the search that moves one robot at a time


Plan = tuple[tuple[float, float], Schedule]  # how it is judged, and the plan


class SearchOutcome(Enum):
    """The outcome of a search: a plan in the first two cases, a proof in the third."""

    SOLVED = "solved"
    FOR_ONE = "solved for one"  # one robot arrives, the others only make room
    UNSOLVABLE = "unsolvable"
    NOT_FOUND = "no plan found"


@dataclass(frozen=True, slots=True)
class Budget:
    """The limits of a search, in expansions of configurations."""

    starts: int = 4  # searches from scratch; the quickest plan is kept
    expansions: int = 20_000  # in all
    enough: int = 20_000  # once there is a plan: no further start after so many; improving may cost as many again


@dataclass(frozen=True, slots=True)
class SearchResult:
    """A finished search."""

    outcome: SearchOutcome
    steps: Steps  # when solved
    order: Precedence | None
    who: tuple[int, ...] = ()  # unsolvable: robots that cannot all arrive in any case; solved for one: that one
    expansions: int = 0


class JointSearch:
    """A search for a joint plan, to be advanced a little in each control step until ``result`` is set.

    ``eager`` are the robots that still have to reach their goals, the longest waiting first; the others only have to
    stand somewhere. None: all robots that are not at their goals. ``vias`` are the steps of each robot to a cell that
    it visits on its way; None: it visits none. Several robots may visit one cell. Such a search proves nothing: it ends
    with a plan or without. ``corner`` are the steps for a cell in which a way turns.

    Where robots are unlike each other, ``floors`` are the cells that are joined for each, and ``neighbours`` those that
    are for all; ``paces`` say how many times as long as the quickest each takes for a cell. Such a search proves
    nothing of one robot: the others are not alike, and it lets them move only where all can.

    Raises:
        ValueError: Two robots have the same start or the same goal.
    """

    def __init__(
        self,
        neighbours: Joined,
        tables: Tables,
        starts: Configuration,
        goals: Configuration,
        *,
        budget: Budget,
        random: Random,
        eager: Sequence[int] | None = None,
        vias: Vias = (),
        corner: float = CORNER,
        floors: Floors = (),
        paces: Sequence[float] = (),
    ) -> None:
        if len(set(starts)) < len(starts) or len(set(goals)) < len(goals):
            raise ValueError(f"two robots in one cell: starts {starts}, goals {goals}")
        self.result: SearchResult | None = None
        self._problem = (neighbours, tables, starts, goals)
        self._budget = budget
        self._random = random
        self._spent = 0
        self._begun = 0
        self._search: LacamSearch | None = None
        self._corner, self._paces = corner, paces
        self._floors = floors if any(floor is not neighbours for floor in floors) else ()
        self._vias = vias if any(via is not None for via in vias) else ()
        self._visits = [-1 if via is None else via.index(0) for via in self._vias]  # cell that each robot visits
        self._pairs = [] if self._vias or self._floors else list(combinations(range(len(starts)), 2))[::-1]
        self._best: Plan | None = None
        self._improver: PlanImprover | None = None
        self._improving = 0  # expansions that changes of the plan have cost
        self._fruitless = 0  # changes since the plan last became quicker
        self._least = 0  # expansions of the cheapest plan so far
        self._best_first: BestFirst | OneRobot | None = None
        self._in_turn: list[Plan] = []  # for each robot asked about: the plan that brings it alone to its goal
        self._alone: OneRobot | None = None  # the search for the next of them
        away = [robot for robot, (start, goal) in enumerate(zip(starts, goals, strict=True)) if start != goal]
        self._eager = tuple(away if eager is None else eager)
        self._questions = [] if self._vias else [tuple(range(len(starts))), *((robot,) for robot in self._eager)]
        self._together = True  # False once it is proven that they cannot all be at their goals at once
        ways = [table[start] for table, start in zip(tables, starts, strict=True)]
        for robot, via in enumerate(self._vias):
            ways[robot] = ways[robot] if via is None else via[starts[robot]] + via[goals[robot]]
        self._longest = max(ways, default=0)

    def advance(self, expansions: int) -> SearchResult | None:
        """Spend at most ``expansions``; return the result once there is one."""
        while self.result is None and expansions > 0:
            if self._best is not None and (self._is_satisfied or self._is_exhausted):
                expansions -= self._improve(self._best, expansions)
                continue
            if self._best is None and self._begun > LATE and self._pairs:
                expansions -= self._try_a_pair()
                continue
            all_asked = len(self._questions) <= len(self._eager)
            if self._best is None and self._questions and self._begun > LATE and (not all_asked or self._is_exhausted):
                expansions -= self._try_best_first(expansions)
                continue
            search = self._search or self._begin_search()
            if search is None:
                break
            before = search.expansions
            state = search.advance(min(expansions, self._allowance(search)))
            spent = max(1, search.expansions - before)
            expansions -= spent
            self._spent += spent
            if state is SearchState.SOLVED:
                self._keep_solution(search)
            elif state is SearchState.UNSOLVABLE:
                self._together, self._search, self._begun = False, None, LATE + 1
            elif self._allowance(search) <= 0:
                self._search = None
        return self.result

    def _allowance(self, search: LacamSearch) -> int:
        """Return how many expansions this start may still cost: short tries first, twice as many every fourth time.

        Depth-first search sometimes takes very long. A restart with other random choices is then cheaper than going on.
        """
        left = self._budget.expansions - self._spent
        if self._best is not None:
            return min(left, PATIENCE * self._least + EXTRA - search.expansions)
        doubled = min((self._begun - 1) // 4, 20)
        share = 2 * self._longest + EXTRA + QUEUE * len(self._vias)
        return min(left, (share << doubled) - search.expansions)

    def _try_a_pair(self) -> int:
        """Check if each of two robots could arrive with nobody else there; return the cost in expansions of all."""
        neighbours, tables, starts, _ = self._problem
        pair = self._pairs.pop()
        spent = 0
        for number, robot in enumerate(pair):
            if robot not in self._eager:
                continue
            search = OneRobot(neighbours, tables[robot], tuple(starts[r] for r in pair), number)
            if search.advance(PAIR) is SearchState.UNSOLVABLE:
                self._finish(SearchOutcome.UNSOLVABLE, pair)
            spent += search.expansions
        return 1 + 2 * spent // len(starts)

    def _try_best_first(self, expansions: int) -> int:
        """Search for any plan at all, one robot moving at a time; return what it cost in expansions.

        The first question is a plan in which all arrive. The next is a plan in which the robot that has waited longest
        arrives, and so on.
        """
        neighbours, tables, starts, _ = self._problem
        eager = self._questions[0]
        search = self._best_first or (
            BestFirst(neighbours, tables, starts, self._floors)
            if len(eager) == len(starts)
            else OneRobot(neighbours, tables[eager[0]], starts, eager[0])
        )
        self._best_first = search
        before = search.expansions
        state = search.advance(expansions)
        if state is SearchState.SOLVED:
            self._keep_if_quicker(search.steps, max(1, search.expansions // len(starts)))
            if len(eager) < len(starts):
                self._finish(SearchOutcome.FOR_ONE, eager)
        elif state is SearchState.UNSOLVABLE and len(eager) == 1 and not self._floors:
            self._finish(SearchOutcome.UNSOLVABLE, tuple(range(len(starts))))
        if state is not SearchState.RUNNING or search.expansions == before or search.expansions >= BEST_FIRST:
            self._together = self._together and not (state is SearchState.UNSOLVABLE and len(eager) == len(starts))
            self._questions = self._questions[1:]
            self._best_first = None
        return max(1, search.expansions - before)

    def _begin_search(self) -> LacamSearch | None:
        neighbours, tables, starts, goals = self._problem
        if self._is_exhausted or (self._vias and self._best is None and self._begun > 2 * LATE):
            self._finish(SearchOutcome.NOT_FOUND)
            return None
        ties, near_first = TURNS[self._begun % len(TURNS)], bool(self._vias) and self._begun % 2 == 0
        self._search = LacamSearch(
            neighbours, tables, starts, goals, ties=ties, random=self._random, vias=self._vias, near_first=near_first,
            floors=self._floors,
        )  # fmt: skip
        self._begun += 1
        return self._search

    @property
    def _is_exhausted(self) -> bool:
        """True if a search for all goals at once cannot find anything more."""
        return self._spent >= self._budget.expansions or not self._together

    @property
    def _is_satisfied(self) -> bool:
        return self._begun >= self._budget.starts or self._spent >= self._budget.enough

    def _keep_solution(self, search: LacamSearch) -> None:
        self._keep_if_quicker(search.steps, search.expansions)

    def _keep_if_quicker(self, found: Steps, expansions: int) -> None:
        """Keep a plan if it is the quickest so far."""
        plan = schedule_plan(remove_detours(found, self._visits), self._corner, self._paces)
        judged = self._plan_cost(plan)
        self._least = expansions if self._best is None else min(self._least, expansions)
        if self._best is None or judged < self._best[0]:
            self._best = (judged, plan)
        self._search = None

    def _plan_cost(self, plan: Schedule) -> tuple[float, float]:
        """Return what counts of a plan: its last arrival, then all; where robots queue, the mean one counts as well."""
        mean = plan.total / len(plan.ways) if self._vias else 0.0
        return plan.last + mean, plan.total

    def _improve(self, best: Plan, expansions: int) -> int:
        """Change the plan a little, and keep what is no slower; return the cost in expansions of all robots.

        When nothing makes it quicker any more, the plan is compared with one robot after the other.
        """
        neighbours, tables, starts, _ = self._problem
        fruitless = FRUITLESS * (THROUGH if self._vias else 1)
        if len(starts) == 1 or self._fruitless >= fruitless or self._improving >= self._budget.enough:
            return self._compare_with_one_by_one(best, expansions)
        self._fruitless += 1
        improving = self._improver = self._improver or PlanImprover(
            neighbours, tables, self._random, self._vias, self._floors
        )
        before = improving.pops
        plan = improving.replan_robots(best[1])
        if plan is not None:
            judged = self._plan_cost(plan)
            if judged < best[0]:
                self._fruitless = 0
            if judged <= best[0]:
                self._best = (judged, plan)
        spent = 1 + (CHANGE + (improving.pops - before) // POPS) // len(starts)
        self._improving += spent
        return spent

    def _compare_with_one_by_one(self, best: Plan, expansions: int) -> int:
        """Take the plan for all, or that for the first robot if one after the other is quicker; return the cost."""
        neighbours, tables, starts, _ = self._problem
        one_by_one = sum(arrival + NEXT for (arrival, _), _ in self._in_turn)
        if self._vias or best[0][0] <= LONG * self._longest or one_by_one >= best[0][0] or not self._eager:
            self._finish(SearchOutcome.SOLVED)
            return 0
        if len(self._in_turn) == len(self._eager):
            self._best = self._in_turn[0]
            self._finish(SearchOutcome.FOR_ONE, self._eager[:1])
            return 0
        robot = self._eager[len(self._in_turn)]
        search = self._alone = self._alone or OneRobot(neighbours, tables[robot], starts, robot)
        before = search.expansions
        state = search.advance(expansions)
        if state is SearchState.SOLVED:
            plan = schedule_plan(remove_detours(search.steps), self._corner, self._paces)
            self._in_turn.append((self._plan_cost(plan), plan))
            self._alone = None
        elif state is SearchState.UNSOLVABLE or search.expansions >= PAIR or search.expansions == before:
            self._finish(SearchOutcome.SOLVED)
        return max(1, search.expansions - before)

    def _finish(self, outcome: SearchOutcome, who: tuple[int, ...] = ()) -> None:
        steps = self._best[1].steps() if self._best else []
        self.result = SearchResult(outcome, steps, order_of(steps) if steps else None, who, self._spent)
