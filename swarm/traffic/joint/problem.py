"""The problems that a leader gives its search: who moves from where to where, and which cells are blocked."""

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from enum import Enum, auto
from random import Random
from typing import Final, NamedTuple

from swarm.geometry import distance
from swarm.messages.traffic import Epoch, Record
from swarm.traffic.joint.goals import FallbackGoal, assign_goals
from swarm.traffic.lattice.cell_map import OUTSIDE, CellMap
from swarm.traffic.lattice.distances import FAR
from swarm.traffic.mapf.planner import Budget, JointSearch
from swarm.traffic.mapf.schedule import CORNER, ON_THE_SPOT
from swarm.traffic.peers.situation import Situation, cells_needed_at_stop
from swarm.traffic.settings import TrafficConstants, is_lane


class AvoidedCells(Enum):
    """The cells of robots that take no part that a plan avoids. Members look into the others before they enter them."""

    HELD = auto()  # all cells that they hold or claim
    BODIES = auto()  # cells that their bodies reached into when they were heard last
    MIDDLES = auto()  # cells that their middles were in then: they may have driven out of the others


class Relaxation(NamedTuple):
    """How a leader relaxes the problem; the next one follows if there is no answer."""

    round: AvoidedCells
    everybody: bool  # robots at their goals move too, if they are in the way
    aside: FallbackGoal
    through: bool = False  # if robots share a target, all go on from their targets to their next ones


RELAXATIONS: Final = (
    Relaxation(AvoidedCells.HELD, True, FallbackGoal.NEAR, through=True),
    Relaxation(AvoidedCells.HELD, True, FallbackGoal.NEAR),
    # a smaller problem: a search for many robots sometimes takes too long
    Relaxation(AvoidedCells.HELD, False, FallbackGoal.NEAR),
    Relaxation(AvoidedCells.BODIES, True, FallbackGoal.NEAR),
    Relaxation(AvoidedCells.HELD, True, FallbackGoal.STAY),
    Relaxation(AvoidedCells.HELD, False, FallbackGoal.STAY),
    Relaxation(AvoidedCells.BODIES, True, FallbackGoal.STAY),
    Relaxation(AvoidedCells.MIDDLES, True, FallbackGoal.NEAR),
)
WHOLE: Final = 2  # the first of them, in which nobody's goal counts less than another's


class Member(NamedTuple):
    """A robot that stands for the plan, as its leader knows it."""

    head: int  # cell
    goal: int  # cell
    idle: bool
    done: bool
    moved: int  # tick of its last progress
    wants: int  # tick since which it has had this goal
    then: int = OUTSIDE  # cell of the target after that one; OUTSIDE: there is none
    docking: tuple[int, ...] = ()  # cells beside its own that it needs at its stop
    radius: float | None = None  # m; None: as wide as its leader
    top: float | None = None  # m/s, the fastest that it drives; None: as fast as its leader


class Problem(NamedTuple):
    """What a leader gives its search, and what it needs to write down the plan."""

    relaxation: int  # which of RELAXATIONS
    members: tuple[str, ...]  # those that move
    starts: tuple[int, ...]
    goals: tuple[int, ...]
    blocked: frozenset[int]
    eager: tuple[int, ...]  # indices of the members that must reach their own goals, the longest waiting first
    exact: bool  # only walls are in the way, and each has its own goal: "unsolvable" is true of the mission
    at_rest: Mapping[str, int]  # robots that stay, and their cells
    until: tuple[str, ...]  # members for which the others make room
    vias: tuple[int, ...] = ()  # the target that each member visits on its way; OUTSIDE: none
    wanting: bool = False  # a member has stops left, and is not at its goal
    frees: bool = False  # a plan leads others out of the cells that a member at its stop needs
    floors: tuple[CellMap, ...] = ()  # how the cells are joined for each member; (): for all as for the leader
    paces: tuple[float, ...] = ()  # times as long as the quickest that each member takes for a cell; (): all alike

    @property
    def is_useful(self) -> bool:
        """True if a plan leads somebody to its goal, over its target or out of another's place; or none needs that."""
        return bool(self.eager or self.vias) or self.frees or not self.wanting

    @property
    def identity(self) -> object:
        """What distinguishes it from other problems."""
        return self.members, self.goals, self.blocked, self.vias

    def search(self, epoch: Epoch, cells: CellMap, settings: TrafficConstants) -> JointSearch:
        """Return a search for the answer."""
        blocked, expansions = self.blocked, settings.expansions // (1 if self.relaxation < WHOLE else 2)
        enough = settings.enough * (2 if self.vias else 1) // len(self.members)  # a way through a target is longer
        own = {id(floor): _joins_without(floor, blocked) for floor in (cells, *self.floors)}
        floors = [own[id(floor)] for floor in self.floors]
        shared, each = own[id(cells)], self.floors or (cells,) * len(self.members)
        if floors:  # the widest member's joins are those that all members have
            shared = own[id(max(self.floors, key=lambda floor: floor.radius))]
        return JointSearch(
            shared,
            [floor.distances(goal, blocked) for floor, goal in zip(each, self.goals, strict=True)],
            self.starts,
            self.goals,
            budget=Budget(settings.starts, expansions, enough),
            random=Random(f"{epoch.tick} {epoch.leader}"),
            eager=self.eager,
            corner=ON_THE_SPOT if is_lane(cells.side, settings.radius) else CORNER,
            vias=[
                floor.distances(via, blocked) if via != OUTSIDE else None
                for floor, via in zip(each[: len(self.vias)], self.vias, strict=True)
            ],
            floors=floors,
            paces=self.paces,
        )


