"""The pairs with the least sum of costs: the rectangular assignment problem."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

NOBODY: Final = -1


def cheapest_pairs(costs: NDArray[np.float64]) -> list[tuple[int, int]]:
    """Return (row, column) of a matrix's cheapest pairs, by rows: as many as it has rows or columns, each in one pair.

    ``costs`` are finite. Shortest augmenting paths, one for each row (Jonker and Volgenant 1987, in the form of D. F.
    Crouse, "On implementing 2D rectangular assignment algorithms", 2016). Which of equally cheap sets it is depends on
    ``costs`` alone.
    """
    if costs.shape[0] > costs.shape[1]:
        return sorted((row, column) for column, row in cheapest_pairs(costs.T))
    rows, columns = costs.shape
    row_price, column_price = np.zeros(rows), np.zeros(columns)
    column_of, row_of = np.full(rows, NOBODY), np.full(columns, NOBODY)
    for new in range(rows):
        # the cheapest alternating path from the new row to a column without a row (Dijkstra, over reduced costs)
        length, before = np.full(columns, np.inf), np.full(columns, NOBODY)
        seen_rows, left = [new], np.arange(columns)[::-1]
        row, shortest = new, 0.0
        while True:
            through = shortest + costs[row, left] - row_price[row] - column_price[left]
            shorter = left[through < length[left]]
            length[left] = np.minimum(length[left], through)
            before[shorter] = row
            shortest = float(length[left].min())
            nearest = np.flatnonzero(length[left] == shortest)
            ends = nearest[row_of[left[nearest]] == NOBODY]
            place = int(ends[-1] if ends.size else nearest[0])
            column = int(left[place])
            left[place] = left[-1]
            left = left[:-1]
            if ends.size:
                break
            row = int(row_of[column])
            seen_rows.append(row)
        # prices, so that every reduced cost stays at least 0
        row_price[new] += shortest
        for other in seen_rows[1:]:
            row_price[other] += shortest - length[column_of[other]]
        seen = np.ones(columns, bool)
        seen[left] = False
        column_price[seen] -= shortest - length[seen]
        # along the path each row takes the column after it
        while column != NOBODY:
            row = int(before[column])
            row_of[column] = row
            column, column_of[row] = (NOBODY if row == new else int(column_of[row])), column
    return [(row, int(column)) for row, column in enumerate(column_of)]
