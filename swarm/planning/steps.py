"""The eight steps of a grid, their numbers, and tables that follow from these numbers."""

import numpy as np
from numba import int32, njit, uint8, void
from numpy.typing import NDArray

Bits = NDArray[np.uint8]

# direction k points k * 45 degrees to the left of east: east, north-east, north ... (even: straight, odd: diagonal)
ROW_STEP = np.array([0, 1, 1, 1, 0, -1, -1, -1], np.int64)
COLUMN_STEP = np.array([1, 1, 0, -1, -1, -1, 0, 1], np.int64)
NONE = 8  # direction of entry of the start, which has no parent


def _natural() -> Bits:
    """Return the table of moves worth trying, by direction of entry and legal moves, if all cells cost the same.

    A cell that the parent reaches as cheaply without this cell, or by a diagonal step first, is not tried from here
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
                    # if the diagonal step back is legal, the parent itself can step to the cell beside this one
                    if not moves >> (entered + 3 * side) % 8 & 1:
                        worth |= {entered + side, entered + 2 * side}
            table[entered, moves] = moves & sum(1 << k % 8 for k in worth)
    return table.reshape(-1)


def _moves_onward() -> Bits:
    """Return the table of moves worth trying if cells have different costs: all legal ones except straight back."""
    table = np.tile(np.arange(256, dtype=np.uint8), (9, 1))
    for entered in range(8):
        table[entered] &= 255 & ~(1 << (entered + 4) % 8)
    return table.reshape(-1)


def _lowest() -> NDArray[np.int64]:
    """Return the table of bit numbers of the powers of two below 256."""
    table = np.zeros(256, np.int64)
    for k in range(8):
        table[1 << k] = k
    return table


NATURAL = _natural()
LOWEST = _lowest()
ONWARD = _moves_onward()


@njit(void(uint8[:, ::1], uint8[:, ::1]), cache=True, error_model="numpy")
def legal_moves(free: Bits, moves: Bits) -> None:
    """Fill ``moves``: bit k is set where a step in direction k is between free cells and cuts no corner."""
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


@njit(void(uint8[:, ::1], int32[:, ::1]), cache=True, error_model="numpy")
def number_pieces(moves: Bits, pieces: NDArray[np.int32]) -> None:
    """Fill ``pieces``: two cells get the same number, from 1, where legal steps lead from one to the other.

    A step must be legal in both directions or in none, as in a grid.
    """
    rows, columns = moves.shape
    ready = np.empty(rows * columns, np.int32)
    pieces[:] = 0
    last = 0
    for first in range(rows * columns):
        if pieces[first // columns, first % columns]:
            continue
        last += 1
        pieces[first // columns, first % columns] = last
        ready[0] = first
        waiting = 1
        while waiting:
            waiting -= 1
            cell = ready[waiting]
            row, column = cell // columns, cell % columns
            for k in range(8):
                if moves[row, column] >> k & 1:
                    r, c = row + ROW_STEP[k], column + COLUMN_STEP[k]
                    if not pieces[r, c]:
                        pieces[r, c] = last
                        ready[waiting] = r * columns + c
                        waiting += 1
