"""A robot's own way over the cells: along the path of its planner, or else a shortest one near the straight line."""

from collections.abc import Collection, Sequence
from heapq import heappop, heappush
from itertools import pairwise
from math import hypot
from typing import Final

from swarm.maps.occupancy import Point
from swarm.traffic.lattice.breadth_first import FAR
from swarm.traffic.lattice.cell_map import CellMap
from swarm.traffic.peers.situation import Situation
from swarm.traffic.reservations.route import RouteProgress

STRAY: Final = 0.7  # steps, the cost of a cell that lies one cell side off the path
RETRY: Final = 20  # ticks before the next attempt after no way was found


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
        if progress.sought and self._found_for == (goal, blocked) and (complete or tick < self._retry_at):
            return progress
        self._found_for, self._retry_at = (goal, blocked), tick + RETRY
        way = way_out or own_way(cells, progress.head, goal, blocked - {progress.head}, path)
        if not way and stays:  # no way leads round: wait before the mute robot
            way = own_way(cells, progress.head, goal, situation.blocked - {progress.head}, path)
        return progress.alone(way).without_stale_claims()


def own_way(
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
            cost = reached[cell] + 1.0 + STRAY * off_line(line, cells.centre(other)) / cells.side
            if cost < reached.get(other, float("inf")) - 1e-9:
                reached[other] = cost
                came[other] = cell
                heappush(ready, (cost + steps[other], other))
    way = [goal]
    while way[-1] != start:
        way.append(came[way[-1]])
    return tuple(way[-2::-1])


def off_line(line: Sequence[Point], point: Point) -> float:
    """Return the distance from a point to a polyline [m]."""
    x, y = point
    least = float("inf")
    for (x0, y0), (x1, y1) in pairwise(line):
        dx, dy = x1 - x0, y1 - y0
        length = dx * dx + dy * dy
        share = max(0.0, min(1.0, ((x - x0) * dx + (y - y0) * dy) / length)) if length > 0 else 0.0
        least = min(least, hypot(x0 + share * dx - x, y0 + share * dy - y))
    return least
