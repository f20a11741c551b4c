"""Where robots of a joint plan end: each in a cell of its own, its goal, or a free cell near it if that is taken."""

from collections import deque
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from enum import Enum

from swarm.traffic.lattice.cell_map import CellMap
from swarm.traffic.lattice.distances import FAR


class FallbackGoal(Enum):
    """Where a robot goes if another robot gets its goal."""

    NEAR = "near"  # near its goal, so that it arrives soon after the goal is free
    STAY = "stay"  # near its present cell, so that the fewest robots move


def assign_goals(
    cells: CellMap,
    heads: Mapping[str, int],
    wishes: Mapping[str, int],
    blocked: Collection[int],
    since: Mapping[str, int],
    done: Collection[str] = (),
    idle: Collection[str] = (),
    aside: FallbackGoal = FallbackGoal.NEAR,
    kept_free: Collection[int] = (),
    floors: Mapping[str, CellMap] | None = None,
) -> dict[str, int]:
    """Return a goal cell for each robot that it can reach and that no other robot has.

    The robot nearest to its goal chooses first. Of equally near robots, the one that has stood the longest chooses
    first: ``since`` [tick] is when each last made progress. Robots in ``done`` have no stops left. They choose after
    all robots that have stops left, even after those that only get a cell near their goal: a robot that stands there to
    look past a dead robot must not be sent away for one that only returns to its place. Robots in ``idle`` choose last
    and only have to be out of the way: each stays, or goes to the nearest cell that no robot drives over to its own
    goal.

    Nobody gets a cell that is ``kept_free`` for a robot at its stop, as long as there are others. ``floors`` say how
    the cells are joined for each robot, by default as in ``cells``.

    Shared targets need no other rule: one robot gets the target, the others get free cells, chosen by ``aside``. A
    robot whose goal is not a cell (OUTSIDE) wishes to stay where it is.
    """
    own = floors or dict.fromkeys(heads, cells)
    reach = {robot: own[robot].distances(head, blocked) for robot, head in heads.items()}
    wish = {robot: goal if 0 <= goal < len(cells) else heads[robot] for robot, goal in wishes.items()}
    rank = {robot: 2 if robot in idle else int(robot in done) for robot in heads}
    queue = sorted(heads, key=lambda robot: (rank[robot], reach[robot][wish[robot]], since[robot], robot))
    taken: dict[int, str] = dict.fromkeys(kept_free, "")
    ways: set[int] = set()
    for level in sorted(set(rank.values())):
        peers = [robot for robot in queue if rank[robot] == level]
        for robot in peers:
            goal = wish[robot]
            if reach[robot][goal] < FAR and goal not in taken and not (robot in idle and goal in ways):
                taken[goal] = robot
                ways.update(_way(own[robot], own[robot].distances(goal, blocked), heads[robot], heads.values()))
        left = deque(robot for robot in peers if robot not in taken.values())
        while left:
            robot = left.popleft()
            near, table = own[robot].distances(wish[robot]), reach[robot]
            free = [cell for cell, steps in enumerate(table) if steps < FAR and cell not in taken]
            free = free or [cell for cell, steps in enumerate(table) if steps < FAR and not taken[cell]]
            # a wide robot may come nowhere else: who has got its cell chooses again, which ends, as heads are different
            cell = min(free, key=_make_sort_key(aside, near, table, ways), default=heads[robot])
            if other := taken.get(cell):
                left.append(other)
            taken[cell] = robot
    return {robot: cell for cell, robot in taken.items() if robot}


def _way(cells: CellMap, steps: Sequence[int], start: int, taken: Collection[int]) -> Iterator[int]:
    """Yield the cells of a shortest way from ``start`` to where ``steps`` is 0; cells off ``taken`` are preferred."""
    yield (cell := start)
    while steps[cell]:
        yield (cell := min(cells.neighbours[cell], key=lambda other: (steps[other], other in taken, other)))


def _make_sort_key(
    aside: FallbackGoal, near: Sequence[int], table: Sequence[int], ways: Collection[int]
) -> Callable[[int], tuple[int, ...]]:
    """Return the sort key of a cell: off the ways first, then by its steps from the goal and from the robot."""
    match aside:
        case FallbackGoal.NEAR:
            return lambda cell: (cell in ways, near[cell], table[cell], cell)
        case FallbackGoal.STAY:
            return lambda cell: (cell in ways, table[cell], near[cell], cell)
