"""A robot's part in joint plans: its states, each with its own data, what changes them, and what outlives them."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Final, NamedTuple

from swarm.messages.traffic import Collect, Entry, Epoch, JointPlan, Record, Refusal
from swarm.traffic.joint.problem import Problem
from swarm.traffic.mapf.planner import JointSearch, SearchResult
from swarm.traffic.peers.records import TrafficNote
from swarm.traffic.peers.situation import Situation, cells_needed_at_stop
from swarm.traffic.reservations.route import Join, RouteProgress
from swarm.traffic.settings import TrafficConstants

NEVER: Final = -(10**9)  # tick
SETTLE: Final = 20  # ticks after which a member that shows no sign of the plan is taken not to follow it
NOBODY: Final[Mapping[str, int]] = {}


class Free(NamedTuple):
    """The robot takes part in no call."""

    need: str | None = None  # the robot that it asks to lead
    asked: Mapping[str, int] = NOBODY  # how often it has asked each leader without an answer


class Frozen(NamedTuple):
    """The robot stands still until another robot has made a plan."""

    epoch: Epoch
    since: int  # tick


class Collecting(NamedTuple):
    """The robot leads. It has called the members and waits until they stand."""

    collect: Collect

    @property
    def epoch(self) -> Epoch:
        """The plan to be made."""
        return self.collect.epoch


class Searching(NamedTuple):
    """The robot leads and searches for a plan from where the members stand."""

    collect: Collect
    problem: Problem
    search: JointSearch
    asked: frozenset[object]  # this problem and those before it: none is asked twice
    answer: SearchResult | None = None

    @property
    def epoch(self) -> Epoch:
        """The plan to be made."""
        return self.collect.epoch


Call = Free | Frozen | Collecting | Searching


class FollowedPlan(NamedTuple):
    """The joint plan that a robot follows: whose turn it is, and how long the robot stays in it."""

    me: str
    plan: JointPlan
    members: tuple[str, ...]  # all that take part in it
    adopted: int  # tick
    absent: int  # ticks of silence for which a member keeps its turns
    entries: Mapping[int, Entry]  # by the steps of my way

    @property
    def epoch(self) -> Epoch:
        """The plan's name."""
        return self.plan.epoch

    def keeps(self, progress: RouteProgress, situation: Situation) -> bool:
        """Return True if the robot still has to follow the plan, or to stay where the plan has led it."""
        if progress.route or progress.head == situation.goal:
            return True
        if self.plan.through:
            return False
        if self.makes_room(situation, under_way=len(progress.reservations.held) > 1):
            return True
        if self.first_at(situation.goal, situation.fresh) is not None:
            return True
        # it was sent aside: it makes no room if it turns back before it has left its cells
        return self.is_waited_for(progress.reservations.held[:-1], situation)

    def leads_on(self, progress: RouteProgress, goal: int, told: int) -> bool:
        """Return True if the plan leads on when its robot gets the cell ``goal``, which it has ``told`` as the next."""
        return self.plan.through and bool(progress.route) and goal == told

    def waits_for(self, step: int, situation: Situation) -> str | None:
        """Return the robot that must leave the ``step``-th cell of the way before this one enters it, else None."""
        entry = self.entries.get(step)
        if entry is None:
            return None
        record = situation.others.get(entry.robot)
        if record is None or situation.tick - record.stamp > self.absent:
            return None  # silent or out of reach: the reservations alone decide
        if record.epoch == self.epoch:
            return None if record.left > entry.place else entry.robot
        return entry.robot if self._about_to_follow(record) else None

    def next_after(self, step: int, situation: Situation) -> bool:
        """Return True if the robot waited for is in that very visit now: no other robot can come in between."""
        entry = self.entries[step]
        record = situation.fresh.get(entry.robot)
        return record is not None and record.epoch == self.epoch and record.left <= entry.place <= record.entered

    def first_at(self, cell: int, fresh: Mapping[str, Record]) -> str | None:
        """Return the member with the first turn in a cell: it still follows, and its way ends there, at its goal.

        One that is done and has arrived is not waited for: it never leaves by itself, only by another plan.
        """
        for robot in self.members:
            record = fresh.get(robot) if self.plan.ways[robot][-1] == cell and robot != self.me else None
            if record is None or record.idle or record.goal != cell:
                continue  # it was only sent there, or has been there already: its goal is elsewhere now
            arrived = record.left >= len(self.plan.ways[robot]) - 1
            if record.epoch == self.epoch and ((record.done and arrived) or _rests_at(cell, record)):
                continue
            if record.epoch == self.epoch or self._about_to_follow(record):
                return robot
        return None

    def makes_room(self, situation: Situation, *, under_way: bool) -> bool:
        """Return True if the robot still has to make room for others, in a plan that is for some members only.

        It has to while it is under way itself, or while one of those members has not arrived.
        """
        if not self.plan.until:
            return False
        if under_way:
            return True
        for robot in self.plan.until:
            record = situation.fresh.get(robot) if robot != self.me else None
            if record is None:
                continue
            way = self.plan.ways[robot]
            if record.epoch == self.epoch and record.left < len(way) - 1 and not _rests_at(way[-1], record):
                return True
            if record.epoch != self.epoch and self._about_to_follow(record):
                return True
        return False

    def is_waited_for(self, leaves: Collection[int], situation: Situation) -> bool:
        """Return True if a member has claimed a cell that this robot is about to leave, or needs it at its stop."""
        return any(
            robot in self.plan.ways
            and (
                any(claim.cell in leaves for claim in record.claims)
                or any(cell in leaves for cell in cells_needed_at_stop(record))
            )
            for robot, record in situation.fresh.items()
        )

    def _about_to_follow(self, record: Record) -> bool:
        """Return True if a member may not have adopted the plan yet when it sent this record."""
        if record.epoch is not None and record.epoch > self.epoch:
            return False
        return record.stamp <= self.adopted + SETTLE or record.frozen == self.epoch


