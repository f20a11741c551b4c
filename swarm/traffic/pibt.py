"""One step for everybody: priority inheritance with backtracking, and the swap operation.

PIBT: Okumura et al., Artificial Intelligence 310, 2022. Swap: Okumura, "Improving LaCAM for scalable eventually optimal
multi-agent pathfinding", IJCAI 2023. Apart from these, a ring of robots that all move into each other's cell at once is
refused: carried out as "enter after the other has left" each would wait for the next for ever.

Robots are numbered 0..N-1 here, cells are numbers of a CellMap.
"""

from collections.abc import Sequence
from enum import Enum
from random import Random
from typing import Final

Joined = Sequence[Sequence[int]]  # [cell] -> joined cells
Tables = Sequence[Sequence[int]]  # [robot][cell] -> steps to the robot's goal
Configuration = tuple[int, ...]  # [robot] -> cell

NOBODY: Final = -1
UNDECIDED: Final = -1
TURN_COST: Final = 0.5  # of a tie: between straight on (0) and nothing known; less than a step


class Ties(Enum):
    """Which of two cells equally near the goal is taken."""

    RANDOM = "random"
    STRAIGHT = "straight on"
    LANES = "with the lane"  # rows lead east and west, columns north and south, in turn: opposite streams keep apart


class StepGenerator:
    """Makes the next positions of all robots from the present ones, under priorities and some orders given."""

    def __init__(self, neighbours: Joined, tables: Tables, goals: Configuration, *, ties: Ties, random: Random) -> None:
        self.neighbours = neighbours
        self.tables = tables
        self.goals = goals
        self.ties = ties
        self.lanes = lanes(neighbours) if ties is Ties.LANES else ()
        self.random = random
        self._now: list[int] = [NOBODY] * len(neighbours)  # [cell] -> who stands there
        self._next: list[int] = [NOBODY] * len(neighbours)  # [cell] -> who will
        self._to: list[int] = [UNDECIDED] * len(goals)  # [robot] -> where it goes
        self._at: Configuration = ()
        self._before: Configuration = ()

    def step(
        self, at: Configuration, before: Configuration, priority: Sequence[int], orders: Sequence[tuple[int, int]]
    ) -> Configuration | None:
        """Move everybody one step, or None where this priority and these orders (robot, cell) do not allow it."""
        self._at, self._before = at, before
        now, then, to = self._now, self._next, self._to
        for robot, cell in enumerate(at):
            now[cell] = robot
        try:
            return self._fill(priority, orders)
        finally:
            for robot, cell in enumerate(at):
                now[cell] = NOBODY
                if to[robot] != UNDECIDED:
                    then[to[robot]] = NOBODY
                    to[robot] = UNDECIDED

    def _fill(self, priority: Sequence[int], orders: Sequence[tuple[int, int]]) -> Configuration | None:
        to = self._to
        for robot, cell in orders:
            if self._next[cell] != NOBODY or self._clashes(robot, cell):
                return None
            to[robot] = cell
            self._next[cell] = robot
        for robot in priority:
            if to[robot] == UNDECIDED and not self._move(robot):
                return None
        return tuple(to)

    def _clashes(self, robot: int, cell: int) -> bool:
        """Return True if entering would swap places with somebody, or close a ring of movers."""
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

    def _move(self, robot: int) -> bool:
        """Find a cell for a robot, pushing those in the way; on failure it stays and says so."""
        home = self._at[robot]
        wishes = self._wishes(robot)
        partner = self._swap_partner(robot, wishes[0]) if wishes[0] != home else NOBODY
        if partner != NOBODY:
            wishes.reverse()
        now, then, to = self._now, self._next, self._to
        for rank, cell in enumerate(wishes):
            other = now[cell]
            if then[cell] != NOBODY or (other not in (NOBODY, robot) and self._clashes(robot, cell)):
                continue
            then[cell] = robot
            to[robot] = cell
            if other not in (NOBODY, robot) and to[other] == UNDECIDED and not self._move(other):
                continue
            if (
                rank == 0
                and partner != NOBODY
                and to[partner] == UNDECIDED
                and then[home] == NOBODY
                and not self._clashes(partner, home)
            ):
                to[partner] = home
                then[home] = partner
            return True
        then[home] = robot
        to[robot] = home
        return False

    def _wishes(self, robot: int) -> list[int]:
        """Sort the cells it can go to: nearer the goal first; ties as ``ties`` says, then by chance."""
        home = self._at[robot]
        table, chance = self.tables[robot], self.random.random
        if self.ties is Ties.LANES:
            favoured: tuple[int, ...] = self.lanes[home]
        elif self.ties is Ties.STRAIGHT and self._before[robot] != home:
            favoured = (2 * home - self._before[robot],)
        else:
            favoured = ()
        cost = {
            cell: table[cell] + (0.4 * chance() if cell in favoured else TURN_COST + 0.4 * chance())
            for cell in self.neighbours[home]
        }
        cost[home] = float(table[home])
        return sorted(cost, key=cost.__getitem__)

    # ---- swap: two robots in a passage change places where it widens, the one in front backing out

    def _swap_partner(self, robot: int, wish: int) -> int:
        """Name the robot to pull along while backing out to another cell, or NOBODY."""
        home = self._at[robot]
        now = self._now
        other = now[wish]
        if (
            other != NOBODY
            and self._to[other] == UNDECIDED
            and self._must_swap(robot, other, home, wish)
            and self._can_swap(wish, home)
        ):
            return other
        for cell in self.neighbours[home]:  # somebody behind wants past: make room
            other = now[cell]
            if (
                other != NOBODY
                and cell != wish
                and self._to[other] == UNDECIDED
                and self._must_swap(other, robot, home, wish)
                and self._can_swap(wish, home)
            ):
                return other
        return NOBODY

    def _onward(self, pusher_at: int, puller_at: int) -> tuple[int, int]:
        """Count the ways on for the puller, dead ends with their owner at rest left out, and name the last of them."""
        ways, onward = 0, UNDECIDED
        for cell in self.neighbours[puller_at]:
            if cell == pusher_at:
                continue
            other = self._now[cell]
            if other != NOBODY and len(self.neighbours[cell]) == 1 and self.goals[other] == cell:
                continue
            ways, onward = ways + 1, cell
        return ways, onward

    def _must_swap(self, pusher: int, puller: int, pusher_at: int, puller_at: int) -> bool:
        """Push in thought until a side way opens: is changing places needed to get both to their goals?"""
        push, pull = self.tables[pusher], self.tables[puller]
        while push[puller_at] < push[pusher_at]:
            ways, onward = self._onward(pusher_at, puller_at)
            if ways >= 2:
                return False
            if ways == 0:
                break
            pusher_at, puller_at = puller_at, onward
        return pull[pusher_at] < pull[puller_at] and (push[pusher_at] == 0 or push[puller_at] < push[pusher_at])

    def _can_swap(self, pusher_from: int, puller_from: int) -> bool:
        """Pull back in thought: is there a junction where the two can change places?"""
        pusher_at, puller_at = pusher_from, puller_from
        while puller_at != pusher_from:
            ways, onward = self._onward(pusher_at, puller_at)
            if ways != 1:
                return ways >= 2
            pusher_at, puller_at = puller_at, onward
            if puller_at == puller_from:
                return False
        return False


def lanes(neighbours: Joined) -> tuple[tuple[int, int], ...]:
    """Return the two ways each cell leads: even rows towards +1, odd ones back; odd columns up, even ones down."""
    columns = max((abs(other - cell) for cell, near in enumerate(neighbours) for other in near), default=1)
    return tuple(
        (
            cell + (1 if cell // columns % 2 == 0 else -1),
            cell + (columns if cell % columns % 2 == 1 else -columns),
        )
        for cell in range(len(neighbours))
    )
