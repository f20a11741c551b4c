"""LaCAM: lazy constraints addition search for many robots at once (Okumura, AAAI 2023).

The search goes over configurations, depth first. It expands a configuration by one step of PIBT. If that leads to no
new configuration, the next expansion adds a constraint ("robot 3 goes there"), until every possible step has been
tried. So it finds a plan if there is one. If nothing is left to expand, it is proven that there is no plan without
rings of movers.

The search counts its expansions and stops when told. It can continue later from where it stopped, and its result is the
same on every machine.
"""

from array import array
from collections.abc import Iterable, Sequence
from enum import Enum
from random import Random
from typing import Final

from swarm.traffic.mapf.pibt import Configuration, Floors, Joined, StepGenerator, Tables, TieBreak

Orders = tuple[tuple[int, int], ...]  # constraints: (robot, cell that it goes to)
Steps = list[Configuration]  # configurations, one per time step
# [robot][cell] -> steps to a cell that it visits on its way, its via; None: it visits none
Vias = Sequence[Sequence[int] | None]
Been = tuple[bool, ...]  # [robot] -> it has visited that cell, or has none to visit; (): nobody has any


class SearchState(Enum):
    """The state of a search."""

    RUNNING = "running"
    SOLVED = "solved"
    UNSOLVABLE = "unsolvable"  # proven: every configuration within reach was expanded in every way


class _LacamNode:
    """One configuration: how it was reached, the priority of the robots, and the constraints still to be tried.

    A search keeps thousands: an array and a short list need a third of the memory of a list of floats and a deque.
    """

    __slots__ = ("at", "been", "orders", "parent", "priority", "urgency")

    def __init__(self, at: Configuration, been: Been, parent: "_LacamNode | None", urgency: Iterable[float]) -> None:
        self.at = at
        self.been = been
        self.parent = parent
        self.urgency = array("d", urgency)
        self.priority = sorted(range(len(at)), key=self.urgency.__getitem__, reverse=True)
        self.orders: list[Orders] = [()]  # the first is tried next


class LacamSearch:
    """One search from ``starts`` to ``goals``; ``tables[i]`` holds the steps of robot i to its goal from every cell.

    ``floors`` are the cells that are joined for each robot, by default ``neighbours`` for all.

    Robots with a via visit that cell first. ``near_first``: at first, those nearest to theirs have priority, otherwise
    those farthest off.
    """

    def __init__(
        self,
        neighbours: Joined,
        tables: Tables,
        starts: Configuration,
        goals: Configuration,
        *,
        ties: TieBreak,
        random: Random,
        vias: Vias = (),
        near_first: bool = False,
        floors: Floors = (),
    ) -> None:
        self.state = SearchState.RUNNING
        self.expansions = 0
        self.steps: Steps = []
        self._goals: Final = goals
        self._floors: Final = floors or [neighbours] * len(starts)
        self._random: Final = random
        self._generator: Final = StepGenerator(neighbours, tables, goals, ties=ties, random=random, floors=self._floors)
        self._tables: Final = tables
        self._vias: Final = vias
        been = self._visited_vias((), starts)
        steps = [table[start] for table, start in zip(self._tables_for(been), starts, strict=True)]
        farthest = 1 + max(steps, default=0)
        root = _LacamNode(
            starts, been, None, [(farthest - 1 - left if near_first else left) / farthest for left in steps]
        )
        self._open: list[_LacamNode] = [root]
        self._known: dict[tuple[Configuration, Been], _LacamNode] = {(starts, been): root}
        if any(table[start] >= len(neighbours) for table, start in zip(tables, starts, strict=True)):
            self.state = SearchState.UNSOLVABLE  # no way leads to a goal

    def advance(self, expansions: int) -> SearchState:
        """Expand at most ``expansions`` more configurations; ``steps`` holds the plan once solved."""
        limit = self.expansions + expansions
        while self.state is SearchState.RUNNING and self.expansions < limit:
            self._expand()
        return self.state

    def _expand(self) -> None:
        if not self._open:
            self.state = SearchState.UNSOLVABLE
            return
        node = self._open[-1]
        if node.at == self._goals and all(node.been):
            self.steps = _way_to(node)
            self.state = SearchState.SOLVED
            return
        if not node.orders:
            self._open.pop()
            return
        self.expansions += 1
        orders = node.orders.pop(0)
        self._add_orders(node, orders)
        before = node.parent.at if node.parent else node.at
        self._generator.tables = self._tables_for(node.been)
        at = self._generator.step(node.at, before, node.priority, orders)
        if at is None:
            return
        been = self._visited_vias(node.been, at)
        known = self._known.get((at, been))
        if known is None:
            known = _LacamNode(at, been, node, self._urgency(node, at, been))
            self._known[at, been] = known
        self._open.append(known)

    def _visited_vias(self, before: Been, at: Configuration) -> Been:
        """Return who has visited its via, a step later."""
        if not self._vias:
            return ()
        return tuple(
            [
                via is None or via[cell] == 0 or (bool(before) and before[robot])
                for robot, (via, cell) in enumerate(zip(self._vias, at, strict=True))
            ]
        )

    def _tables_for(self, been: Been) -> Tables:
        """Return the steps of each robot to where it goes next."""
        if all(been):
            return self._tables
        return [
            table if there or via is None else via
            for table, via, there in zip(self._tables, self._vias, been, strict=True)
        ]

    def _add_orders(self, node: _LacamNode, orders: Orders) -> None:
        """Queue every constraint on the next robot, on top of these constraints, for later expansions."""
        if len(orders) == len(node.at):
            return
        robot = node.priority[len(orders)]
        home = node.at[robot]
        cells = [*self._floors[robot][home], home]
        self._random.shuffle(cells)
        node.orders.extend([(*orders, (robot, cell)) for cell in cells])

    def _urgency(self, node: _LacamNode, at: Configuration, been: Been) -> list[float]:
        """Return the urgencies one step later: robots not at their goals gain 1, robots at their goals fall below 1."""
        return [
            urgency % 1.0 if cell == goal and (not been or been[robot]) else urgency + 1.0
            for robot, (urgency, cell, goal) in enumerate(zip(node.urgency, at, self._goals, strict=True))
        ]


def _way_to(node: _LacamNode) -> Steps:
    steps = [node.at]
    while node.parent:
        node = node.parent
        steps.append(node.at)
    steps.reverse()
    return steps


def remove_detours(steps: Sequence[Configuration], vias: Sequence[int] = ()) -> Steps:
    """Return the plan without detours: a robot stays in a cell if it would return before another robot enters it.

    No other robot is affected: the cell was free, and cells that the robot no longer enters stay free. ``vias`` are the
    cells that the robots visit on their ways: a detour through such a cell stays.
    """
    if not steps:
        return []
    plan = [list(at) for at in steps]
    changed = True
    while changed:
        changed = False
        last: dict[int, tuple[int, int]] = {}  # cell -> (who stood there last, when)
        for time, at in enumerate(plan):
            for robot, cell in enumerate(at):
                who, when = last.get(cell, (robot, time))
                if (
                    who == robot
                    and time - when > 1
                    and not (vias and any(plan[between][robot] == vias[robot] for between in range(when + 1, time)))
                ):
                    for between in range(when + 1, time):
                        gone = plan[between][robot]
                        if last.get(gone) == (robot, between):
                            del last[gone]
                        plan[between][robot] = cell
                    changed = True
                last[cell] = (robot, time)
    while len(plan) > 1 and plan[-1] == plan[-2]:
        plan.pop()
    return [tuple(at) for at in plan]
