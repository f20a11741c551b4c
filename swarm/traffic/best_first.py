"""Best-first search over joint positions, one robot moving at a time: for few robots in narrow places.

LaCAM goes depth first and now and then loses itself where two or three robots have to let each other pass. This search
keeps every position it has seen, so it is slow for many robots, but it ends: with a plan, or with the proof that there
is none. Some robots may not care where they end: they only make room, and who of them stands where is all one. Of two
positions the one comes first whose robots have fewer steps left in all (greedy best-first search, Pearl 1984).
"""

from collections.abc import Sequence
from heapq import heappop, heappush
from typing import Final

from swarm.traffic.lacam import State, Steps
from swarm.traffic.pibt import Configuration, Joined, Tables

MOST: Final = 60_000  # joint positions kept


class BestFirst:
    """One search from ``starts``; ``tables[i]`` holds robot i's steps to its goal from every cell.

    It ends when each robot of ``eager`` is at its goal, where its table is 0.
    """

    def __init__(self, neighbours: Joined, tables: Tables, starts: Configuration, eager: Sequence[int]) -> None:
        self.state = State.RUNNING
        self.expansions = 0
        self.steps: Steps = []
        self._neighbours = neighbours
        self._eager = tuple(eager)
        nowhere = [0] * len(neighbours)
        self._tables = [table if robot in eager else nowhere for robot, table in enumerate(tables)]
        self._parents: dict[Configuration, Configuration | None] = {starts: None}
        self._seen = {self._alike(starts)}
        self._open = [(self._left(starts), 0, starts)]

    def advance(self, expansions: int) -> State:
        """Open at most that many joint positions more; return how the search stands."""
        end = self.expansions + expansions
        while self.state is State.RUNNING and self.expansions < end and len(self._parents) < MOST:
            if not self._open:
                self.state = State.UNSOLVABLE
                break
            left, _, at = heappop(self._open)
            self.expansions += 1
            if left == 0:
                self.steps = self._run_to(at)
                self.state = State.SOLVED
                break
            taken = set(at)
            for robot, cell in enumerate(at):
                table = self._tables[robot]
                for other in self._neighbours[cell]:
                    if other in taken:
                        continue
                    following = (*at[:robot], other, *at[robot + 1 :])
                    alike = self._alike(following)
                    if alike not in self._seen:
                        self._seen.add(alike)
                        self._parents[following] = at
                        heappush(self._open, (left + table[other] - table[cell], len(self._parents), following))
        return self.state

    def _alike(self, at: Configuration) -> object:
        """Return what a position has in common with those in which others that do not care have changed places."""
        return frozenset(at), tuple(at[robot] for robot in self._eager)

    def _left(self, at: Configuration) -> int:
        return sum(table[cell] for table, cell in zip(self._tables, at, strict=True))

    def _run_to(self, at: Configuration) -> Steps:
        steps = [at]
        while (before := self._parents[steps[-1]]) is not None:
            steps.append(before)
        return steps[::-1]
