"""A checker that sees every robot and shares nothing with their planners: do holds overlap, do bodies stay in them?"""

from collections.abc import Collection, Mapping, Sequence
from itertools import islice
from math import hypot
from typing import Final, NamedTuple

from swarm.geometry import Pose
from swarm.messages import Activity, Command
from swarm.traffic.lattice.cell_map import OUTSIDE, CellMap
from world.bodies.roster import Roster
from world.measure.state import ReservationFault, TrafficState, WatchState
from world.measure.steering import IDLE

STUCK: Final = 10.0  # s for which robots stand in a circle of waits before it counts as a deadlock
NUMERIC: Final = 1e-6  # m, what rounding may add to a body's radius


class Watched(NamedTuple):
    """One robot at one tick."""

    pose: Pose
    held: Sequence[int]  # cells that it says it holds
    wants_to_move: bool  # it has a way and is not at its end
    moved: bool  # it made progress since the last tick
    waits: Sequence[str] = ()  # the robots that it waits for
    mute: bool = False  # it says nothing of traffic, and holds nothing
    radius: float = 0.2  # m


Found = tuple[str, tuple[str, ...], tuple[int, ...]]  # kind, robots, cells


class TrafficWatch:
    """The faults as they begin, and the counts for the report, from true poses and the cells that robots declare."""

    def __init__(self, cells: CellMap, roster: Roster, tick: float) -> None:
        """Begin with the robots of the ``roster`` and the length of a ``tick`` [s]."""
        self.cells, self.tick = cells, tick
        self._roster = roster
        self.state = TrafficState(poses=(), watch=WatchState())

    def add_robot(self, start: Pose) -> None:
        """Judge one more robot from now on; it is in the roster already."""
        self.state.poses = [*self.state.poses, start] if self.state.poses else ()

    def look(
        self, tick: int, poses: Sequence[Pose], fresh: Mapping[str, Command], last: Sequence[Command]
    ) -> list[ReservationFault]:
        """Return the faults of a tick, judged from all poses, the ``fresh`` commands and each robot's last command."""
        before, self.state.poses = self.state.poses or poses, poses
        radii = self._roster.radii_to_hold(tick)
        robots, plans = dict[str, Watched](), 0
        for number, name in enumerate(self._roster.names):
            command = last[number]
            if not command.held and command.activity is Activity.READY:
                continue  # the robot has not sent a command yet
            wants = command.activity not in IDLE
            moved = poses[number] != before[number]
            robots[name] = Watched(
                poses[number],
                command.held,
                wants,
                moved,
                command.waits,
                not command.held,
                radii[number],
            )
            plans += sum(kind == "joint_plan" for kind, _ in command.notes) if name in fresh else 0
        self.state.watch.joint_plans += plans
        return self.judge(tick, robots)

    def judge(self, tick: int, robots: Mapping[str, Watched]) -> list[ReservationFault]:
        """Check one tick; return the faults that begin in it."""
        state = self.state.watch
        mutes = {robot: seen for robot, seen in robots.items() if seen.mute}
        robots = {robot: seen for robot, seen in robots.items() if not seen.mute} if mutes else robots
        now = [*self._overlaps(robots), *self._outside(robots), *self._contacts(robots)]
        if mutes or state.under:
            now += self._intrusions(mutes, robots)
        begun = [ReservationFault(tick, *what) for what in now if what[:2] not in state.running]
        state.running = {what[:2] for what in now}
        state.faults += begun
        self._count_waits(robots)
        return begun

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
            touched = self.cells.cells_under_disc(seen.pose.x, seen.pose.y, seen.radius - NUMERIC)
            strayed = tuple(cell for cell in touched if cell not in seen.held)
            if strayed:
                found.append(("outside", (robot,), strayed))
        return found

    def _intrusions(self, mutes: Mapping[str, Watched], robots: Mapping[str, Watched]) -> list[Found]:
        """Compare where mute robots are with what others hold.

        An "intrusion" is a mute robot that drove into a cell that another robot held, or began in it. It is an
        "overlap" of the two if the other took the cell after the mute robot was in it.
        """
        state = self.state.watch
        under = {
            robot: set(self.cells.cells_under_disc(seen.pose.x, seen.pose.y, seen.radius - NUMERIC)) - {OUTSIDE}
            for robot, seen in mutes.items()
        }
        found: list[Found] = []
        intruders: dict[tuple[str, str], bool] = {}
        for robot, cells in under.items():
            for other, seen in robots.items():
                shared = cells.intersection(seen.held)
                if not shared:
                    continue
                was = state.under.get(robot, cells)
                taken = shared & was - state.held.get(other, set(seen.held))
                drove_in = state.intruders.get((robot, other), not taken)
                intruders[robot, other] = drove_in
                names = (robot, other) if drove_in else (other, robot)
                found.append(("intrusion" if drove_in else "overlap", names, tuple(sorted(shared))))
        state.intruders, state.under = intruders, under
        state.held = {robot: set(seen.held) for robot, seen in robots.items()} if mutes else {}
        return found

    def _contacts(self, robots: Mapping[str, Watched]) -> list[Found]:
        found: list[Found] = []
        state, widest = self.state.watch, 2 * max([seen.radius for seen in robots.values()], default=0.0)
        places = sorted((seen.pose.x, seen.pose.y, robot) for robot, seen in robots.items())
        for number, (ax, ay, one) in enumerate(places):
            for bx, by, other in islice(places, number + 1, None):
                if bx - ax - widest >= max(0.0, state.least_gap):
                    break  # the rest is farther off still
                gap = hypot(ax - bx, ay - by) - (robots[one].radius + robots[other].radius)
                if gap < state.least_gap:
                    state.least_gap = gap
                if gap < 0:
                    pair = min(one, other), max(one, other)
                    x, y, _ = robots[pair[0]].pose
                    found.append(("contact", pair, (self.cells.cell_of(x, y),)))
        return sorted(found)

    def _count_waits(self, robots: Mapping[str, Watched]) -> None:
        state = self.state.watch
        for robot, seen in robots.items():
            held_up = seen.wants_to_move and bool(seen.waits)
            state.conflicts += held_up and not state.waits.get(robot)
            state.waits[robot] = seen.waits if held_up else ()
            if held_up:
                state.waiting[robot] = state.waiting.get(robot, 0.0) + self.tick
            ticks = 0 if seen.moved or not seen.wants_to_move else state.still.get(robot, 0) + 1
            state.still[robot] = ticks
            state.longest_wait = max(state.longest_wait, ticks * self.tick)
        still = {robot for robot in robots if state.still[robot] * self.tick >= STUCK}
        circling = {robot for robot in still if self._circles_back(robot, still)}
        state.circling = {robot: state.circling.get(robot, 0) + 1 for robot in circling}
        stuck = {robot for robot, ticks in state.circling.items() if ticks * self.tick >= STUCK}
        state.deadlocks += bool(stuck - state.stuck)
        state.stuck = stuck

    def _circles_back(self, robot: str, still_long: Collection[str]) -> bool:
        """Return True if the waits among robots that stand lead from ``robot`` back to it."""
        seen: set[str] = set()
        front = list(self.state.watch.waits.get(robot, ()))
        while front:
            other = front.pop()
            if other == robot:
                return True
            if other not in seen and other in still_long:
                seen.add(other)
                front.extend(self.state.watch.waits.get(other, ()))
        return False
