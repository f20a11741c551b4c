"""The cell in which each robot of a joint plan ends: its goal, or a free cell near it if that is taken or cut off."""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from enum import Enum

from swarm.traffic.lattice.breadth_first import FAR
from swarm.traffic.lattice.cell_map import CellMap


class Displaced(Enum):
    """Where a robot goes if another robot gets its goal."""

    NEAR = "near"  # near its goal, so that it arrives soon after the goal is free
    STAY = "stay"  # near its present cell, so that the fewest robots move


def assign(
    cells: CellMap,
    heads: Mapping[str, int],
    wishes: Mapping[str, int],
    blocked: Collection[int],
    since: Mapping[str, int],
    done: Collection[str] = (),
    idle: Collection[str] = (),
    aside: Displaced = Displaced.NEAR,
) -> dict[str, int]:
    """Return a goal cell for each robot that it can reach and that no other robot has.

    The robot nearest to its goal chooses first. Of equally near robots, the one that has stood the longest chooses
    first: ``since`` [tick] is when each last made progress. Robots in ``done`` have no stops left. They choose after
    all robots that have stops left, even after those that only get a cell near their goal: a robot that stands there to
    look past a dead robot must not be sent away for one that only returns to its place. Robots in ``idle`` choose last
    and only have to be out of the way: each stays, or goes to the nearest cell that no robot drives over to its own
    goal.

    Shared targets need no other rule: one robot gets the target, the others get free cells, chosen by ``aside``. A
    robot whose goal is not a cell (OUTSIDE) wishes to stay where it is.
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
    """Yield the cells of a shortest way from ``start`` to where ``steps`` is 0; cells off ``taken`` are preferred."""
    yield (cell := start)
    while steps[cell]:
        yield (cell := min(cells.neighbours[cell], key=lambda other: (steps[other], other in taken, other)))


def _order(
    aside: Displaced, near: Sequence[int], table: Sequence[int], ways: Collection[int]
) -> Callable[[int], tuple[int, ...]]:
    """Return the sort key of a cell: off the ways first, then by its steps from the goal and from the robot."""
    match aside:
        case Displaced.NEAR:
            return lambda cell: (cell in ways, near[cell], table[cell], cell)
        case Displaced.STAY:
            return lambda cell: (cell in ways, table[cell], near[cell], cell)
