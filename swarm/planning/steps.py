"""The eight steps of a grid, numbered in one place, and what follows from their order."""

import numpy as np
from numba import njit, uint8, void
from numpy.typing import NDArray

Bits = NDArray[np.uint8]

# direction k turns left by 45 degrees each: east, north-east, north ... (even: straight, odd: diagonal)
ROW_STEP = np.array([0, 1, 1, 1, 0, -1, -1, -1], np.int64)
COLUMN_STEP = np.array([1, 1, 0, -1, -1, -1, 0, 1], np.int64)
NONE = 8  # the start was entered from nowhere


def _natural() -> Bits:
    """Tabulate, by direction of entry and legal moves, the moves worth trying on a grid where all cells cost the same.

    What the parent reaches as cheaply by itself, or by going diagonally first, needs no second way through this cell
    (Harabor & Grastien 2011; Sturtevant & Rabin 2016, canonical orderings; here without corner cutting).
    """
    table = np.zeros((9, 256), np.uint8)
    for moves in range(256):
        table[NONE, moves] = moves
        for entered in range(8):
            worth = {entered}
            if entered % 2:
                worth |= {entered + 1, entered - 1}
            else:
                for side in (1, -1):
                    # stepping back diagonally is legal: so is the parent's own step to the cell beside this one
                    if not moves >> (entered + 3 * side) % 8 & 1:
                        worth |= {entered + side, entered + 2 * side}
            table[entered, moves] = moves & sum(1 << k % 8 for k in worth)
    return table.reshape(-1)


def _onward() -> Bits:
    """Tabulate the same where cells differ: all legal moves but the one straight back."""
    table = np.tile(np.arange(256, dtype=np.uint8), (9, 1))
    for entered in range(8):
        table[entered] &= 255 & ~(1 << (entered + 4) % 8)
    return table.reshape(-1)


def _lowest() -> NDArray[np.int64]:
    """Tabulate which bit a power of two below 256 is."""
    table = np.zeros(256, np.int64)
    for k in range(8):
        table[1 << k] = k
    return table


NATURAL = _natural()
LOWEST = _lowest()
ONWARD = _onward()


@njit(void(uint8[:, ::1], uint8[:, ::1]), cache=True, error_model="numpy")
def legal_moves(free: Bits, moves: Bits) -> None:
    """Fill ``moves``: bit k set where a step in direction k meets free cells only and cuts no corner."""
    rows, columns = free.shape
    padded = np.zeros((rows + 2, columns + 2), np.uint8)
    for row in range(rows):
        for column in range(columns):
            padded[row + 1, column + 1] = free[row, column]
    for row in range(rows):
        for column in range(columns):
            r, c = row + 1, column + 1
            e, n, w, s = padded[r, c + 1], padded[r + 1, c], padded[r, c - 1], padded[r - 1, c]
            straight = e | n << 2 | w << 4 | s << 6
            diagonal = (
                (e & n & padded[r + 1, c + 1]) << 1
                | (n & w & padded[r + 1, c - 1]) << 3
                | (w & s & padded[r - 1, c - 1]) << 5
                | (s & e & padded[r - 1, c + 1]) << 7
            )
            moves[row, column] = (straight | diagonal) * padded[r, c]
