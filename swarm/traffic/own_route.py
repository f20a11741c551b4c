"""Where a robot goes alone: the cell that is its goal, and its way there over the cells.

The goal is a cell that it can stand in and reach. The way leads along the path of its planner, or else it is a shortest
one near the straight line.
"""

from collections.abc import Collection, Mapping, Sequence
from heapq import heappop, heappush
from itertools import pairwise
from math import hypot
from typing import Final, NamedTuple

from swarm.geometry import distance
from swarm.maps.occupancy import Point
from swarm.messages.traffic import Record
from swarm.traffic.lattice.cell_map import OUTSIDE, CellMap
from swarm.traffic.lattice.distances import FAR
from swarm.traffic.lattice.dock import EXACT, Dock, find_cell_beside, find_dock, find_way_out
from swarm.traffic.peers.sightings import Cleared, has_reserved
from swarm.traffic.peers.situation import Situation
from swarm.traffic.reservations.route import BESIDE, Footprint, RouteProgress
from swarm.traffic.settings import NEAR, TrafficConstants

STRAY: Final = 0.7  # steps, the cost of a cell that lies one cell side off the path
RETRY: Final = 20  # ticks before the next attempt after no way was found


class Wish(NamedTuple):
    """Where a robot wants to be in one tick."""

    goal: Point | None  # m; None: it stays, but makes room for others
    path: Sequence[Point]  # m, to the goal; (): any shortest way
    done: bool  # no stop is left: the goal is only a place to stand
    then: Point | None = None  # m, where it wants to be after that; None: nowhere else


class DockCells(NamedTuple):
    """The cells beside its own cell that a robot needs between that cell and its place."""

    wanted: tuple[int, ...] = ()  # all of them, while it still has to come there; those that others hold first
    owners: tuple[str, ...] = ()  # robots that hold or claim some of them
    kept: tuple[int, ...] = ()  # those that it keeps while it is there or drives back
    drives: bool = False  # it is so near that it drives straight to its place, or stays there, once it holds them


class GoalCell:
    """The goal of one robot."""

    def __init__(self) -> None:
        self.cell = OUTSIDE
        self.since = 0  # tick
        self.wish: Point | None = None  # m; None: no particular place
        self.way_out: tuple[int, ...] = ()  # the way out of a cell in which no robot can stand; () elsewhere
        self.dock: Dock | None = None  # the way to a wish that is not reached from inside the cell
        self.leaves: Dock | None = None  # the dock that the robot is on its way back from
        self._place_for: tuple[CellMap, int, Point, float] | None = None
        self._place: Point = (0.0, 0.0)

    def set_wish(
        self,
        wish: Point | None,
        progress: RouteProgress,
        body: Footprint,
        cells: CellMap,
        settings: TrafficConstants,
        occupied: Collection[int] = (),
        uncertainty: float = 0.0,
    ) -> bool:
        """Set the wanted point [m]; return True if the goal cell changes and the robot wants to be somewhere.

        If no way leads from the head to that point, and none straight from a cell, the nearest reachable cell is taken.
        A chosen cell is given up, or left for the last part, if a robot comes nearer so: see ``_come_nearer``.
        """
        changed = False
        if self.leaves is not None and (
            body.cell == self.leaves.cell or self.leaves.cell not in progress.reservations.held
        ):
            self.leaves = None
        dock = self.dock
        if dock is not None and dock.cell in progress.reservations.held and body.cell != dock.cell:
            # it goes elsewhere, or a joint plan sends it
            sent_off = progress.head != dock.cell and progress.has_strayed(body.cell)
            if sent_off or wish not in {None, dock.place}:
                self.leaves = dock
        if wish is None:
            if self.wish is not None or self.cell == OUTSIDE:
                self.cell = progress.head
            held = progress.reservations.held
            if dock is None or dock.cell != self.cell or not dock.has_cells(held, cells, settings, uncertainty):
                self.dock = None  # it stays inside its cell; else it stays at its place until others need that
        elif wish != self.wish or self.cell == OUTSIDE or self.way_out or not cells.stands[self.cell]:
            self.way_out = _way_out(progress, body, cells, settings.radius)
            cell = self.way_out[0] if self.way_out else cells.cell_of(*wish)
            table = cells.distances(cell if self.way_out else progress.head)
            self.dock = None if self.way_out else find_dock(cells, wish, settings, lambda one: table[one] < FAR)
            if self.dock is not None:
                cell = self.dock.cell
            if cell == OUTSIDE or table[cell] >= FAR:
                reachable = [other for other, steps in enumerate(table) if steps < FAR]
                cell = min(reachable, key=lambda other: (distance(cells.centre(other), wish), other))
            if cell != self.cell:
                self.cell, self.since, changed = cell, body.tick, True
        else:
            changed = self._come_nearer(wish, progress, body, cells, settings, occupied, uncertainty)
        self.wish = wish
        return changed

    def _come_nearer(
        self,
        wish: Point,
        progress: RouteProgress,
        body: Footprint,
        cells: CellMap,
        settings: TrafficConstants,
        occupied: Collection[int],
        uncertainty: float,
    ) -> bool:
        """Choose another cell or a dock if the point is out of reach from the chosen cell; return True if it changes.

        If an unexpected body stands in the cell, one of those ``occupied``, a cell beside it is taken that comes within
        reach. A robot that stands where it comes nearest from inside the cell, and may be off by ``uncertainty`` [m],
        drives straight to the point if it may be out of reach.
        """
        if self.cell in occupied and self.cell != progress.head:
            beside = find_cell_beside(cells, progress.head, self.cell, wish, occupied, settings)
            if beside == OUTSIDE:
                return False
            self.cell, self.dock, self.since = beside, None, body.tick
            return True
        if uncertainty and self.dock is None and body.cell == self.cell == progress.head:
            nearest = self.place(wish, settings.standing_room + uncertainty, cells)
            if distance(body.pose[:2], nearest) <= NEAR:
                self.dock = find_dock(cells, wish, settings, self.cell.__eq__, uncertainty)
        return False

    def stop_to_visit(self, wish: Wish) -> int:
        """Return the cell of the stop that the robot has yet to reach; OUTSIDE: there is none, or it docks there."""
        if self.dock is not None:
            return OUTSIDE
        return self.cell if wish.goal is not None and wish.goal == self.wish and not wish.done else OUTSIDE

    def is_between(self, progress: RouteProgress, here: int) -> bool:
        """Return True if the robot, in the cell ``here``, is between the cell of its dock and its place."""
        at_dock = self.dock is not None and progress.head == self.cell != here
        return self.leaves is not None or at_dock

    def reset_wish(self) -> None:
        """Choose the cell again with the next wish, because the floor has changed."""
        self.wish = None

    def forget(self) -> None:
        """Forget the cell, because ways on the old floor count no more."""
        self.cell = OUTSIDE

    def stay_at(self, cell: int) -> None:
        """Take the cell to which a joint plan leads the robot, which has no goal of its own."""
        self.cell = cell

    def place(self, wish: Point, room: float, cells: CellMap) -> Point:
        """Return the point in the goal cell nearest to ``wish`` where a disc with the radius ``room`` fits [m]."""
        asked = (cells, self.cell, wish, room)
        if asked != self._place_for:
            self._place_for = asked
            self._place = cells.move_inside(self.cell, wish, room)
        return self._place


