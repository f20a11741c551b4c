"""The order of entries in a joint plan: who enters each cell after whom. It depends on progress, not on time.

Action dependency graph: Hoenig et al., IEEE RA-L 4(2), 2019. The same order kept under delays: RMTRACK, Gregoire et
al., 2017. Each visit of a cell waits only for the visit just before it, so an entry depends on one other robot at most.
"""

from collections.abc import Sequence
from typing import NamedTuple

from swarm.traffic.mapf.pibt import Configuration


class EntryConstraint(NamedTuple):
    """A condition of an entry: ``robot`` has left the ``place``-th cell of its way."""

    robot: int
    place: int


class Precedence(NamedTuple):
    """A joint plan without time."""

    ways: tuple[tuple[int, ...], ...]  # [robot] -> cells, its present one first, none twice in a row
    after: tuple[dict[int, EntryConstraint], ...]  # [robot][index of the cell entered] -> what it waits for


def order_of(steps: Sequence[Configuration]) -> Precedence:
    """Return the way of every robot, and for each cell who enters it after whom.

    >>> order_of([(0, 3), (1, 3), (2, 1)])  # robot 1 takes cell 1 once robot 0 has left its cell no. 1
    Precedence(ways=((0, 1, 2), (3, 1)), after=({}, {1: EntryConstraint(robot=0, place=1)}))
    """
    ways = [[cell] for cell in steps[0]]
    last = {cell: EntryConstraint(robot, 0) for robot, cell in enumerate(steps[0])}
    after: list[dict[int, EntryConstraint]] = [{} for _ in ways]
    for at in steps[1:]:
        for robot, cell in enumerate(at):
            way = ways[robot]
            if cell == way[-1]:
                continue
            before = last.get(cell)
            if before is not None and before.robot != robot:
                after[robot][len(way)] = before
            last[cell] = EntryConstraint(robot, len(way))
            way.append(cell)
    return Precedence(tuple(map(tuple, ways)), tuple(after))
