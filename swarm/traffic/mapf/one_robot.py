"""A plan that brings one robot to its goal while the others only make room: found, or proven not to exist.

Motion planning on a graph with one robot (Papadimitriou, Raghavan, Sudan and Tamaki, FOCS 1994): the other robots are
alike. While the one robot stands, it cuts the graph into parts, and inside a part the others can take any places. So a
state is the robot's cell and how many others are in each part: few states, where a search over configurations has
millions. The search is A* over the moves of all robots, one at a time.
"""

from collections import deque
from collections.abc import Collection, Iterator, Sequence
from heapq import heappop, heappush
from itertools import pairwise
from typing import Final, NamedTuple

from swarm.traffic.mapf.lacam import SearchState, Steps
from swarm.traffic.mapf.pibt import Configuration, Joined

Part = frozenset[int]  # cells that are joined without the robot's cell
VISITS: Final = 3  # visited cells and new nodes, for each robot, that take as long as one expansion of a configuration


class _OneRobotNode(NamedTuple):
    """A state that is still to be expanded: the robot's next cell, and how the others share the parts beside it."""

    at: Configuration  # before the others make room
    steps: int  # moves of all robots until then
    parent: int  # the expanded node before; -1: none
    to: int  # cell
    shares: tuple[int, ...]  # of the parts into which ``to`` cuts the part that it is in


class OneRobot:
    """One search from ``starts`` for ``robot``; ``table`` holds its steps to its goal from every cell."""

    def __init__(self, neighbours: Joined, table: Sequence[int], starts: Configuration, robot: int) -> None:
        self.state = SearchState.RUNNING
        self.expansions = 0
        self.steps: Steps = []
        self._neighbours = neighbours
        self._table = table
        self._robot = robot
        self._visits = 0
        self._parts: dict[tuple[int, int], tuple[Part, ...]] = {}
        self._found: list[tuple[int, Steps]] = []  # of each expanded node: the one before, and the steps from it
        self._seen: set[tuple[int, ...]] = set()
        self._nodes = [_OneRobotNode(starts, 0, -1, starts[robot], ())]
        self._open = [(table[starts[robot]], 0)]  # least steps in all, number of the node

    def advance(self, expansions: int) -> SearchState:
        """Spend about ``expansions`` more; return the state of the search."""
        end = self.expansions + expansions
        while self.state is SearchState.RUNNING and self.expansions < end:
            if not self._open:
                self.state = SearchState.UNSOLVABLE
                break
            self._visits = 0
            self._expand(self._nodes[heappop(self._open)[1]])
            self.expansions += 1 + self._visits // (VISITS * len(self._nodes[0].at))
        return self.state

    def _expand(self, node: _OneRobotNode) -> None:
        steps = self._configurations_of_move(node)
        at = steps[-1]
        here = at[self._robot]
        key = (here, *(sum(cell in part for cell in at) for part in self._parts_of_cut(here)))
        if key in self._seen:
            return
        self._seen.add(key)
        self._found.append((node.parent, steps[1:]))
        number, moves = len(self._found) - 1, node.steps + len(steps) - 1
        if self._table[here] == 0:
            self.steps = [self._nodes[0].at, *self._reconstruct_steps(number)]
            self.state = SearchState.SOLVED
            return
        for other in self._neighbours[here]:
            beside = self._parts_of_cut(here, other)
            now = [sum(cell in part for cell in at) for part in beside]
            count = sum(now) + (other in at)
            for shares in _shares(count, [len(part) for part in beside]):
                moved = sum(max(0, had - gets) for had, gets in zip(now, shares, strict=True)) + (other in at)
                least = moves + 1 + moved + self._table[other]
                heappush(self._open, (least, len(self._nodes)))
                self._nodes.append(_OneRobotNode(at, moves, number, other, shares))
                self._visits += 1

    def _configurations_of_move(self, node: _OneRobotNode) -> Steps:
        """Return the configurations from the node's to the one in which the robot has moved."""
        here, to = node.at[self._robot], node.to
        steps = [node.at]
        if here == to:
            return steps
        parts = self._parts_of_cut(here, to)
        taken = {cell: robot for robot, cell in enumerate(node.at)}
        left = [gets - sum(cell in taken for cell in part) for part, gets in zip(parts, node.shares, strict=True)]
        while to in taken or any(left):
            full = to in taken  # whoever is there goes on into a part that gets more; else one comes from another part
            ways = [
                (way, number)
                for number, part in enumerate(parts)
                if (left[number] > 0 if full else left[number] < 0)
                and (way := self._way(to, part, taken, to_free=full)) is not None
            ]
            way, number = min(ways, key=lambda one: (len(one[0]), one[1]))
            left[number] += -1 if full else 1
            pairs = list(pairwise(way)) if full else [(cell, before) for before, cell in pairwise(way)]
            for cell, following in reversed(pairs):
                robot = taken[following] = taken.pop(cell)
                steps.append(_move_robot(steps[-1], robot, following))
        steps.append(_move_robot(steps[-1], self._robot, to))
        return steps

    def _way(self, start: int, part: Part, taken: Collection[int], *, to_free: bool) -> list[int] | None:
        """Return the shortest way from a cell into a part, to its nearest free or else taken cell."""
        before = {start: -1}
        waiting = deque([start])
        while waiting:
            cell = waiting.popleft()
            if cell != start and (cell not in taken) == to_free:
                way = [cell]
                while before[way[-1]] >= 0:
                    way.append(before[way[-1]])
                return way[::-1]
            self._visits += 1
            for other in self._neighbours[cell]:
                if other in part and other not in before:
                    before[other] = cell
                    waiting.append(other)
        return None

    def _parts_of_cut(self, cell: int, other: int = -1) -> tuple[Part, ...]:
        """Return the parts into which a cell cuts the graph, or ``other`` the one of these parts that it is in."""
        if (cell, other) not in self._parts:
            begins = self._neighbours[cell if other < 0 else other]
            parts: list[Part] = []
            for begin in begins:
                if begin not in (cell, other) and not any(begin in part for part in parts):
                    parts.append(self._find_part(begin, (cell, other)))
            self._parts[cell, other] = tuple(parts)
        return self._parts[cell, other]

    def _find_part(self, begin: int, without: Collection[int]) -> Part:
        found, waiting = {begin}, [begin]
        while waiting:
            for other in self._neighbours[waiting.pop()]:
                if other not in found and other not in without:
                    found.add(other)
                    waiting.append(other)
        self._visits += len(found)
        return frozenset(found)

    def _reconstruct_steps(self, number: int) -> Steps:
        parts = []
        while number >= 0:
            number, steps = self._found[number]
            parts.append(steps)
        return [at for steps in reversed(parts) for at in steps]


def _shares(count: int, most: Sequence[int]) -> Iterator[tuple[int, ...]]:
    """Yield every way to share ``count`` robots among parts that have room for so many."""
    if not most:
        if count == 0:
            yield ()
        return
    rest = sum(most[1:])
    for first in range(max(0, count - rest), min(count, most[0]) + 1):
        for others in _shares(count - first, most[1:]):
            yield (first, *others)


def _move_robot(at: Configuration, robot: int, cell: int) -> Configuration:
    return (*at[:robot], cell, *at[robot + 1 :])
