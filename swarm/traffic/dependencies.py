"""The order of entries in a joint plan: who enters each cell after whom. It depends on progress, not on time.

Action dependency graph: Hoenig et al., IEEE RA-L 4(2), 2019. The same order kept under delays: RMTRACK, Gregoire et
al., 2017. Each visit of a cell waits only for the visit just before it, so an entry depends on one other robot at most.
"""

from collections.abc import Sequence
from math import sqrt
from typing import Final, NamedTuple

from swarm.traffic.pibt import Configuration

CORNER: Final = sqrt(0.5)  # steps for a cell in which the way turns: from the middle of one edge to that of the next
BACK: Final = 2.5  # steps where the way leads back: a turn on the spot takes 1.5 (measured with the fuzzy drive)


class After(NamedTuple):
    """A condition of an entry: ``robot`` has left the ``place``-th cell of its way."""

    robot: int
    place: int


class Order(NamedTuple):
    """A joint plan without time."""

    ways: tuple[tuple[int, ...], ...]  # [robot] -> cells, its present one first, none twice in a row
    after: tuple[dict[int, After], ...]  # [robot][index of the cell entered] -> what it waits for


def order_of(steps: Sequence[Configuration]) -> Order:
    """Return the way of every robot, and for each cell who enters it after whom.

    >>> order_of([(0, 3), (1, 3), (2, 1)])  # robot 1 takes cell 1 once robot 0 has left its cell no. 1
    Order(ways=((0, 1, 2), (3, 1)), after=({}, {1: After(robot=0, place=1)}))
    """
    ways = [[cell] for cell in steps[0]]
    last = {cell: After(robot, 0) for robot, cell in enumerate(steps[0])}
    after: list[dict[int, After]] = [{} for _ in ways]
    for at in steps[1:]:
        for robot, cell in enumerate(at):
            way = ways[robot]
            if cell == way[-1]:
                continue
            before = last.get(cell)
            if before is not None and before.robot != robot:
                after[robot][len(way)] = before
            last[cell] = After(robot, len(way))
            way.append(cell)
    return Order(tuple(map(tuple, ways)), tuple(after))


def pace(before: int, cell: int, other: int) -> float:
    """Return the time from ``cell`` to ``other`` [steps]; ``before`` is the previous cell, or ``cell`` at the start.

    Straight on, a cell takes one step. A robot that turns cuts the corner: it drives a way of corners alone as one
    slanting line.
    """
    if before == cell or other - cell == cell - before:
        return 1.0
    return BACK if other == before else CORNER


def duration(order: Order) -> tuple[float, float]:
    """Return when the last robot arrives, and the sum of all arrivals, estimated [steps].

    Raises:
        ValueError: Entries wait for each other in a circle. Only a plan with a ring of movers or a swap has one.
    """
    ways, after = order
    arrived: list[list[float]] = [[0.0] for _ in ways]
    ready = list(range(len(ways)))
    waiting: dict[After, list[int]] = {}
    left = sum(len(way) - 1 for way in ways)
    while ready:
        robot = ready.pop()
        way, times = ways[robot], arrived[robot]
        while len(times) < len(way):
            index = len(times)
            before = after[robot].get(index)
            start = times[-1]
            if before is not None:
                if len(arrived[before.robot]) <= before.place + 1:
                    waiting.setdefault(before, []).append(robot)
                    break
                start = max(start, arrived[before.robot][before.place + 1])
            times.append(start + pace(way[max(0, index - 2)], way[index - 1], way[index]))
            left -= 1
            ready.extend(waiting.pop(After(robot, index - 1), ()))
    if left:
        raise ValueError(f"{left} entries wait for each other in a circle: the plan has a ring of movers or a swap")
    return max((times[-1] for times in arrived), default=0.0), sum(times[-1] for times in arrived)
