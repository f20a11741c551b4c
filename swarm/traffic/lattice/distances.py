"""What is joined over a lattice's cells, and how far: breadth-first. Compiled, for joint plans need many tables."""

from collections.abc import Collection, Sequence
from typing import Final

import numpy as np
from numba import njit
from numpy.typing import NDArray

FAR: Final = 1 << 30  # steps; the cell cannot be reached
NONE: Final = -1  # no neighbour
KEPT: Final = 256  # tables, at most
LARGEST: Final = 1 << 18  # steps in all tables, 2 MB; at least one table is kept

Joined = NDArray[np.int32]  # (cells, most neighbours of a cell), filled up with NONE


def neighbour_table(neighbours: Collection[Collection[int]]) -> Joined:
    """Return the neighbours of all cells as ``breadth_first`` takes them."""
    table: Joined = neighbour_tables([neighbours])[0]
    return table


def neighbour_tables(floors: Sequence[Collection[Collection[int]]]) -> NDArray[np.int32]:
    """Return such a table for each of several floors, all of one width: (floors, cells, most neighbours of a cell)."""
    most = max([len(near) for neighbours in floors for near in neighbours], default=0)
    rows = [[(*near, *(NONE,) * (most - len(near))) for near in neighbours] for neighbours in floors]
    return np.array(rows, np.int32).reshape(len(floors), len(floors[0]), most)


@njit("i8[::1](i4[:, ::1], i8, i8[::1])", cache=True, boundscheck=True)
def breadth_first(near: Joined, source: int, without: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the steps from every cell to a source, or FAR; no way enters a cell of ``without``.

    Raises:
        IndexError: The source is not a cell.
    """
    table = np.full(near.shape[0], FAR, np.int64)
    shut = np.zeros(near.shape[0], np.bool_)
    for cell in without:
        if 0 <= cell < near.shape[0]:
            shut[cell] = True
    ready = np.empty(near.shape[0], np.int64)
    table[source] = 0
    ready[0] = source
    first, beyond = 0, 1
    while first < beyond:
        cell = ready[first]
        first += 1
        for other in near[cell]:
            if other == NONE:
                break
            if table[other] == FAR and not shut[other]:
                table[other] = table[cell] + 1
                ready[beyond] = other
                beyond += 1
    return table


class Distances:
    """The tables of cells with these neighbours. Those asked for lately are kept."""

    def __init__(self, neighbours: Sequence[Collection[int]]) -> None:
        self._neighbours = neighbours
        self._pieces: list[int] | None = None
        self._joined: Joined | None = None
        self._numbers: NDArray[np.object_] = np.array([FAR], object)  # 0, 1, 2 ... and FAR: the objects in all tables
        self._tables: dict[tuple[int, frozenset[int]], list[int]] = {}

    def steps_to(self, goal: int, without: Collection[int]) -> list[int]:
        """Return the steps from every cell to ``goal``, or FAR; no way enters ``without``."""
        key = (goal, frozenset(without))
        table = self._tables.get(key)
        if table is None:
            if self._joined is None:
                self._joined = neighbour_table(self._neighbours)
            table = self._share_list(breadth_first(self._joined, goal, np.array([*key[1]], np.int64)))
            if len(self._tables) >= max(1, min(KEPT, LARGEST // len(table))):
                del self._tables[next(iter(self._tables))]
            self._tables[key] = table
        return table

    @property
    def pieces(self) -> list[int]:
        """A number for each cell: the same for two cells if a way joins them. The last one, at index -1, is none."""
        if self._pieces is None:
            numbers = [NONE] * len(self._neighbours)
            for first in range(len(numbers)):
                if numbers[first] == NONE:
                    numbers[first], ready = first, [first]
                    for cell in ready:
                        for other in self._neighbours[cell]:
                            if numbers[other] == NONE:
                                numbers[other] = first
                                ready.append(other)
            self._pieces = [*numbers, NONE]
        return self._pieces

    def _share_list(self, steps: NDArray[np.int64]) -> list[int]:
        """Return steps as a list without objects of its own: each FAR of its own would take four times the list."""
        longest = int(steps.max(where=steps < FAR, initial=0))
        if longest + 1 >= len(self._numbers):
            self._numbers = np.array([*range(2 * longest + 1), FAR], object)
        table: list[int] = self._numbers[np.minimum(steps, len(self._numbers) - 1)].tolist()
        return table