def cells_at_dock(
    goal: GoalCell,
    wish: Wish,
    progress: RouteProgress,
    here: int,
    others: Mapping[str, Record],
    cleared: Cleared,
    cells: CellMap,
    settings: TrafficConstants,
    uncertainty: float,
) -> DockCells:
    """Return the cells beside its own that a robot, in the cell ``here``, needs to its place, or back to its cell.

    It may be off by ``uncertainty`` [m]; ``cleared`` are cells of silent robots that were seen empty. While others hold
    one of the cells it follows its plan, if that leads it on.
    """
    held = progress.reservations.held
    if goal.leaves is not None:
        beside = goal.leaves.cells_beside(cells, settings, uncertainty)
        return DockCells(kept=tuple([cell for cell in beside if cell in held]))
    if (
        goal.dock is None
        or wish.goal not in {None, goal.wish}
        or progress.head != goal.cell
        or goal.cell in progress.route
    ):
        return DockCells()
    beside = goal.dock.cells_beside(cells, settings, uncertainty)
    if here != goal.cell and here not in beside:
        return DockCells()  # it is still on its way to the cell
    owners = {
        robot: cell
        for robot, record in others.items()
        for cell in beside
        if cell not in held and has_reserved(record, cell) and (robot, cell) not in cleared
    }
    if wish.done or wish.goal is None:
        is_asked = any(not {goal.cell, *beside}.isdisjoint(record.ahead) for record in others.values())
        may_stay = not owners and not is_asked
        stays = may_stay and set(beside) <= set(held)
        if may_stay and not stays and wish.goal is not None and settings.reach <= EXACT:
            return DockCells(wanted=beside, drives=True)  # it counted as there before it held them
        return DockCells(kept=beside if stays else (), drives=stays)
    if owners and progress.route:
        return DockCells()
    first = sorted(beside, key=lambda cell: (cell not in owners.values(), cell))
    return DockCells(wanted=tuple(first), owners=tuple(sorted(owners)), drives=True)


def is_docked(
    goal: GoalCell, dock: DockCells, held: Collection[int], body: Footprint, cells: CellMap, settings: TrafficConstants
) -> bool:
    """Return True if a robot that holds these cells drives straight to its place now, or stays there.

    From a cell on its way the straight line may lead past a corner of its cells: it drives to its own cell first.
    """
    if not dock.drives or goal.dock is None or not {*dock.wanted, *dock.kept}.issubset(held):
        return False
    return body.cell == goal.cell or goal.dock.is_straight(body.pose[:2], held, cells, settings)