def _joins_without(cells: CellMap, blocked: Collection[int]) -> Sequence[Sequence[int]]:
    """Return the joined cells of each cell, without those that are blocked."""
    if not blocked:
        return cells.neighbours
    return [[cell for cell in near if cell not in blocked] for near in cells.neighbours]


def members_of(epoch: Epoch, me: str, situation: Situation) -> dict[str, Member]:
    """Return all that stand for a plan, ``me`` included; of robots that share a head, only the first."""
    now = situation
    members = {me: Member(now.head, now.goal, now.idle, now.done, now.moved, now.wants, now.then, now.docking)}
    for robot, record in situation.fresh.items():
        heads = [member.head for member in members.values()]
        if record.frozen == epoch and record.held and record.held[-1] not in heads:
            head = record.held[-1]
            members[robot] = Member(
                head, record.goal, record.idle, record.done, record.moved, record.wants, record.then,
                cells_needed_at_stop(record), record.radius, record.top,
            )  # fmt: skip
    return members


def problem_of(
    number: int, everybody: Mapping[str, Member], situation: Situation, cells: CellMap, settings: TrafficConstants
) -> Problem:
    """Return the problem of a relaxation."""
    relaxation = RELAXATIONS[number]
    floors = {robot: _floor_of(member, cells, settings) for robot, member in everybody.items()}
    unlike = any(floor is not cells for floor in floors.values())
    heads = {robot: member.head for robot, member in everybody.items()}
    in_the_way = situation.blocked | _silent_body_cells(situation, relaxation.round, cells)
    if relaxation.round is AvoidedCells.HELD:
        in_the_way |= _outsider_cells(situation, heads, cells, settings)
    in_the_way -= set(heads.values())
    done = {robot for robot, member in everybody.items() if member.done}
    idle = {robot for robot in everybody if everybody[robot].idle} | (
        done if relaxation.aside is FallbackGoal.STAY else set()
    )
    vias = _shared_targets(everybody, in_the_way, floors) if relaxation.through else {}
    wishes = {robot: member.then if robot in vias else member.goal for robot, member in everybody.items()}
    since = {robot: member.moved for robot, member in everybody.items()}
    docks = _dock_cells(everybody)
    goals = assign_goals(cells, heads, wishes, in_the_way, since, done, idle, relaxation.aside, docks, floors)
    # nobody leaves its place for robots that only go back to theirs
    resting = (
        set()
        if relaxation.everybody and done < everybody.keys()
        else {robot for robot, head in heads.items() if goals[robot] == head}
    )
    members = tuple(sorted(heads.keys() - resting))
    ends = tuple(goals[robot] for robot in members)
    blocked = frozenset(in_the_way | {heads[robot] for robot in resting})
    exact = not blocked and not settings.learns and not vias and not unlike
    wanting = {robot: everybody[robot] for robot in members if robot not in idle}
    eager = _members_to_arrive(members, ends, wanting)
    return Problem(
        relaxation=number,
        members=members,
        starts=tuple(heads[robot] for robot in members),
        goals=ends,
        blocked=blocked,
        eager=eager,
        exact=exact,
        at_rest={robot: heads[robot] for robot in sorted(resting)},
        until=() if number < WHOLE else tuple(members[index] for index in eager),
        vias=tuple(vias.get(robot, OUTSIDE) for robot in members) if vias else (),
        wanting=any(one.head != one.goal and not one.done for one in wanting.values()),
        frees=any(heads[robot] in docks and goals[robot] not in docks for robot in members),
        floors=tuple(floors[robot] for robot in members) if unlike else (),
        paces=_paces([everybody[robot].top or settings.top for robot in members]),
    )


