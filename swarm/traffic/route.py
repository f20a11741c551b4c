"""A robot's own way over the cells: a shortest one, and of those the one nearest the straight line to its goal."""

from collections.abc import Collection

from swarm.traffic.cells import FAR, CellMap


def own_way(cells: CellMap, start: int, goal: int, without: Collection[int] = ()) -> tuple[int, ...]:
    """List the cells from ``start``, itself left out, to ``goal``; empty where no way leads there.

    Staying near the straight line makes a staircase of a slanting way, which a robot drives without turning in it.
    """
    table = cells.distances(goal, without)
    if table[start] >= FAR:
        return ()
    columns = cells.columns
    row, column = divmod(start, columns)
    goal_row, goal_column = divmod(goal, columns)
    along, up = goal_column - column, goal_row - row
    way: list[int] = []
    cell = start
    while cell != goal:
        steps = table[cell] - 1

        def off_line(other: int) -> tuple[int, int]:
            return abs((other % columns - column) * up - (other // columns - row) * along), other

        cell = min((other for other in cells.neighbours[cell] if table[other] == steps), key=off_line)
        way.append(cell)
    return tuple(way)
