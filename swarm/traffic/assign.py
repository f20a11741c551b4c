"""Where each robot of a joint plan shall end: its own goal, or, where that is taken or cut off, a free cell near it."""

from collections.abc import Callable, Collection, Mapping, Sequence
from enum import Enum
from typing import Final

from swarm.traffic.cells import FAR, CellMap

ENOUGH: Final = 10  # steps from the one that comes; farther away helps nobody


class Aside(Enum):
    """Where a robot goes whose goal is another one's."""

    NEAR = "near"  # near its goal: it is there soon once the goal is free
    STAY = "stay"  # near where it is: fewest have to move
    AWAY = "away"  # off the ways of those that come: out of a dead end


def assign(
    cells: CellMap,
    heads: Mapping[str, int],
    wishes: Mapping[str, int],
    blocked: Collection[int],
    since: Mapping[str, int],
    done: Collection[str] = (),
    idle: Collection[str] = (),
    aside: Aside = Aside.NEAR,
) -> dict[str, int]:
    """Give each robot a goal of its own that it can reach: the nearest to its goal chooses first.

    Of equally near ones it is who has stood the longest: ``since`` [tick] is when each last got on. Who is ``done``
    chooses after all that have stops left, even after those that have to be content with a cell near their goal: one
    that stands there to look past a dead robot must not be sent away for the sake of one that only goes back to its
    place. Who is ``idle`` chooses last, and wants only to be out of the way: it stays, or goes to the nearest cell that
    nobody drives over to its own goal.

    Shared targets need no other rule: one robot gets the target, the others free cells, chosen by ``aside``. A robot
    whose goal is nowhere (OUTSIDE) keeps its place as its wish.
    """
    reach = {robot: cells.distances(head, blocked) for robot, head in heads.items()}
    wish = {robot: goal if 0 <= goal < len(cells) else heads[robot] for robot, goal in wishes.items()}
    rank = {robot: 2 if robot in idle else int(robot in done) for robot in heads}
    queue = sorted(heads, key=lambda robot: (rank[robot], reach[robot][wish[robot]], since[robot], robot))
    taken: dict[int, str] = {}
    ways: set[int] = set()
    for level in sorted(set(rank.values())):
        peers = [robot for robot in queue if rank[robot] == level]
        for robot in peers:
            goal = wish[robot]
            if reach[robot][goal] < FAR and goal not in taken and not (robot in idle and goal in ways):
                taken[goal] = robot
                ways.update(_way(cells, cells.distances(goal, blocked), heads[robot], heads.values()))
        for robot in peers:
            if robot not in taken.values():
                near, table = cells.distances(wish[robot]), reach[robot]
                comer = taken.get(wish[robot], queue[0])
                comes = reach[comer] if rank[robot] else [0] * len(cells)
                avoided = ways if robot in idle or aside is Aside.AWAY else ()
                free = (cell for cell, steps in enumerate(table) if steps < FAR and cell not in taken)
                taken[min(free, key=_order(aside, near, table, comes, avoided))] = robot
    return {robot: cell for cell, robot in taken.items()}


def _way(cells: CellMap, steps: Sequence[int], start: int, taken: Collection[int]) -> list[int]:
    """List the cells of a shortest way to where ``steps`` are 0, past those that are taken as far as that goes."""
    way = [start]
    while steps[way[-1]]:
        way.append(min(cells.neighbours[way[-1]], key=lambda cell: (steps[cell], cell in taken, cell)))
    return way


def _order(
    aside: Aside, near: Sequence[int], table: Sequence[int], comes: Sequence[int], avoided: Collection[int]
) -> Callable[[int], tuple[int, ...]]:
    """Return what a cell is worth: steps from the robot's goal, from itself, and from the one that comes."""
    match aside:
        case Aside.NEAR:
            return lambda cell: (cell in avoided, near[cell], -comes[cell], table[cell], cell)
        case Aside.STAY:
            return lambda cell: (cell in avoided, table[cell], -comes[cell], near[cell], cell)
        case Aside.AWAY:
            return lambda cell: (cell in avoided, -min(comes[cell], ENOUGH), table[cell], near[cell], cell)
