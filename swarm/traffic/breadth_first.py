"""Breadth-first distances over cells, in steps from the nearest source."""

from collections import deque
from collections.abc import Collection, Iterable
from typing import Final

FAR: Final = 1 << 30  # steps; the cell cannot be reached


def breadth_first(
    neighbours: tuple[tuple[int, ...], ...], sources: Iterable[int], without: Collection[int] = ()
) -> list[int]:
    """Return the steps from every cell to the nearest source, or FAR; no way enters a cell of ``without``."""
    table = [FAR] * len(neighbours)
    ready = deque(sources)
    for cell in ready:
        table[cell] = 0
    while ready:
        cell = ready.popleft()
        steps = table[cell] + 1
        for other in neighbours[cell]:
            if table[other] > steps and other not in without:
                table[other] = steps
                ready.append(other)
    return table
