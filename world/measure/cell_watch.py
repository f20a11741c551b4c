"""A checker that sees every robot and shares nothing with their planners: do holds overlap, do bodies stay in them?"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice
from math import hypot
from typing import Final, NamedTuple

from swarm.geometry import Pose
from swarm.traffic.lattice.cell_map import OUTSIDE, CellMap
from swarm.traffic.peers.records import TrafficNote

STUCK: Final = 10.0  # s for which robots stand in a circle of waits before it counts as a deadlock
NUMERIC: Final = 1e-6  # m, what rounding may add to a body's radius


class Watched(NamedTuple):
    """One robot at one tick."""

    pose: Pose
    held: Sequence[int]  # cells that it says it holds
    wants_to_move: bool  # it has a way and is not at its end
    moved: bool  # it made progress since the last tick
    waits: Sequence[str] = ()  # the robots that it waits for
    live: bool = True  # its process runs; False: killed or suspended
    mute: bool = False  # it says nothing of traffic, and holds nothing


Found = tuple[str, tuple[str, ...], tuple[int, ...]]  # kind, robots, cells


class Fault(NamedTuple):
    """A violation, when it began."""

    tick: int
    kind: str  # "overlap", "outside", "contact", "intrusion"
    robots: tuple[str, ...]
    where: tuple[int, ...]  # cells


class WatchState(NamedTuple):
    """The state of `Watch`."""

    faults: list[Fault]
    conflicts: int
    joint_plans: int
    deadlocks: int
    longest_wait: float
    waiting: dict[str, float]
    least_gap: float
    running: set[tuple[str, tuple[str, ...]]]
    still: dict[str, int]
    waits: dict[str, Sequence[str]]
    circling: dict[str, int]
    stuck: set[str]
    held: dict[str, set[int]]
    under: dict[str, set[int]]
    intruders: dict[tuple[str, str], bool]


@dataclass
class Watch:
    """The faults as they begin, and the counts for the report; it is fed every tick."""

    cells: CellMap
    radius: float  # m
    tick: float  # s
    faults: list[Fault] = field(default_factory=list)
    conflicts: int = 0  # times a robot began to wait for another
    joint_plans: int = 0
    deadlocks: int = 0  # times robots that stood waited for each other in a circle for 10 s
    longest_wait: float = 0.0  # s
    waiting: dict[str, float] = field(default_factory=dict)  # s, of each robot, total
    least_gap: float = float("inf")  # m, between two bodies
    _running: set[tuple[str, tuple[str, ...]]] = field(default_factory=set)
    _still: dict[str, int] = field(default_factory=dict)  # ticks since its last progress, while it wants to move
    _waits: dict[str, Sequence[str]] = field(default_factory=dict)
    _circling: dict[str, int] = field(default_factory=dict)  # ticks in a circle of waits among robots that stand
    _stuck: set[str] = field(default_factory=set)
    _held: dict[str, set[int]] = field(default_factory=dict)  # what each held a tick ago
    _under: dict[str, set[int]] = field(default_factory=dict)  # cells that each mute robot was in a tick ago
    _intruders: dict[tuple[str, str], bool] = field(default_factory=dict)  # (mute, holder): the mute one drove in

    def look(self, tick: int, robots: Mapping[str, Watched], events: Iterable[TrafficNote] = ()) -> list[Fault]:
        """Check one tick; return the faults that begin in it."""
        mutes = {robot: seen for robot, seen in robots.items() if seen.mute}
        robots = {robot: seen for robot, seen in robots.items() if not seen.mute} if mutes else robots
        now = [*self._overlaps(robots), *self._outside(robots), *self._contacts(robots)]
        if mutes or self._under:
            now += self._intrusions(mutes, robots)
        begun = [Fault(tick, *what) for what in now if what[:2] not in self._running]
        self._running = {what[:2] for what in now}
        self.faults += begun
        self.joint_plans += sum(event.kind == "joint_plan" for event in events)
        self._count_waits(robots)
        return begun

    @property
    def state(self) -> WatchState:
        """The state, which shares its values with this object."""
        return WatchState(
            self.faults, self.conflicts, self.joint_plans, self.deadlocks, self.longest_wait, self.waiting,
            self.least_gap, self._running, self._still, self._waits, self._circling, self._stuck, self._held,
            self._under, self._intruders,
        )  # fmt: skip

    def restore(self, state: WatchState) -> None:
        """Continue from a state."""
        (
            self.faults, self.conflicts, self.joint_plans, self.deadlocks, self.longest_wait, self.waiting,
            self.least_gap, self._running, self._still, self._waits, self._circling, self._stuck, self._held,
            self._under, self._intruders,
        ) = state  # fmt: skip

    def count(self, kind: str, *, of: Collection[str] | None = None) -> int:
        """Return the number of faults of a kind in which only robots of ``of`` took part; None: all of the kind."""
        return sum(fault.kind == kind and (of is None or set(fault.robots) <= set(of)) for fault in self.faults)

    @property
    def in_circle(self) -> bool:
        """Return True while a deadlock that has been counted lasts."""
        return bool(self._stuck)

    def _overlaps(self, robots: Mapping[str, Watched]) -> list[Found]:
        owner: dict[int, str] = {}
        owners: dict[int, set[str]] = {}  # of cells that several robots hold
        for robot, seen in robots.items():
            for cell in seen.held:
                first = owner.setdefault(cell, robot)
                if first != robot:
                    owners.setdefault(cell, {first}).add(robot)
        shared: dict[tuple[str, ...], list[int]] = {}
        for cell, names in sorted(owners.items()):
            shared.setdefault(tuple(sorted(names)), []).append(cell)
        return [("overlap", names, tuple(where)) for names, where in shared.items()]

    def _outside(self, robots: Mapping[str, Watched]) -> list[Found]:
        found: list[Found] = []
        for robot, seen in robots.items():
            touched = self.cells.touched(seen.pose.x, seen.pose.y, self.radius - NUMERIC)
            strayed = tuple(cell for cell in touched if cell not in seen.held)
            if strayed:
                found.append(("outside", (robot,), strayed))
        return found

    def _intrusions(self, mutes: Mapping[str, Watched], robots: Mapping[str, Watched]) -> list[Found]:
        """Compare where mute robots are with what others hold.

        An "intrusion" is a mute robot that drove into a cell that another robot held, or began in it. It is an
        "overlap" of the two if the other took the cell after the mute robot was in it.
        """
        under = {
            robot: set(self.cells.touched(seen.pose.x, seen.pose.y, self.radius - NUMERIC)) - {OUTSIDE}
            for robot, seen in mutes.items()
        }
        found: list[Found] = []
        intruders: dict[tuple[str, str], bool] = {}
        for robot, cells in under.items():
            for other, seen in robots.items():
                shared = cells.intersection(seen.held)
                if not shared:
                    continue
                was = self._under.get(robot, cells)
                taken = shared & was - self._held.get(other, set(seen.held))
                drove_in = self._intruders.get((robot, other), not taken)
                intruders[robot, other] = drove_in
                names = (robot, other) if drove_in else (other, robot)
                found.append(("intrusion" if drove_in else "overlap", names, tuple(sorted(shared))))
        self._intruders, self._under = intruders, under
        self._held = {robot: set(seen.held) for robot, seen in robots.items()} if mutes else {}
        return found

    def _contacts(self, robots: Mapping[str, Watched]) -> list[Found]:
        found: list[Found] = []
        width = 2 * self.radius
        places = sorted((seen.pose.x, seen.pose.y, robot) for robot, seen in robots.items())
        for number, (ax, ay, one) in enumerate(places):
            for bx, by, other in islice(places, number + 1, None):
                if bx - ax - width >= max(0.0, self.least_gap):
                    break  # the rest is farther off still
                gap = hypot(ax - bx, ay - by) - width
                if gap < self.least_gap:
                    self.least_gap = gap
                if gap < 0:
                    pair = min(one, other), max(one, other)
                    x, y, _ = robots[pair[0]].pose
                    found.append(("contact", pair, (self.cells.cell_of(x, y),)))
        return sorted(found)

    def _count_waits(self, robots: Mapping[str, Watched]) -> None:
        for robot, seen in robots.items():
            held_up = seen.wants_to_move and bool(seen.waits)
            self.conflicts += held_up and not self._waits.get(robot)
            self._waits[robot] = seen.waits if held_up else ()
            if held_up:
                self.waiting[robot] = self.waiting.get(robot, 0.0) + self.tick
            ticks = 0 if seen.moved or not seen.wants_to_move else self._still.get(robot, 0) + 1
            self._still[robot] = ticks
            self.longest_wait = max(self.longest_wait, ticks * self.tick)
        still = {robot for robot in robots if self._still[robot] * self.tick >= STUCK}
        circling = {robot for robot in still if self._circles_back(robot, still)}
        self._circling = {robot: self._circling.get(robot, 0) + 1 for robot in circling}
        stuck = {robot for robot, ticks in self._circling.items() if ticks * self.tick >= STUCK}
        self.deadlocks += bool(stuck - self._stuck)
        self._stuck = stuck

    def _circles_back(self, robot: str, still_long: Collection[str]) -> bool:
        """Return True if the waits among robots that stand lead from ``robot`` back to it."""
        seen: set[str] = set()
        front = list(self._waits.get(robot, ()))
        while front:
            other = front.pop()
            if other == robot:
                return True
            if other not in seen and other in still_long:
                seen.add(other)
                front.extend(self._waits.get(other, ()))
        return False
