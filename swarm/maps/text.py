"""Maps drawn with characters, as in a scenario file."""

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from swarm.errors import ConfigError
from swarm.maps.limits import check_cell, check_size
from swarm.maps.occupancy import FREE, OBSTACLE, ORIGIN, WALL, OccupancyMap

CHARACTERS: Final = {WALL: "#", OBSTACLE: "o", FREE: "."}
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
        if odd := find_wrong_character(line, SYMBOLS):
            raise ConfigError(
                f"{where}: line {number}, column {odd}: expected '#' (wall), 'o' (obstacle), '.' or ' ' (free), "
                f"got {line[odd - 1]!r}; replace that character"
            )
        if len(line) != width:
            raise ConfigError(
                f"{where}: line {number}: expected {width} characters as in line 1, got {len(line)}; "
                "make all lines equally long"
            )
    return OccupancyMap(cells_of_drawing(lines, SYMBOLS), float(cell))


def floor_as_text(floor: OccupancyMap) -> str:
    """Return a floor as text: ``#`` wall, ``o`` obstacle, ``.`` free; the first line is the top.

    Raises:
        ConfigError: it does not begin at (0, 0) or has unknown cells, which no text can say.
    """
    kinds = set(floor.cells.ravel().tolist())
    if floor.origin != ORIGIN or not kinds <= CHARACTERS.keys():
        raise ConfigError(
            "scenario: expected a floor of walls, obstacles and free cells with its corner at (0, 0), got one of a map "
            "file that is not; name that file in a scenario of your own"
        )
    return "\n".join("".join(CHARACTERS[cell] for cell in row) for row in reversed(floor.cells.tolist())) + "\n"


def find_wrong_character(line: str, symbols: Mapping[str, int]) -> int:
    """Return the column, from 1, of the first character that is no symbol; 0 if there is none."""
    if symbols.keys() >= set(line):
        return 0
    return next(column for column, character in enumerate(line, start=1) if character not in symbols)


def cells_of_drawing(lines: Sequence[str], symbols: Mapping[str, int]) -> NDArray[np.uint8]:
    """Return the cells of lines of equal length, whose first one is the top; the symbols are ASCII characters."""
    values = np.zeros(128, np.uint8)
    for symbol, value in symbols.items():
        values[ord(symbol)] = value
    characters = np.frombuffer("".join(lines).encode("ascii"), np.uint8)
    return values[characters].reshape(len(lines), -1)[::-1].copy()
