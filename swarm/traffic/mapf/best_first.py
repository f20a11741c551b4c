"""Best-first search over configurations, one robot moving at a time: for few robots in narrow places.

LaCAM searches depth first. It sometimes takes very long where two or three robots have to let each other pass. This
search keeps every configuration that it has seen. It is slow for many robots, but it ends: with a plan, or with the
proof that there is none. The configuration with the fewest steps left in total is expanded first (greedy best-first
search, Pearl 1984).

Configurations are kept as bytes: tuples and sets took five times the memory, and a process did not give it back.
"""

from array import array
from collections.abc import Sequence
from heapq import heappop, heappush
from typing import Final

from swarm.traffic.mapf.lacam import SearchState, Steps
from swarm.traffic.mapf.pibt import Configuration, Floors, Joined, Tables

MOST_KEPT: Final = 60_000  # configurations kept
NUMBERS: Final = 1 << 20  # more than the numbers of configurations


class BestFirst:
    """One search from ``starts``; ``tables[i]`` holds the steps of robot i to its goal from every cell.

    The search is solved when each robot is at its goal, where its table is 0. ``floors`` are the cells that are joined
    for each robot, by default ``neighbours`` for all.
    """

    def __init__(self, neighbours: Joined, tables: Tables, starts: Configuration, floors: Floors = ()) -> None:
        self.state = SearchState.RUNNING
        self.expansions = 0
        self.steps: Steps = []
        self._floors = floors or [neighbours] * len(starts)
        self._tables = tables
        self._kept = [_pack_state(starts)]  # configurations, by number
        self._parents = array("i", [-1])  # number of the configuration before each
        self._seen = {_pack_state(starts)}
        self._open = [self._steps_left(starts) * NUMBERS]  # steps left * NUMBERS + number

    def advance(self, expansions: int) -> SearchState:
        """Expand at most ``expansions`` more configurations; return the state of the search."""
        end = self.expansions + expansions
        while self.state is SearchState.RUNNING and self.expansions < end and len(self._kept) < MOST_KEPT:
            if not self._open:
                self.state = SearchState.UNSOLVABLE
                break
            left, number = divmod(heappop(self._open), NUMBERS)
            self.expansions += 1
            if left == 0:
                self.steps = self._reconstruct_steps(number)
                self.state = SearchState.SOLVED
                break
            at = _unpack_state(self._kept[number])
            taken = set(at)
            for robot, cell in enumerate(at):
                table = self._tables[robot]
                for other in self._floors[robot][cell]:
                    if other in taken:
                        continue
                    following = _pack_state((*at[:robot], other, *at[robot + 1 :]))
                    if following not in self._seen:
                        self._seen.add(following)
                        heappush(self._open, (left + table[other] - table[cell]) * NUMBERS + len(self._kept))
                        self._kept.append(following)
                        self._parents.append(number)
        return self.state

    def _steps_left(self, at: Configuration) -> int:
        return sum(table[cell] for table, cell in zip(self._tables, at, strict=True))

    def _reconstruct_steps(self, number: int) -> Steps:
        steps = []
        while number >= 0:
            steps.append(_unpack_state(self._kept[number]))
            number = self._parents[number]
        return steps[::-1]


def _pack_state(cells: Sequence[int]) -> bytes:
    return array("i", cells).tobytes()


def _unpack_state(packed: bytes) -> Configuration:
    cells = array("i")
    cells.frombytes(packed)
    return tuple(cells)
