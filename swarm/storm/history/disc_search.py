"""A search for a way of all robots over the drawing of a floor: discs that move one at a time. No lattice, no planner.

A robot stands on points that are a step apart, and moves from one to the next. The search takes the most promising
state first, so it finds a way soon where there is much room. A way that it finds is one; that it finds none proves
nothing of the places between the points.
"""

from collections.abc import Sequence
from heapq import heappop, heappush
from itertools import combinations
from math import floor
from typing import Final

import numpy as np
from numpy.typing import NDArray

from swarm.geometry import distance
from swarm.maps.occupancy import FREE, OccupancyMap, Point
from swarm.storm.free_space import SPARE, gaps

STEP: Final = 0.2  # m, between two points
BETWEEN: Final = 0.06  # m, between two bodies on points: on the way from one to the next they come 1 cm nearer at most
MOST: Final = 60_000  # states; a larger search ends without an answer


def can_all_arrive_on_drawing(
    known: OccupancyMap, radius: float, starts: Sequence[Point], stops: Sequence[Sequence[Point]], reach: float
) -> bool | None:
    """Return True if discs of ``radius`` [m] can visit their stops [m] in order; None: the search was too large.

    A stop is visited within ``reach`` [m] of it. The result is False too if a start is on none of the points.
    """
    points, near = _points(known, radius + SPARE - 0.01)
    if not len(points):
        return False
    begin = [int(np.argmin(np.hypot(*(points - start).T))) for start in starts]
    if any(distance(tuple(points[at]), start) > STEP for at, start in zip(begin, starts, strict=True)):
        return False
    touching = [set(np.flatnonzero(np.hypot(*(points - point).T) < 2 * radius + BETWEEN).tolist()) for point in points]
    there = max(reach, STEP)
    visited = [[set(np.flatnonzero(np.hypot(*(points - stop).T) <= there).tolist()) for stop in row] for row in stops]
    steps = [[_steps(near, goal) for goal in row] for row in visited]

    def advance(robot: int, at: int, done: int) -> int:
        while done < len(visited[robot]) and at in visited[robot][done]:
            done += 1
        return done

    def worth(state: tuple[tuple[int, int], ...]) -> float:
        return sum(
            float(steps[robot][done][at]) + 1000.0 * (len(steps[robot]) - done - 1)
            for robot, (at, done) in enumerate(state)
            if done < len(steps[robot])
        )

    first = tuple((at, advance(robot, at, 0)) for robot, at in enumerate(begin))
    if any(b in touching[a] for a, b in combinations(begin, 2)):
        return None
    seen, ready, number = {first}, [(worth(first), 0, first)], 0
    while ready:
        state = heappop(ready)[2]
        if all(done == len(visited[robot]) for robot, (_, done) in enumerate(state)):
            return True
        for robot, (at, done) in enumerate(state):
            others = [place for other, (place, _) in enumerate(state) if other != robot]
            for place in near[at]:
                if any(place in touching[other] for other in others):
                    continue
                new = (*state[:robot], (place, advance(robot, place, done)), *state[robot + 1 :])
                if new not in seen:
                    if len(seen) >= MOST:
                        return None
                    seen.add(new)
                    number += 1
                    heappush(ready, (worth(new), number, new))
    return False


def _points(known: OccupancyMap, radius: float) -> tuple[NDArray[np.float64], list[list[int]]]:
    """Return the points (n, 2) [m] where a disc fits, and for each the points to which it can be moved."""
    solid = np.pad(known.cells != FREE, 1, constant_values=True)
    side = known.resolution
    rows, columns = (floor(size * side / STEP) * 2 + 1 for size in known.shape)
    ys, xs = np.mgrid[:rows, :columns]  # the points, and those in the middle between two of them
    places = np.stack([xs.ravel(), ys.ravel()], 1) * STEP / 2
    fits = (gaps(solid, side, places + side) >= radius).reshape(rows, columns)
    numbers = np.full(fits.shape, -1)
    found = [(row, column) for row, column in np.argwhere(fits).tolist() if row % 2 == column % 2 == 0]
    for number, place in enumerate(found):
        numbers[place] = number
    near = [
        [
            int(numbers[row + 2 * up, column + 2 * along])
            for up, along in ((0, 1), (1, 0), (0, -1), (-1, 0))
            if 0 <= row + 2 * up < rows
            and 0 <= column + 2 * along < columns
            and fits[row + up, column + along]
            and fits[row + 2 * up, column + 2 * along]
        ]
        for row, column in found
    ]
    return np.array([(column * STEP / 2, row * STEP / 2) for row, column in found], np.float64).reshape(-1, 2), near


def _steps(near: Sequence[Sequence[int]], goals: set[int]) -> list[float]:
    """Return the steps from each point to the nearest goal; inf: no way leads there."""
    table = [float("inf")] * len(near)
    ready = sorted(goals)
    for point in ready:
        table[point] = 0.0
    for point in ready:
        for other in near[point]:
            if table[other] == float("inf"):
                table[other] = table[point] + 1.0
                ready.append(other)
    return table
