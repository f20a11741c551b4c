"""Breadth-first distances over cells. Compiled: a joint plan needs those to the goals of all its robots."""

from collections.abc import Collection
from typing import Final

import numpy as np
from numba import njit
from numpy.typing import NDArray

FAR: Final = 1 << 30  # steps; the cell cannot be reached
NONE: Final = -1  # no neighbour

Joined = NDArray[np.int32]  # (cells, most neighbours of a cell), filled up with NONE


def joined(neighbours: Collection[Collection[int]]) -> Joined:
    """Return the neighbours of all cells as ``breadth_first`` takes them."""
    most = max(map(len, neighbours), default=0)
    return np.array([(*near, *(NONE,) * (most - len(near))) for near in neighbours], np.int32).reshape(
        len(neighbours), most
    )


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
