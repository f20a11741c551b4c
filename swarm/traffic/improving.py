"""Makes a joint plan quicker: takes a few robots out of it and finds new ways for them past the others.

Large neighbourhood search (MAPF-LNS: Li et al., IJCAI 2021). The new ways are found one robot after the other, each by
A* over cells and time steps.
"""

from collections.abc import Iterable, Sequence
from heapq import heappop, heappush
from itertools import pairwise
from random import Random
from typing import Final

from swarm.traffic.dependencies import pace
from swarm.traffic.lacam import Steps
from swarm.traffic.pibt import Joined, Tables

MOST_OUT: Final = 3  # robots taken out at once
LONGER: Final = 4  # time steps by which the plan may become longer: a way round can be quicker than a way back
POPS: Final = 1_000  # expansions of the search for one way
CHANCE: Final = 0.01  # steps, a random cost that decides between equal ways

State = tuple[int, int, int]  # time step, cell, and the cell from which it was entered


class Improving:
    """One change of a plan; ``pops`` counts its expansions."""

    def __init__(self, neighbours: Joined, tables: Tables, random: Random) -> None:
        self.pops = 0
        self._neighbours = neighbours
        self._tables = tables
        self._random = random

    def changed(self, steps: Steps) -> Steps | None:
        """Return the plan with new ways for some robots, or None if one of them finds no way."""
        ways = [[*way, *(way[-1],) * LONGER] for way in zip(*steps, strict=True)]
        out = self._random.sample(range(len(ways)), self._random.randint(1, min(MOST_OUT, len(ways))))
        others = [way for robot, way in enumerate(ways) if robot not in out]
        for robot in out:
            way = self._way(self._tables[robot], ways[robot], others)
            if way is None:
                return None
            ways[robot] = way
            others.append(way)
        plan = list(zip(*ways, strict=True))
        while len(plan) > 1 and plan[-1] == plan[-2]:
            plan.pop()
        return plan if not any(_turns_a_ring(a, b) for a, b in pairwise(plan)) else None

    def _way(self, table: Sequence[int], old: Sequence[int], others: Sequence[Sequence[int]]) -> list[int] | None:
        """Return a quickest way past the others, a cell per time step, from the old start to the old end, or None."""
        start, goal, end = old[0], old[-1], len(old) - 1
        at = [dict(zip(spots, range(len(spots)), strict=True)) for spots in zip(*others, strict=True)]
        at = at or [{} for _ in old]
        free_from = 1 + max((time for time, taken in enumerate(at) if goal in taken), default=-1)
        offset, random = table[goal], self._random.random
        first = (0, start, start)
        cost, came = {first: 0.0}, {first: first}
        ready: list[tuple[float, State]] = [(float(table[start]), first)]
        for _ in range(POPS):
            if not ready:
                break
            state = heappop(ready)[1]
            time, cell, before = state
            self.pops += 1
            if cell == goal and time >= free_from:
                way = _back(came, state)
                return way + [goal] * (end + 1 - len(way))
            if time == end:
                continue
            now, then = at[time], at[time + 1]
            for other in (*self._neighbours[cell], cell):
                left = table[other] - offset
                swaps = other in now and then.get(cell) == now[other]
                if other in then or swaps or time + 1 + left > end:
                    continue
                following = (time + 1, other, before if other == cell else cell)
                step = 1.0 if other == cell else pace(before, cell, other)
                costs = cost[state] + step + CHANCE * random()
                if costs < cost.get(following, costs + 1.0):
                    cost[following], came[following] = costs, state
                    heappush(ready, (costs + left, following))
        return None


def _back(came: dict[State, State], state: State) -> list[int]:
    way = [state[1]]
    while state[0] > 0:
        state = came[state]
        way.append(state[1])
    return way[::-1]


def _turns_a_ring(old: Iterable[int], new: Iterable[int]) -> bool:
    """Return True if robots move into each other's cells in a ring: each would wait for the next forever."""
    moves = {a: b for a, b in zip(old, new, strict=True) if a != b}
    for start in moves:
        cell, seen = start, set[int]()
        while cell in moves and cell not in seen:
            seen.add(cell)
            cell = moves[cell]
        if cell in seen:
            return True
    return False
