"""A brute-force search over joint positions: can these robots all arrive? It knows no planner.

One robot moves at a time, to a free cell next to its own. Every state is visited, so a "no" is a proof.
"""

from collections import deque
from collections.abc import Collection, Sequence
from typing import Final

MOST: Final = 250_000  # states; beyond that the answer is "not known"

Cells = Sequence[Collection[int]]  # [cell] -> cells next to it


def can_all_arrive(neighbours: Cells, starts: Sequence[int], stops: Sequence[Sequence[Collection[int]]]) -> bool | None:
    """Return True if each robot can visit its stops in order, all robots together; None if that takes too long.

    ``stops[robot][k]`` are the cells in which its ``k``-th stop counts as reached. A robot that has no stop left still
    stands somewhere, and makes room.
    """

    def reached(robot: int, cell: int, done: int) -> int:
        row = stops[robot]
        while done < len(row) and cell in row[done]:
            done += 1
        return done

    robots = range(len(starts))
    first = tuple((cell, reached(robot, cell, 0)) for robot, cell in enumerate(starts))
    goal = tuple(len(row) for row in stops)
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
                new = (*state[:robot], (other, reached(robot, other, done)), *state[robot + 1 :])
                if new not in seen:
                    if len(seen) >= MOST:
                        return None
                    seen.add(new)
                    ready.append(new)
    return False
