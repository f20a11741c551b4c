"""Limits of a map's size and of its cells, the same for every loader."""

from math import isfinite
from typing import Final

from swarm.errors import ConfigError

SIDE_MAX: Final = 16_384  # cells
CELLS_MAX: Final = 1 << 23  # cells: the grid of so many takes 1.3 s and 300 MB; a search packs a number into 24 bits
DRAWING_MAX: Final = CELLS_MAX + (1 << 16)  # bytes of a map drawn with characters; line ends take some
FILE_MAX: Final = 1 << 27  # bytes, a map file or image
RESOLUTION_MIN: Final = 1e-4  # m
RESOLUTION_MAX: Final = 1e4  # m
COORDINATE_MAX: Final = 1e7  # m, of an origin; a float still resolves 2e-9 m there


def check_size(rows: int, columns: int, where: str) -> None:
    """Check the number of rows and columns before memory is allocated for them.

    Raises:
        ConfigError: the map has no cells or too many.
    """
    if not (0 < rows <= SIDE_MAX and 0 < columns <= SIDE_MAX and rows * columns <= CELLS_MAX):
        raise ConfigError(
            f"{where}: expected 1 to {SIDE_MAX} rows and columns and at most {CELLS_MAX} cells, "
            f"got {rows} rows of {columns}; cut the map, or draw it coarser"
        )


def check_cell(cell: float, where: str) -> None:
    """Check the side of a cell [m].

    Raises:
        ConfigError: it is not a finite number between ``RESOLUTION_MIN`` and ``RESOLUTION_MAX``.
    """
    number = isinstance(cell, int | float) and not isinstance(cell, bool)
    # compare before isfinite(): an int may be too large for a float
    if not (number and RESOLUTION_MIN <= cell <= RESOLUTION_MAX and isfinite(cell)):
        raise ConfigError(
            f"{where}: expected a cell's side of {RESOLUTION_MIN} to {RESOLUTION_MAX} m, got {cell!r}; "
            "give the length of one cell in metres"
        )
