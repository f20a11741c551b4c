"""The call for a joint plan that a robot takes part in: its states, each with its own data, and what outlives them."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Final, NamedTuple

from swarm.messages.traffic import Collect, Epoch, JointPlan, Refusal
from swarm.traffic.joint.problem import Problem
from swarm.traffic.mapf.planner import JointSearch, Result
from swarm.traffic.peers.records import TrafficNote
from swarm.traffic.peers.situation import Situation
from swarm.traffic.reservations.route import Join
from swarm.traffic.settings import TrafficConstants

NEVER: Final = -(10**9)  # tick
NOBODY: Final[Mapping[str, int]] = MappingProxyType({})


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
    answer: Result | None = None

    @property
    def epoch(self) -> Epoch:
        """The plan to be made."""
        return self.collect.epoch


Call = Free | Frozen | Collecting | Searching


class Speaks(NamedTuple):
    """The robot is about to broadcast: what it will tell of its own way shows if a conflict blocks it."""

    robot: str
    held: tuple[int, ...]
    ahead: tuple[int, ...]  # the next cells of its way
    waits: tuple[str, ...]  # robots that it waits for
    epoch: Epoch | None  # of the joint plan followed
    moved: int  # tick of its last progress
    situation: Situation


class Leaves(NamedTuple):
    """The robot was told to stop, or the floor has changed: it takes part in no call."""


class Wakes(NamedTuple):
    """The robot has just started, or was away."""

    tick: int


class Move(NamedTuple):
    """The result of a transition."""

    to: Call
    plan: JointPlan | None = None  # to be adopted
    events: tuple[TrafficNote, ...] = ()


class Published(NamedTuple):
    """A plan that this robot made, and when."""

    plan: JointPlan
    tick: int


class Refused(NamedTuple):
    """A plan that this robot could not follow, and when it came."""

    refusal: Refusal
    tick: int


@dataclass
class Memory:
    """What a robot needs for joint plans, and what it remembers from one call to the next."""

    me: str
    settings: TrafficConstants
    asks_from: int = NEVER  # tick; a robot that has just adopted a plan asks for no other
    leads_from: int = NEVER  # tick
    gather: int = field(init=False)  # ticks for which its next call waits for the members
    passed_over: dict[str, int] = field(default_factory=dict)  # silent leaders, and until when they are out [tick]
    spent: dict[str, int] = field(default_factory=dict)  # tick of the last call of each leader that the robot has left
    published: Published | None = None  # the newest plan it made, until it adopts another robot's
    unconfirmed: Published | None = None  # the newest plan it made, until it has checked who follows it
    refused: Refused | None = None  # the newest plan it refused
    shut: dict[Join, int] = field(default_factory=dict)  # refused joins, and until when they count as shut [tick]
    reported: set[tuple[str, ...]] = field(default_factory=set)  # groups for which no plan was found within the budget

    def __post_init__(self) -> None:
        self.gather = self.settings.gather
