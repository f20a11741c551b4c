"""How long a joint plan takes if each robot goes as soon as the order of entries lets it.

Compiled: improving a plan judges hundreds of changed ones.
"""

from collections.abc import Sequence
from math import inf, isinf, sqrt
from typing import Final

import numpy as np
from numba import njit
from numpy.typing import NDArray

CORNER: Final = sqrt(0.5)  # steps for a cell in which the way turns: from the middle of one edge to that of the next
BACK: Final = 2.5  # steps where the way leads back: a turn on the spot takes 1.5 (measured with the fuzzy drive)
NOBODY: Final = -1

Integers = NDArray[np.int64]


def pace(before: int, cell: int, other: int) -> float:
    """Return the time from ``cell`` to ``other`` [steps]; ``before`` is the previous cell, or ``cell`` at the start.

    Straight on, a cell takes one step. A robot that turns cuts the corner: it drives a way of corners alone as one
    slanting line.
    """
    if before == cell or other - cell == cell - before:
        return 1.0
    return BACK if other == before else CORNER


_pace = njit("f8(i8, i8, i8)", cache=True)(pace)


@njit("UniTuple(f8, 2)(i8[:, ::1])", cache=True)
def _duration(steps: Integers) -> tuple[float, float]:
    times, robots = steps.shape
    visitor = np.full(steps.max() + 1, NOBODY)  # of each cell: the robot that was there last
    visit = np.zeros(visitor.size, np.int64)  # and which place of its way the cell was
    place = np.zeros(robots, np.int64)  # of each robot: where on its way it is
    arrived = np.zeros((robots, times))  # [robot, place]
    before = steps[0].copy()
    first = np.empty(robots, np.int64)  # of each mover: who has to leave the cell first, and which place that is
    left = np.empty(robots, np.int64)
    movers = np.empty(robots, np.int64)
    for robot in range(robots):
        visitor[steps[0, robot]] = robot
    for time in range(1, times):
        waiting = 0
        for robot in range(robots):
            cell = steps[time, robot]
            if cell != steps[time - 1, robot]:
                first[robot], left[robot] = visitor[cell], visit[cell]
                visitor[cell], visit[cell] = robot, place[robot] + 1
                movers[waiting] = robot
                waiting += 1
        while waiting:
            still = 0
            for number in range(waiting):
                robot = movers[number]
                other, start = first[robot], arrived[robot, place[robot]]
                if other not in (NOBODY, robot):
                    if place[other] <= left[robot]:
                        movers[still] = robot
                        still += 1
                        continue
                    start = max(start, arrived[other, left[robot] + 1])
                cell = steps[time - 1, robot]
                place[robot] += 1
                arrived[robot, place[robot]] = start + _pace(before[robot], cell, steps[time, robot])
                before[robot] = cell
            if still == waiting:
                return inf, inf
            waiting = still
    last = total = 0.0
    for robot in range(robots):
        last = max(last, arrived[robot, place[robot]])
        total += arrived[robot, place[robot]]
    return last, total


def duration(steps: Sequence[Sequence[int]]) -> tuple[float, float]:
    """Return when the last robot arrives, and the sum of all arrivals, estimated [steps].

    ``steps`` holds the cell of each robot at each time step. A robot enters a cell when the one there before has left.

    Raises:
        ValueError: Entries wait for each other in a circle. Only a plan with a ring of movers or a swap has one.
    """
    if not steps or not steps[0]:
        return 0.0, 0.0
    last, total = _duration(np.array(steps, np.int64))
    if isinf(last):
        raise ValueError("entries wait for each other in a circle: the plan has a ring of movers or a swap")
    return last, total