def _floor_of(member: Member, cells: CellMap, settings: TrafficConstants) -> CellMap:
    """Return how the leader's ``cells`` are joined for a member."""
    if member.radius is None or member.radius == settings.radius:
        return cells
    return cells.for_radius(cells.radius + member.radius - settings.radius)


def _paces(tops: Sequence[float]) -> tuple[float, ...]:
    """Return how many times as long as the quickest each member takes, by the most [m/s] that it drives."""
    quickest = max(tops, default=0.0)
    return () if all(top == quickest for top in tops) else tuple(quickest / top for top in tops)


def _dock_cells(everybody: Mapping[str, Member]) -> frozenset[int]:
    """Return the cells beside their own that robots need at their stops.

    Where two are in each other's way, they are those of the one that has had its stop for longer.
    """
    kept: set[int] = set()
    cells: set[int] = set()
    for _, member in sorted(everybody.items(), key=lambda one: (one[1].wants, one[0])):
        needs = {member.head, *member.docking}
        if member.docking and member.head not in kept and cells.isdisjoint(needs):
            kept.update(member.docking)
            cells.update(needs)
    return frozenset(kept)


def _shared_targets(
    everybody: Mapping[str, Member], blocked: Collection[int], floors: Mapping[str, CellMap]
) -> dict[str, int]:
    """Return the targets of the robots that can go on from there to their next ones, if any two share a target."""
    wanting = {robot: member for robot, member in everybody.items() if not (member.idle or member.done)}
    shared = Counter(member.goal for member in wanting.values())
    if max(shared.values(), default=0) < 2:
        return {}
    found: dict[str, int] = {}
    for robot, member in wanting.items():
        via, then, cells = member.goal, member.then, floors[robot]
        both_free = 0 <= via < len(cells) and 0 <= then < len(cells) and cells.stands[then] and via not in blocked
        if then != via and both_free:
            steps = cells.distances(via, blocked)
            if steps[member.head] < FAR and steps[then] < FAR:
                found[robot] = via
    return found


def _members_to_arrive(
    members: Collection[str], ends: Collection[int], wanting: Mapping[str, Member]
) -> tuple[int, ...]:
    """Return the indices of the members that must reach their own goals, the longest waiting first.

    If any of them have stops left, only those count: the others only go back to where they stood.
    """
    waiting = sorted(
        (wanting[robot].done, wanting[robot].wants, number)
        for number, (robot, end) in enumerate(zip(members, ends, strict=True))
        if robot in wanting and end == wanting[robot].goal != wanting[robot].head
    )
    return tuple(number for done, _, number in waiting if done == waiting[0][0])


def _silent_body_cells(situation: Situation, round_: AvoidedCells, cells: CellMap) -> frozenset[int]:
    """Return the cells in which bodies of silent robots are likely to be."""
    if round_ is not AvoidedCells.MIDDLES:
        return situation.bodies()
    return situation.bodies() & {cells.cell_of(record.x, record.y) for record in situation.others.values()}


def _outsider_cells(
    situation: Situation, heads: Mapping[str, int], cells: CellMap, settings: TrafficConstants
) -> frozenset[int]:
    """Return the cells of robots that are near the members but take no part."""
    return frozenset(
        cell
        for robot, record in situation.others.items()
        if robot not in heads and _is_near_members(record, heads.values(), cells, settings)
        for cell in (*record.held, *(claim.cell for claim in record.claims))
        if (robot, cell) not in situation.cleared
    )


def _is_near_members(record: Record, heads: Collection[int], cells: CellMap, settings: TrafficConstants) -> bool:
    """Return True if a robot that takes no part was last heard so near the members that it must be asleep or dead.

    A robot that was farther away has driven out of hearing, and its place is not known.
    """
    near = settings.radio_range / 2
    return any(distance(cells.centre(head), (record.x, record.y)) <= near for head in heads)
