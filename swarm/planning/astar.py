"""A* on a grid: 8-connected, no corner cutting, lengths in cells."""

from collections.abc import Callable
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from swarm.maps.occupancy import Cell
from swarm.planning.search import STAMPS, search, search_costs, trace
from swarm.planning.steps import legal_moves

SQRT2 = sqrt(2.0)
NO_COSTS = np.empty(0, np.int16)

Kernel = Callable[..., int]  # a compiled search


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
        return self._searched(search, NO_COSTS, 1, start, goal)

    def cheapest(self, costs: NDArray[np.int16], unit: int, start: Cell, goal: Cell) -> tuple[float, list[Cell]] | None:
        """Return the cheapest path under ``costs`` (rows, columns), each from ``unit`` to 7 * ``unit``; None if none.

        The result is as in ``shortest``: the length is geometric, in cells, and does not include the costs.
        """
        return self._searched(search_costs, costs.reshape(-1), unit, start, goal)

    def _searched(
        self, kernel: Kernel, costs: NDArray[np.int16], unit: int, start: Cell, goal: Cell
    ) -> tuple[float, list[Cell]] | None:
        if not (self._stands(start) and self._stands(goal)):
            return None
        rows, columns = self.shape
        first, last = start[0] * columns + start[1], goal[0] * columns + goal[1]
        stamp = self._next_stamp()
        args = (self._state, stamp, self._entries, self._counts)
        return self._traced(kernel(self._flat, costs, unit, rows, columns, first, last, *args), first, last)

    def _stands(self, cell: Cell) -> bool:
        return 0 <= cell[0] < self.shape[0] and 0 <= cell[1] < self.shape[1] and bool(self.free[cell])

    def _next_stamp(self) -> int:
        self._stamp += 1
        if self._stamp == STAMPS:
            self._state[:] = 0
            self._stamp = 1
        return self._stamp

    def _traced(self, cost: int, first: int, last: int) -> tuple[float, list[Cell]] | None:
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
