"""One step of all robots: priority inheritance with backtracking, and the swap operation.

PIBT: Okumura et al., Artificial Intelligence 310, 2022. Swap: Okumura, "Improving LaCAM for scalable eventually optimal
multi-agent pathfinding", IJCAI 2023. One addition: a ring of robots that all move into each other's cells at once
is refused. Each would enter only after the next one has left, so all would wait forever.

Robots are numbered 0..N-1 here, cells are numbers of a CellMap.
"""

from collections.abc import Sequence
from enum import Enum
from random import Random
from typing import Final

Joined = Sequence[Sequence[int]]  # [cell] -> joined cells
Floors = Sequence[Joined]  # [robot]: the cells that are joined for it
Tables = Sequence[Sequence[int]]  # [robot][cell] -> steps to the robot's goal
Configuration = tuple[int, ...]  # [robot] -> cell

NOBODY: Final = -1
NOWHERE: Final = -1
UNDECIDED: Final = -1
TURN_COST: Final = 0.5  # steps, added to a cell that is not favoured; less than 1, so that it only breaks ties


class TieBreak(Enum):
    """Which of two cells equally near the goal is preferred."""

    RANDOM = "random"
    STRAIGHT = "straight on"


class StepGenerator:
    """Computes the next configuration of all robots from the present one, under priorities and constraints (orders)."""

    def __init__(
        self, neighbours: Joined, tables: Tables, goals: Configuration, *, ties: TieBreak, random: Random,
        floors: Floors = (),
    ) -> None:  # fmt: skip
        """Begin; ``floors`` are the cells that are joined for each robot, by default ``neighbours`` for all."""
        self.floors = floors or [neighbours] * len(goals)
        self.tables = tables
        self.goals = goals
        self.ties = ties
        self.random = random
        self._now: list[int] = [NOBODY] * len(neighbours)  # [cell] -> robot that stands there
        self._next: list[int] = [NOBODY] * len(neighbours)  # [cell] -> robot that will stand there
        self._to: list[int] = [UNDECIDED] * len(goals)  # [robot] -> cell that it goes to
        self._at: Configuration = ()
        self._before: Configuration = ()

    def step(
        self, at: Configuration, before: Configuration, priority: Sequence[int], orders: Sequence[tuple[int, int]]
    ) -> Configuration | None:
        """Return the configuration a step later, or None if the priority and the orders (robot, cell) forbid it."""
        self._at, self._before = at, before
        now, then, to = self._now, self._next, self._to
        for robot, cell in enumerate(at):
            now[cell] = robot
        try:
            return self._assign_cells(priority, orders)
        finally:
            for robot, cell in enumerate(at):
                now[cell] = NOBODY
                if to[robot] != UNDECIDED:
                    then[to[robot]] = NOBODY
                    to[robot] = UNDECIDED

    def _assign_cells(self, priority: Sequence[int], orders: Sequence[tuple[int, int]]) -> Configuration | None:
        to = self._to
        for robot, cell in orders:
            if self._next[cell] != NOBODY or self._has_conflict(robot, cell):
                return None
            to[robot] = cell
            self._next[cell] = robot
        for robot in priority:
            if to[robot] == UNDECIDED and not self._choose_next_cell(robot):
                return None
        return tuple(to)

    def _has_conflict(self, robot: int, cell: int) -> bool:
        """Return True if entering the cell would swap places with another robot, or close a ring of movers."""
        home = self._at[robot]
        if cell == home:
            return False
        now, to = self._now, self._to
        other = now[cell]
        while other != NOBODY:
            cell = to[other]
            if cell == home:
                return True
            if cell == UNDECIDED or now[cell] == other:
                return False
            other = now[cell]
        return False

    def _choose_next_cell(self, robot: int) -> bool:
        """Return True if a robot finds a cell, pushing the robots in its way; if it finds none, it stays."""
        home = self._at[robot]
        wishes = self._cells_by_preference(robot)
        partner = self._swap_partner(robot, wishes[0]) if wishes[0] != home else NOBODY
        if partner != NOBODY:
            wishes.reverse()
        now, then, to = self._now, self._next, self._to
        for rank, cell in enumerate(wishes):
            other = now[cell]
            if then[cell] != NOBODY or (other not in (NOBODY, robot) and self._has_conflict(robot, cell)):
                continue
            then[cell] = robot
            to[robot] = cell
            if other not in (NOBODY, robot) and to[other] == UNDECIDED and not self._choose_next_cell(other):
                continue
            if (
                rank == 0
                and partner != NOBODY
                and to[partner] == UNDECIDED
                and then[home] == NOBODY
                and not self._has_conflict(partner, home)
            ):
                to[partner] = home
                then[home] = partner
            return True
        then[home] = robot
        to[robot] = home
        return False

    def _cells_by_preference(self, robot: int) -> list[int]:
        """Return the cells it can go to, nearest to the goal first; ties as ``ties`` says, then by chance."""
        home = self._at[robot]
        table, chance = self.tables[robot], self.random.random
        straight_on = self.ties is TieBreak.STRAIGHT and self._before[robot] != home
        favoured = 2 * home - self._before[robot] if straight_on else NOWHERE
        cost = {
            cell: table[cell] + (0.4 * chance() if cell == favoured else TURN_COST + 0.4 * chance())
            for cell in self.floors[robot][home]
        }
        cost[home] = float(table[home])
        return sorted(cost, key=cost.__getitem__)

    # ---- swap: two robots in a passage change places where it widens: the one in front backs out

    def _swap_partner(self, robot: int, wish: int) -> int:
        """Return the robot to pull along while backing out to another cell, or NOBODY."""
        home = self._at[robot]
        now = self._now
        other = now[wish]
        if (
            other != NOBODY
            and self._to[other] == UNDECIDED
            and self._must_swap(robot, other, home, wish)
            and self._can_swap(robot, wish, home)
        ):
            return other
        for cell in self.floors[robot][home]:  # a robot behind wants to pass: make room
            other = now[cell]
            if (
                other != NOBODY
                and cell != wish
                and self._to[other] == UNDECIDED
                and self._must_swap(other, robot, home, wish)
                and self._can_swap(robot, wish, home)
            ):
                return other
        return NOBODY

    def _count_ways_on(self, puller: int, pusher_at: int, puller_at: int) -> tuple[int, int]:
        """Return the number of ways on for the puller, except dead ends whose owner rests, and the last of them."""
        ways, onward, joined = 0, UNDECIDED, self.floors[puller]
        for cell in joined[puller_at]:
            if cell == pusher_at:
                continue
            other = self._now[cell]
            if other != NOBODY and len(joined[cell]) == 1 and self.goals[other] == cell:
                continue
            ways, onward = ways + 1, cell
        return ways, onward

    def _must_swap(self, pusher: int, puller: int, pusher_at: int, puller_at: int) -> bool:
        """Return True if two robots must change places to reach their goals: no side way opens while one pushes."""
        push, pull = self.tables[pusher], self.tables[puller]
        while push[puller_at] < push[pusher_at]:
            ways, onward = self._count_ways_on(puller, pusher_at, puller_at)
            if ways >= 2:
                return False
            if ways == 0:
                break
            pusher_at, puller_at = puller_at, onward
        return pull[pusher_at] < pull[puller_at] and (push[pusher_at] == 0 or push[puller_at] < push[pusher_at])

    def _can_swap(self, puller: int, pusher_from: int, puller_from: int) -> bool:
        """Return True if the two robots reach a junction to change places at while one pulls the other back."""
        pusher_at, puller_at = pusher_from, puller_from
        while puller_at != pusher_from:
            ways, onward = self._count_ways_on(puller, pusher_at, puller_at)
            if ways != 1:
                return ways >= 2
            pusher_at, puller_at = puller_at, onward
            if puller_at == puller_from:
                return False
        return False
