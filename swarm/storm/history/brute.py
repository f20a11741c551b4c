"""A brute-force search over configurations: can these robots all arrive? It uses no planner.

One robot moves at a time, to a free cell next to its own. The search visits every state, so the answer no is a proof.
"""

from collections import deque
from collections.abc import Collection, Sequence
from typing import Final

MOST: Final = 250_000  # states; a larger search returns None

Cells = Sequence[Collection[int]]  # [cell] -> cells next to it


def can_all_arrive(neighbours: Cells, starts: Sequence[int], stops: Sequence[Sequence[Collection[int]]]) -> bool | None:
    """Return True if all robots together can visit their stops in order, or None if the search is too large.

    ``stops[robot][k]`` are the cells in which the robot's ``k``-th stop counts as reached. A robot with no stop left
    still occupies a cell, and moves to make room; such robots are alike, so states that differ in who of them is where
    count once.
    """

    def search_reachable(robot: int, cell: int, done: int) -> int:
        row = stops[robot]
        while done < len(row) and cell in row[done]:
            done += 1
        return done

    robots = range(len(starts))
    goal = tuple(len(row) for row in stops)

    def alike(state: tuple[tuple[int, int], ...]) -> tuple[tuple[int, int], ...]:
        done = [robot for robot in robots if state[robot][1] == goal[robot]]
        places = dict(zip(done, sorted(state[robot][0] for robot in done), strict=True))
        return tuple((places.get(robot, cell), count) for robot, (cell, count) in enumerate(state))

    first = alike(tuple((cell, search_reachable(robot, cell, 0)) for robot, cell in enumerate(starts)))
    seen = {first}
    ready = deque([first])
    while ready:
        state = ready.popleft()
        if tuple(done for _, done in state) == goal:
            return True
        taken = {cell for cell, _ in state}
        for robot in robots:
            cell, done = state[robot]
            for other in neighbours[cell]:
                if other in taken:
                    continue
                then = search_reachable(robot, other, done)
                new = (*state[:robot], (other, then), *state[robot + 1 :])
                if then == goal[robot]:
                    new = alike(new)
                if new not in seen:
                    if len(seen) >= MOST:
                        return None
                    seen.add(new)
                    ready.append(new)
    return False
