"""Where each robot of a joint plan shall end: its own goal, or, where that is taken or cut off, a free cell near it."""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from enum import Enum

from swarm.traffic.breadth_first import FAR
from swarm.traffic.cells import CellMap


class Aside(Enum):
    """Where a robot goes whose goal is another one's."""

    NEAR = "near"  # near its goal: it is there soon once the goal is free
    STAY = "stay"  # near where it is: fewest have to move


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
    """Assign each robot a goal of its own that it can reach: the nearest to its goal chooses first.

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
                free = (cell for cell, steps in enumerate(table) if steps < FAR and cell not in taken)
                taken[min(free, key=_order(aside, near, table, ways))] = robot
    return {robot: cell for cell, robot in taken.items()}


def _way(cells: CellMap, steps: Sequence[int], start: int, taken: Collection[int]) -> Iterator[int]:
    """Give the cells of a shortest way from ``start`` to where ``steps`` are 0: past those taken, if one leads so."""
    yield (cell := start)
    while steps[cell]:
        yield (cell := min(cells.neighbours[cell], key=lambda other: (steps[other], other in taken, other)))


def _order(
    aside: Aside, near: Sequence[int], table: Sequence[int], ways: Collection[int]
) -> Callable[[int], tuple[int, ...]]:
    """Return what a cell is worth: off the ways; steps from the robot's goal, and from itself."""
    match aside:
        case Aside.NEAR:
            return lambda cell: (cell in ways, near[cell], table[cell], cell)
        case Aside.STAY:
            return lambda cell: (cell in ways, table[cell], near[cell], cell)
