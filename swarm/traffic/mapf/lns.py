"""Makes a joint plan quicker: takes a few robots out of it and finds new ways for them past the others.

Large neighbourhood search (MAPF-LNS: Li et al., IJCAI 2021). The new ways are found one robot after the other, each by
A* over cells and time steps.
"""

from collections.abc import Iterable, Sequence
from heapq import heappop, heappush
from itertools import pairwise
from random import Random
from typing import Final

from swarm.traffic.mapf.lacam import Steps, Vias
from swarm.traffic.mapf.makespan import pace
from swarm.traffic.mapf.pibt import Joined, Tables

MOST_OUT: Final = 3  # robots taken out at once
LONGER: Final = 4  # time steps by which the plan may become longer: a way round can be quicker than a way back
POPS: Final = 1_000  # expansions of the search for one way
VIA_POPS: Final = 3_000  # the same through another cell
CHANCE: Final = 0.01  # steps, a random cost that decides between equal ways

State = tuple[int, int, int, bool]  # time step, cell, the cell from which it was entered, the via was visited


class Improving:
    """Changes of plans without rings of movers; ``pops`` counts the expansions."""

    def __init__(self, neighbours: Joined, tables: Tables, random: Random, vias: Vias = ()) -> None:
        self.pops = 0
        self._vias = vias
        self._neighbours = neighbours
        self._tables = tables
        self._random = random
        self._steps: Steps = []  # the plan asked for last
        self._ways: list[Sequence[int]] = []  # [robot][time] -> cell, with LONGER more time steps at the end
        self._at: list[dict[int, int]] = []  # [time] -> who is in each cell

    def changed(self, steps: Steps) -> Steps | None:
        """Return the plan with new ways for some robots, or None if one of them finds no way."""
        if steps is not self._steps:
            self._steps = steps
            self._ways = [(*way, *(way[-1],) * LONGER) for way in zip(*steps, strict=True)]
            self._at = [dict(zip(spots, range(len(spots)), strict=True)) for spots in zip(*self._ways, strict=True)]
        out = self._random.sample(range(len(self._ways)), self._random.randint(1, min(MOST_OUT, len(self._ways))))
        ways = list(self._ways)
        self._take_out(out, ways)
        again: list[int] = []  # robots with new ways
        for robot in out:
            way = self._way(self._tables[robot], ways[robot], self._vias[robot] if self._vias else None)
            if way is None:
                break
            ways[robot] = way
            self._put_in([robot], ways)
            again.append(robot)
        good = len(again) == len(out) and not any(self._closes_a_ring(robot, ways) for robot in out)
        self._take_out(again, ways)
        self._put_in(out, self._ways)
        if not good:
            return None
        plan = list(zip(*ways, strict=True))
        while len(plan) > 1 and plan[-1] == plan[-2]:
            plan.pop()
        return plan

    def _put_in(self, robots: Iterable[int], ways: Sequence[Sequence[int]]) -> None:
        for robot in robots:
            for taken, cell in zip(self._at, ways[robot], strict=True):
                taken[cell] = robot

    def _take_out(self, robots: Iterable[int], ways: Sequence[Sequence[int]]) -> None:
        for robot in robots:
            for taken, cell in zip(self._at, ways[robot], strict=True):
                del taken[cell]

    def _closes_a_ring(self, robot: int, ways: Sequence[Sequence[int]]) -> bool:
        """Return True if robots, this one among them, move into each other's cells: each would wait for the next."""
        for time, (cell, other) in enumerate(pairwise(ways[robot])):
            at, here = self._at[time], cell
            while other != here and other in at:  # somebody is there, and moves on in the same step
                here, other = other, ways[at[other]][time + 1]
                if other == cell:
                    return True
        return False

    def _way(self, table: Sequence[int], old: Sequence[int], via: Sequence[int] | None) -> list[int] | None:
        """Return a quickest way past the others, a cell per time step, from the old start to the old end, or None.

        If ``via`` is not None, the way leads through the cell to which ``via`` holds the steps.
        """
        at = self._at
        start, goal, end = old[0], old[-1], len(old) - 1
        free_from = 1 + max((time for time, taken in enumerate(at) if goal in taken), default=-1)
        offset, random = table[goal], self._random.random
        beyond = via[goal] if via is not None else 0
        first = (0, start, start, via is None or via[start] == 0)
        cost, came = {first: 0.0}, {first: first}
        ready: list[tuple[float, State]] = [(0.0, first)]
        for _ in range(POPS if via is None else VIA_POPS):
            if not ready:
                break
            state = heappop(ready)[1]
            time, cell, before, been = state
            self.pops += 1
            if cell == goal and time >= free_from and been:
                way = _back(came, state)
                return way + [goal] * (end + 1 - len(way))
            if time == end:
                continue
            now, then = at[time], at[time + 1]
            for other in (*self._neighbours[cell], cell):
                there = been or (via is not None and via[other] == 0)
                left = table[other] - offset if there or via is None else via[other] + beyond
                swaps = other in now and then.get(cell) == now[other]
                if other in then or swaps or time + 1 + left > end:
                    continue
                following = (time + 1, other, before if other == cell else cell, there)
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