def cell_on_way(
    goal: GoalCell,
    dock: DockCells,
    progress: RouteProgress,
    body: Footprint,
    cells: CellMap,
    settings: TrafficConstants,
) -> int:
    """Return the cell that counts as the body's on its way: the way's last one while it is beside it, at its place.

    It may have left its way for the straight line to its place before it was in that cell, and is past all of it, if
    the line needs no cell of the way that it would release.
    """
    needed = {*dock.wanted, *dock.kept}
    stay = {goal.cell, *needed, *body.touched}.intersection(progress.reservations.held)
    if body.cell in needed and is_docked(goal, dock, stay, body, cells, settings):
        return progress.head
    return body.cell


def _way_out(progress: RouteProgress, body: Footprint, cells: CellMap, radius: float) -> tuple[int, ...]:
    """Return the cell to drive to, as a way, if an edit has left the body in a cell where no robot can stand.

    No way over cells leads out of such a cell. The result is () if the robot stands in a proper cell, or if every cell
    beside it is shut off.
    """
    head = progress.head
    if cells.stands[head] or any(step != BESIDE for step in progress.steps[:-1]):
        return ()
    out = find_way_out(cells, body.pose[:2], radius)
    return () if out == OUTSIDE else (out,)


class OwnRoute:
    """Finds a way for a robot that follows no joint plan, and keeps it while it is valid."""

    def __init__(self) -> None:
        self._found_for: tuple[int, frozenset[int]] | None = None  # goal, and the cells that were blocked
        self._retry_at = 0  # tick

    def find(
        self,
        progress: RouteProgress,
        situation: Situation,
        path: Sequence[Point],
        way_out: tuple[int, ...] = (),
    ) -> RouteProgress:
        """Return the progress with a way to the goal, if there is one. ``path`` is what :func:`own_way` takes.

        If ``way_out`` is not empty, it is taken instead: it leads out of a cell from which no way over cells leads.
        """
        cells, goal, tick, stays = situation.cells, situation.goal, situation.tick, situation.stays
        blocked = situation.blocked | stays if stays else situation.blocked
        complete = progress.route[-1] == goal if progress.route else progress.head == goal
        if progress.sought and self._found_for is not None:
            found_for, avoided = self._found_for
            # a way round is driven to its end: turning back once an obstacle is forgotten could go on for ever
            if found_for == goal and (blocked <= avoided if complete else blocked == avoided and tick < self._retry_at):
                return progress
        self._found_for, self._retry_at = (goal, blocked), tick + RETRY
        way = way_out or find_own_way(cells, progress.head, goal, blocked - {progress.head}, path)
        if not way and stays:  # no way leads round: wait before the mute robot
            way = find_own_way(cells, progress.head, goal, situation.blocked - {progress.head}, path)
        return progress.on_own_way(way).without_stale_claims()


def find_own_way(
    cells: CellMap, start: int, goal: int, without: Collection[int] = (), path: Sequence[Point] = ()
) -> tuple[int, ...]:
    """List the cells from ``start``, itself left out, to ``goal``; empty if no way leads there.

    The way keeps near ``path`` [m]; without a path, near the straight line from cell to cell. A way near a slanting
    line is a staircase, which a robot drives without turning on the spot. Of equal ways the choice is always the same.
    A* with the steps left as its heuristic (Hart, Nilsson, Raphael 1968).
    """
    steps = cells.distances(goal, without)
    if steps[start] >= FAR:
        return ()
    line = tuple(path) if len(path) > 1 else (cells.centre(start), cells.centre(goal))
    reached: dict[int, float] = {start: 0.0}
    came: dict[int, int] = {}
    ready = [(float(steps[start]), start)]
    done: set[int] = set()
    while ready:
        cell = heappop(ready)[1]
        if cell in done:
            continue
        if cell == goal:
            break
        done.add(cell)
        for other in cells.neighbours[cell]:
            if other in done or steps[other] >= FAR:
                continue
            cost = reached[cell] + 1.0 + STRAY * distance_to_polyline(line, cells.centre(other)) / cells.side
            if cost < reached.get(other, float("inf")) - 1e-9:
                reached[other] = cost
                came[other] = cell
                heappush(ready, (cost + steps[other], other))
    way = [goal]
    while way[-1] != start:
        way.append(came[way[-1]])
    return tuple(way[-2::-1])


def distance_to_polyline(line: Sequence[Point], point: Point) -> float:
    """Return the distance from a point to a polyline [m]."""
    x, y = point
    least = float("inf")
    for (x0, y0), (x1, y1) in pairwise(line):
        dx, dy = x1 - x0, y1 - y0
        length = dx * dx + dy * dy
        share = max(0.0, min(1.0, ((x - x0) * dx + (y - y0) * dy) / length)) if length > 0 else 0.0
        least = min(least, hypot(x0 + share * dx - x, y0 + share * dy - y))
    return least
