"""A* on a grid: 8-connected, no corner cutting, lengths in cells.

The searches are compiled and use integers only, so that every process and machine finds the same path. A* (Hart,
Nilsson & Raphael 1968) with a bucket queue. f never decreases along a path, so all open entries are within a few
buckets of the current one. A ring of buckets adds and removes an entry in constant time. Within a bucket the last
entry comes out first. A cell that is reached by a shorter path is opened again, so this order does not affect the
optimum.

Lengths: a straight step counts 33461 and a diagonal one 47321. The ratio is a convergent of sqrt 2, that is, a best
approximation: it orders two paths as their true lengths do, unless their diagonal steps differ by 33461 or more. Even
then the error is less than 3e-10 of the length.

A cell's search state is one number: query stamp (15 bits), cost so far (40), closed (1), direction of entry (4).
"""

from collections.abc import Callable
from math import sqrt

import numpy as np
from numba import int16, int64, njit, uint8
from numpy.typing import NDArray

from swarm.maps.occupancy import Cell
from swarm.planning.steps import COLUMN_STEP, LOWEST, NATURAL, NONE, ONWARD, ROW_STEP, Bits, legal_moves

STRAIGHT, DIAGONAL = 33461, 47321
COARSE_STRAIGHT, COARSE_DIAGONAL = 985, 1393  # the same, where cells have costs
STAMPS = 1 << 15  # number of queries after which the states are cleared
RING = 64  # buckets; one step raises f by fewer buckets than this
SHIFT = 13  # width of a bucket: 2^13 / 33461, a quarter of a cell
COARSE_SHIFT = 15  # the same width for costs with UNIT 64
NOWHERE = np.int64(1 << 60)

SQRT2 = sqrt(2.0)
NO_COSTS = np.empty(0, np.int16)

Integers = NDArray[np.int64]
Search = Callable[..., int]  # a compiled search


@njit(int64(int64, int64, int64, int64), cache=True, error_model="numpy", inline="always")
def _octile(down: int, across: int, straight: int, diagonal: int) -> int:
    down, across = abs(down), abs(across)
    return straight * (max(down, across) - min(down, across)) + diagonal * min(down, across)


