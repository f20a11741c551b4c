"""The distance tables of a lattice's cells. Those asked for lately are kept."""

from collections.abc import Collection
from typing import Final

import numpy as np

from swarm.traffic.breadth_first import Joined, breadth_first, joined

KEPT: Final = 256  # tables, at most
LARGEST: Final = 1 << 18  # steps in all tables, 2 MB; at least one table is kept


class Distances:
    """Steps over cells with these neighbours."""

    def __init__(self, neighbours: Collection[Collection[int]]) -> None:
        self._neighbours = neighbours
        self._joined: Joined | None = None
        self._tables: dict[tuple[int, frozenset[int]], list[int]] = {}

    def to(self, goal: int, without: Collection[int]) -> list[int]:
        """Return the steps from every cell to ``goal``, or FAR; no way enters ``without``."""
        key = (goal, frozenset(without))
        table = self._tables.get(key)
        if table is None:
            if self._joined is None:
                self._joined = joined(self._neighbours)
            table = breadth_first(self._joined, goal, np.array([*key[1]], np.int64)).tolist()
            if len(self._tables) >= max(1, min(KEPT, LARGEST // len(table))):
                del self._tables[next(iter(self._tables))]
            self._tables[key] = table
        return table
