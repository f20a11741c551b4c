"""A path: a few waypoints from start to goal, and where along it a robot is."""

from bisect import bisect_right
from collections.abc import Iterable
from dataclasses import dataclass, field
from itertools import accumulate, pairwise
from math import floor, hypot, inf

import numpy as np

from swarm.geometry import distance
from swarm.maps.occupancy import Cell, Point
from swarm.planning.grid import UNIT, Grid
from swarm.planning.sweep import pull_polyline, sweep

RUN = 6  # cells: longest piece into which a straight run of the grid's path is cut before string pulling
AHEAD = 48  # pieces that one shortcut may skip
CLASS = 0.75  # cells: a shortcut may have this much less clearance than the part of the grid's path it replaces


@dataclass(frozen=True)
class Path:
    """Waypoints from start to goal, joined by straight lines.

    >>> path = Path(((0.0, 0.0), (3.0, 0.0), (3.0, 4.0)))
    >>> path.length, path.point_at(5.0), path.remaining(5.0), path.project(2.5, 1.0, from_s=2.0)
    (7.0, (3.0, 2.0), 2.0, 4.0)
    """

    points: tuple[Point, ...]  # m, in map; at least two, which may be equal
    length: float = field(init=False, compare=False)  # m
    stations: tuple[float, ...] = field(init=False, compare=False, repr=False)  # m, arc length at each point

    def __post_init__(self) -> None:
        if len(self.points) < 2:
            raise ValueError(f"expected at least two points, got {len(self.points)}")
        legs = (distance(a, b) for a, b in pairwise(self.points))
        object.__setattr__(self, "stations", tuple(accumulate(legs, initial=0.0)))
        object.__setattr__(self, "length", self.stations[-1])

    def point_at(self, s: float) -> Point:
        """Return the point [m, map] at arc length ``s`` [m]; ``s`` is limited to the path's start and goal."""
        if s >= self.length:
            return self.points[-1]
        leg = max(0, bisect_right(self.stations, s) - 1)
        (ax, ay), (bx, by) = self.points[leg], self.points[leg + 1]
        span = self.stations[leg + 1] - self.stations[leg]
        t = max(0.0, s - self.stations[leg]) / span if span > 0.0 else 0.0
        return ax + t * (bx - ax), ay + t * (by - ay)

    def remaining(self, s: float) -> float:
        """Return the length [m] from arc length ``s`` [m] to the goal."""
        return self.length - min(max(s, 0.0), self.length)

    def project(self, x: float, y: float, from_s: float = 0.0, within: float = inf) -> float:
        """Return the arc length [m] of the path's point nearest to (x, y) [m, map], at or after ``from_s`` [m].

        Only the next ``within`` metres are searched: a path may return close to itself, and the limit keeps the result
        on the part that the robot follows. The first of equally near points counts.
        """
        from_s = min(max(from_s, 0.0), self.length)
        until = min(from_s + within, self.length)
        nearest, found = inf, from_s
        for leg in range(max(0, bisect_right(self.stations, from_s) - 1), len(self.points) - 1):
            low, high = self.stations[leg], self.stations[leg + 1]
            if low > until:
                break
            (ax, ay), (bx, by) = self.points[leg], self.points[leg + 1]
            span = high - low
            along = ((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / span if span > 0.0 else 0.0
            least, most = (low if low > from_s else from_s), (high if high < until else until)
            s = low + along
            s = most if s > most else least if s < least else s
            t = (s - low) / span if span > 0.0 else 0.0
            away = hypot(ax + t * (bx - ax) - x, ay + t * (by - ay) - y)
            if away < nearest:
                nearest, found = away, s
        return found


def line_is_free(grid: Grid, a: Point, b: Point, spare: float = 0.0) -> bool:
    """Return True if the robot's disc can move straight from a to b [m, map], ``spare`` [m] away from anything solid.

    The test is exact and does not depend on the size of cells. If the disc is too near something at a already, it may
    move as long as it comes no nearer to anything.
    """
    place = (grid.solid, grid.clearance, grid.resolution, grid.discs)
    return bool(sweep(*place, *grid.to_cells(*a), *grid.to_cells(*b), (grid.radius + spare) / grid.resolution))


def plan(grid: Grid, start_xy: Point, goal_xy: Point) -> Path | None:
    """Plan a short path with clearance from start to goal [m, map]; return None if there is no path.

    A* finds the cheapest path over ``grid.cost``. String pulling then shortens it: a shortcut keeps the least clearance
    of the part that it replaces (up to radius plus margin), less ``CLASS``, and never less than the radius. The result
    is never longer than the grid's path. If the start is too near something, the path begins at the nearest free cell
    in a straight line, within the radius and two cells. If the robot would touch something at the goal, there is no
    path.
    """
    start, goal = _cell_at(grid, start_xy, leaving=True), _cell_at(grid, goal_xy, leaving=False)
    if start is None or goal is None:
        return None
    found = grid.lattice().cheapest(grid.cost, UNIT, start, goal)
    if found is None:
        return None
    return Path(_pull_taut(grid, start_xy, found[1], goal_xy))


def is_reachable(grid: Grid, start_xy: Point, goal_xy: Point) -> bool:
    """Return True if ``plan`` finds a path; the first question about a grid costs as much as a plan, others little."""
    start, goal = _cell_at(grid, start_xy, leaving=True), _cell_at(grid, goal_xy, leaving=False)
    return start is not None and goal is not None and bool(grid.pieces[start] == grid.pieces[goal])


def _cell_at(grid: Grid, point: Point, leaving: bool) -> Cell | None:
    """Return the cell in which a path begins (or ends): the point's own, else the nearest one in a free line."""
    column, row = grid.to_cells(*point)
    rows, columns = grid.shape
    own = (floor(row), floor(column))
    if not (0 <= own[0] < rows and 0 <= own[1] < columns):
        return None
    if grid.free[own] and _joins(grid, own, point, leaving):
        return own
    reach = grid.radius / grid.resolution + 2.0 if leaving else 1.5
    r0, c0 = max(0, floor(row - reach)), max(0, floor(column - reach))
    block = grid.free[r0 : floor(row + reach) + 1, c0 : floor(column + reach) + 1]
    near = sorted(
        (hypot(r + r0 + 0.5 - row, c + c0 + 0.5 - column), r + r0, c + c0) for r, c in np.argwhere(block).tolist()
    )
    return next(((r, c) for away, r, c in near if away <= reach and _joins(grid, (r, c), point, leaving)), None)


def _joins(grid: Grid, cell: Cell, point: Point, leaving: bool) -> bool:
    centre = grid.centre_of(cell)
    return line_is_free(grid, point, centre) if leaving else line_is_free(grid, centre, point)


def _pull_taut(grid: Grid, start_xy: Point, way: list[Cell], goal_xy: Point) -> tuple[Point, ...]:
    cells = np.array(way, np.int64)
    steps = np.diff(cells, axis=0)
    kept = [0]
    for i in range(1, len(way) - 1):
        if i - kept[-1] >= RUN or (steps[i] != steps[i - 1]).any():
            kept.append(i)
    kept.append(len(way) - 1)
    room = grid.clearance[cells[:, 0], cells[:, 1]].astype(np.float64) / grid.resolution
    least = [room[i : j + 1].min() for i, j in pairwise(kept)]
    ends = (grid.to_cells(*start_xy), grid.to_cells(*goal_xy))
    points = np.array([ends[0], *((c + 0.5, r + 0.5) for r, c in cells[kept].tolist()), ends[1]], np.float64)
    rooms = np.array([room[0], *least, room[-1], room[-1]]) - CLASS
    radius, margin = grid.radius / grid.resolution, grid.margin / grid.resolution
    place = (grid.solid, grid.clearance, grid.resolution, grid.discs)
    chosen = pull_polyline(*place, points, rooms, radius, radius + margin, AHEAD).tolist()
    inner = [grid.from_cells(*points[i].tolist()) for i in chosen[1:-1]]
    return (start_xy, *_turning(start_xy, inner, goal_xy), goal_xy)


def _turning(start: Point, inner: Iterable[Point], goal: Point) -> list[Point]:
    """Return the inner points without those on the straight line between their neighbours."""
    line = [start, *inner, goal]
    turns: list[Point] = []
    for here, onward in pairwise(line[1:]):
        before = turns[-1] if turns else start
        bend = distance(before, here) + distance(here, onward) - distance(before, onward)
        if bend > 1e-9:
            turns.append(here)
    return turns