def _compile_search(weighted: bool) -> Search:
    """Return the compiled search, for cells of equal cost or for weighted cells."""
    table = ONWARD if weighted else NATURAL
    shift = COARSE_SHIFT if weighted else SHIFT
    per_straight, per_diagonal = (COARSE_STRAIGHT, COARSE_DIAGONAL) if weighted else (STRAIGHT, DIAGONAL)

    @njit(
        int64(uint8[::1], int16[::1], int64, int64, int64, int64, int64, int64[::1], int64, int64[:, ::1], int64[::1]),
        cache=True,
        error_model="numpy",
    )
    def search(
        moves: Bits,
        costs: NDArray[np.int16],
        unit: int,
        rows: int,
        columns: int,
        start: int,
        goal: int,
        state: Integers,
        stamp: int,
        entries: Integers,
        counts: Integers,
    ) -> int:
        """Return the least cost from start to goal, or -1 if there is no path; ``trace`` reads the path from ``state``.

        With costs, a step counts the mean of its two cells' costs. Each cost is from ``unit`` to 7 * ``unit``, since a
        step may raise f by at most ``RING`` buckets. ``entries`` (n, 2) is memory for the queue. ``counts`` receives
        the number of expansions and the number of queue entries needed.
        """
        scale = 2 * unit if weighted else 1
        straight, diagonal = scale * per_straight, scale * per_diagonal
        step = np.empty(8, np.int64)
        price = np.empty(8, np.int64)
        for k in range(8):
            step[k] = ROW_STEP[k] * columns + COLUMN_STEP[k]
            price[k] = per_diagonal if k & 1 else per_straight
        head = np.full(RING, -1, np.int64)
        room = entries.shape[0]
        spare, used, waiting, expanded = -1, 0, 0, 0
        goal_row, goal_column = goal // columns, goal % columns
        lowest_f = _octile(start // columns - goal_row, start % columns - goal_column, straight, diagonal)
        best = NOWHERE
        mask40 = (1 << 40) - 1

        state[start] = stamp << 48 | NONE
        entries[0, 0] = start
        entries[0, 1] = -1
        head[0] = 0
        used = waiting = 1
        bucket = 0
        while waiting:
            slot = head[bucket & (RING - 1)]
            if slot < 0:
                bucket += 1
                if lowest_f + (bucket << shift) >= best:
                    break
                continue
            u = entries[slot, 0]
            head[bucket & (RING - 1)] = entries[slot, 1]
            entries[slot, 1] = spare
            spare = slot
            waiting -= 1
            here = state[u]
            if here & 16:
                continue
            state[u] = here | 16
            cost = here >> 8 & mask40
            row = u // columns
            column = u - row * columns
            down, across = row - goal_row, column - goal_column
            if cost + _octile(down, across, straight, diagonal) >= best:
                continue
            expanded += 1
            left = np.int64(table[(here & 15) << 8 | moves[u]])
            while left:
                k = LOWEST[left & -left]
                left &= left - 1
                v = u + step[k]
                onward = cost + (price[k] * (costs[u] + costs[v]) if weighted else price[k])
                there = state[v]
                if there >> 48 == stamp and there >> 8 & mask40 <= onward:
                    continue
                f = onward + _octile(down + ROW_STEP[k], across + COLUMN_STEP[k], straight, diagonal)
                if f >= best:
                    continue
                state[v] = stamp << 48 | onward << 8 | k
                if v == goal:
                    best = onward
                    continue
                if spare >= 0:
                    slot = spare
                    spare = entries[slot, 1]
                else:
                    if used == room:
                        wider = np.empty((2 * room, 2), np.int64)
                        wider[:room] = entries
                        entries = wider
                        room *= 2
                    slot = used
                    used += 1
                ring = (f - lowest_f >> shift) & (RING - 1)
                entries[slot, 0] = v
                entries[slot, 1] = head[ring]
                head[ring] = slot
                waiting += 1
        counts[0] = expanded
        counts[1] = used
        if start == goal:
            return 0
        return int(best) if best < NOWHERE else -1

    return search


search = _compile_search(weighted=False)
search_costs = _compile_search(weighted=True)


@njit(int64(int64, int64, int64, int64[::1], int64[::1]), cache=True, error_model="numpy")
def trace(columns: int, start: int, goal: int, state: Integers, cells: Integers) -> int:
    """Write the path of the last search, from goal to start, into ``cells``; return the number of its steps."""
    steps = 0
    u = goal
    cells[0] = u
    while u != start:
        k = state[u] & 15
        u -= ROW_STEP[k] * columns + COLUMN_STEP[k]
        steps += 1
        cells[steps] = u
    return steps


class Lattice:
    """The legal steps of one grid, and the working memory of a search; build it once for many searches.

    Not thread-safe: all searches share the working memory.
    """

    def __init__(self, free: NDArray[np.bool_], moves: NDArray[np.uint8]) -> None:
        self.free = free  # (rows, columns)
        self.moves = moves  # (rows, columns): bit k set where a step in direction k is legal
        self.shape: Cell = (int(moves.shape[0]), int(moves.shape[1]))
        self.expanded = 0  # cells the last search expanded
        self._flat = np.ascontiguousarray(moves).reshape(-1)
        self._state = np.zeros(moves.size, np.int64)
        self._entries = np.empty((1024, 2), np.int64)  # a search that needs more leaves room for as many
        self._counts = np.zeros(2, np.int64)
        self._stamp = 0

    @classmethod
    def of(cls, free: NDArray[np.bool_]) -> "Lattice":
        """Return the lattice of the legal steps between free cells; ``free`` is (rows, columns)."""
        moves = np.empty(free.shape, np.uint8)
        legal_moves(np.ascontiguousarray(free, dtype=np.bool_).view(np.uint8), moves)
        return cls(free, moves)

    def shortest(self, start: Cell, goal: Cell) -> tuple[float, list[Cell]] | None:
        """Return the shortest path: its length in cells, and its cells from start to goal; None if there is none.

        There is no path if the start or the goal is not free or is outside the grid.
        """
        return self._run_search(search, NO_COSTS, 1, start, goal)

    def cheapest(self, costs: NDArray[np.int16], unit: int, start: Cell, goal: Cell) -> tuple[float, list[Cell]] | None:
        """Return the cheapest path under ``costs`` (rows, columns), each from ``unit`` to 7 * ``unit``; None if none.

        The result is as in ``shortest``: the length is geometric, in cells, and does not include the costs.
        """
        return self._run_search(search_costs, costs.reshape(-1), unit, start, goal)

    def _run_search(
        self, kernel: Search, costs: NDArray[np.int16], unit: int, start: Cell, goal: Cell
    ) -> tuple[float, list[Cell]] | None:
        if not (self._stands(start) and self._stands(goal)):
            return None
        rows, columns = self.shape
        first, last = start[0] * columns + start[1], goal[0] * columns + goal[1]
        stamp = self._next_stamp()
        args = (self._state, stamp, self._entries, self._counts)
        return self._trace_path(kernel(self._flat, costs, unit, rows, columns, first, last, *args), first, last)

    def _stands(self, cell: Cell) -> bool:
        return 0 <= cell[0] < self.shape[0] and 0 <= cell[1] < self.shape[1] and bool(self.free[cell])

    def _next_stamp(self) -> int:
        self._stamp += 1
        if self._stamp == STAMPS:
            self._state[:] = 0
            self._stamp = 1
        return self._stamp

    def _trace_path(self, cost: int, first: int, last: int) -> tuple[float, list[Cell]] | None:
        self.expanded = int(self._counts[0])
        if self._counts[1] > len(self._entries):
            self._entries = np.empty((int(self._counts[1]), 2), np.int64)
        if cost < 0:
            return None
        cells = np.empty(self._counts[0] + 2, np.int64)
        steps = trace(self.shape[1], first, last, self._state, cells)
        rows, columns = np.divmod(cells[steps::-1], self.shape[1])
        diagonal = int(np.count_nonzero((rows[1:] != rows[:-1]) & (columns[1:] != columns[:-1])))
        return steps - diagonal + diagonal * SQRT2, list(zip(rows.tolist(), columns.tolist(), strict=True))


def shortest(free: NDArray[np.bool_] | Lattice, start_cell: Cell, goal_cell: Cell) -> tuple[float, list[Cell]] | None:
    """Return the shortest 8-connected path that cuts no corner: its length in cells (a diagonal is sqrt 2), its cells.

    ``free`` is (rows, columns), or a ``Lattice`` of it if many paths are wanted. Returns None if there is no path.

    >>> shortest(np.ones((2, 3), dtype=bool), (0, 0), (1, 2))
    (2.414213562373095, [(0, 0), (1, 1), (1, 2)])
    """
    lattice = free if isinstance(free, Lattice) else Lattice.of(free)
    return lattice.shortest(start_cell, goal_cell)
