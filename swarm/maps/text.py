"""Maps drawn with characters, as in a scenario file."""

from typing import Final

import numpy as np

from swarm.errors import ConfigError
from swarm.maps.limits import check_cell, check_size
from swarm.maps.occupancy import FREE, OBSTACLE, WALL, OccupancyMap

SYMBOLS: Final = {"#": WALL, "o": OBSTACLE, ".": FREE, " ": FREE}


def from_text(text: str, cell: float, where: str = "map") -> OccupancyMap:
    r"""Read a drawing whose first line is the top; ``cell`` is the side of one character [m].

    ``where`` begins every error text, for example ``"paper.yaml: map"``.

    Raises:
        ConfigError: no lines, lines of different lengths, an unknown character, a map too large, or a bad ``cell``.

    >>> from_text("##\n.#\n", 0.5).cells.tolist()
    [[0, 1], [1, 1]]
    """
    check_cell(cell, where)
    lines = text.replace("\r\n", "\n").removesuffix("\n").split("\n")
    width = len(lines[0])
    check_size(len(lines), width, where)
    for number, line in enumerate(lines, start=1):
        for column, symbol in enumerate(line, start=1):
            if symbol not in SYMBOLS:
                raise ConfigError(
                    f"{where}: line {number}, column {column}: expected '#' (wall), 'o' (obstacle), '.' or ' ' (free), "
                    f"got {symbol!r}; replace that character"
                )
        if len(line) != width:
            raise ConfigError(
                f"{where}: line {number}: expected {width} characters as in line 1, got {len(line)}; "
                "make all lines equally long"
            )
    cells = np.array([[SYMBOLS[symbol] for symbol in line] for line in reversed(lines)], dtype=np.uint8)
    return OccupancyMap(cells, float(cell))