def _rests_at(cell: int, record: Record) -> bool:
    """Return True if a robot that is done has come to its cell, or to its place, which may be beside the cell."""
    return record.done and record.held[-1:] == (cell,) and not record.ahead


class BroadcastTurn(NamedTuple):
    """The robot is about to broadcast: what it will tell of its own way shows if a conflict blocks it."""

    robot: str
    held: tuple[int, ...]
    ahead: tuple[int, ...]  # the next cells of its way
    waits: tuple[str, ...]  # robots that it waits for
    epoch: Epoch | None  # of the joint plan followed
    moved: int  # tick of its last progress
    situation: Situation


class PlanningStop(NamedTuple):
    """The robot was told to stop, or the floor has changed: it takes part in no call and follows no plan."""


class WakeUp(NamedTuple):
    """The robot has just started, or was away."""

    tick: int


class PlanArrival(NamedTuple):
    """The robot gets a plan."""

    plan: JointPlan
    situation: Situation


class PlanDrop(NamedTuple):
    """The plan has led the robot where it could, or the robot wants to be elsewhere, or a body shuts the way."""


class TransitionResult(NamedTuple):
    """The result of a transition."""

    to: Call | FollowedPlan | None
    plan: JointPlan | None = None  # to be adopted
    events: tuple[TrafficNote, ...] = ()


class PublishedPlan(NamedTuple):
    """A plan that this robot made, and when."""

    plan: JointPlan
    tick: int


class PlanRefusal(NamedTuple):
    """A plan that this robot could not follow, and when it came."""

    refusal: Refusal
    tick: int


@dataclass
class PlanningMemory:
    """What a robot needs for joint plans, and what it remembers from one call to the next."""

    me: str
    settings: TrafficConstants
    asks_from: int = NEVER  # tick; a robot that has just adopted a plan asks for no other
    leads_from: int = NEVER  # tick
    gather: int = field(init=False)  # ticks for which its next call waits for the members
    passed_over: dict[str, int] = field(default_factory=dict)  # silent leaders, and until when they are out [tick]
    spent: dict[str, int] = field(default_factory=dict)  # tick of the last call of each leader that the robot has left
    published: PublishedPlan | None = None  # the newest plan it made, until it adopts another robot's
    unconfirmed: PublishedPlan | None = None  # the newest plan it made, until it has checked who follows it
    refused: PlanRefusal | None = None  # the newest plan it refused
    shut: dict[Join, int] = field(default_factory=dict)  # refused joins, and until when they count as shut [tick]
    reported: set[tuple[str, ...]] = field(default_factory=set)  # groups for which no plan was found within the budget

    def __post_init__(self) -> None:
        self.gather = self.settings.gather
