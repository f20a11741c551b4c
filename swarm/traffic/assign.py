"""Where each robot of a joint plan shall end: its own goal, or, where that is taken or cut off, a free cell near it."""

from collections.abc import Collection, Mapping

from swarm.traffic.cells import FAR, CellMap


def assign(
    cells: CellMap,
    heads: Mapping[str, int],
    wishes: Mapping[str, int],
    blocked: Collection[int],
    since: Mapping[str, int],
    idle: Collection[str] = (),
) -> dict[str, int]:
    """Give each robot a goal of its own that it can reach: the nearest to its goal chooses first.

    Of equally near ones it is who has stood the longest: ``since`` [tick] is when each last got on. Who is ``idle``
    chooses last, and makes room away from the one that comes.

    Shared targets need no other rule: one robot gets the target, the others the nearest free cells about it. A robot
    whose goal is nowhere (OUTSIDE) keeps its place as its wish.
    """
    reach = {robot: cells.distances(head, blocked) for robot, head in heads.items()}
    wish = {robot: goal if 0 <= goal < len(cells) else heads[robot] for robot, goal in wishes.items()}
    queue = sorted(heads, key=lambda robot: (robot in idle, reach[robot][wish[robot]], since[robot], robot))
    taken: dict[int, str] = {}
    for robot in queue:
        if reach[robot][wish[robot]] < FAR:
            taken.setdefault(wish[robot], robot)
    goals = {robot: cell for cell, robot in taken.items()}
    for robot in queue:
        if robot not in goals:
            near, table = cells.distances(wish[robot]), reach[robot]
            comes = [0] * len(cells) if robot not in idle else reach[taken.get(wish[robot], robot)]
            free = (cell for cell, steps in enumerate(table) if steps < FAR and cell not in taken)
            goals[robot] = min(free, key=lambda cell: (near[cell], -comes[cell], table[cell], cell))
            taken[goals[robot]] = robot
    return goals
