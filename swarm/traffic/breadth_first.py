"""Steps over cells, counted from the nearest of some sources."""

from collections import deque
from collections.abc import Collection, Iterable
from typing import Final

FAR: Final = 1 << 30  # steps; no way leads there


def breadth_first(
    neighbours: tuple[tuple[int, ...], ...], sources: Iterable[int], without: Collection[int] = ()
) -> list[int]:
    """Count the steps from every cell to the nearest source, never entering a cell of ``without``."""
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
