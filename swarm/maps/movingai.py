"""Maps and scenarios of the MovingAI benchmarks (Sturtevant 2012): ``.map`` and ``.scen``."""

from math import isfinite
from pathlib import Path
from typing import Final, NamedTuple

from swarm.errors import ConfigError
from swarm.maps.files import quote_value, read_text
from swarm.maps.limits import DRAWING_MAX, SIDE_MAX, check_cell, check_size
from swarm.maps.occupancy import FREE, WALL, Cell, OccupancyMap
from swarm.maps.text import cells_of_drawing, find_wrong_character

SYMBOLS: Final = {".": FREE, "G": FREE, "S": FREE, "@": WALL, "O": WALL, "T": WALL, "W": WALL}
COLUMNS: Final = 9  # of a scenario's row
SCEN_MAX: Final = 2_000_000  # bytes of a .scen file, about 30,000 rows


class PlanningTask(NamedTuple):
    """One row of a scenario; cells are (row, column) of the map as loaded, row 0 at the bottom."""

    start: Cell
    goal: Cell
    optimal: float | None  # cells, 8-connected without corner cutting; None where the file states none


def load_movingai(path: Path, cell: float = 1.0) -> OccupancyMap:
    """Load a ``.map``; ``cell`` is the side of one character [m].

    Raises:
        ConfigError: the file or ``cell`` is not valid.
    """
    return from_movingai(read_text(path, DRAWING_MAX), cell, str(path))


def from_movingai(text: str, cell: float = 1.0, where: str = "map") -> OccupancyMap:
    r"""Read the text of a ``.map``: some header lines (``type octile`` may be missing), ``map``, and the rows.

    Raises:
        ConfigError: the text or ``cell`` is not valid.

    >>> from_movingai("height 2\nwidth 3\nmap\n.@.\nGGT").cells.tolist()
    [[0, 0, 1], [0, 1, 0]]
    """
    check_cell(cell, where)
    lines = text.replace("\r\n", "\n").split("\n")
    header: dict[str, str] = {}
    for first, line in enumerate(lines, start=1):
        if line.strip() == "map":
            break
        key, _, value = line.strip().partition(" ")
        if key not in ("type", "height", "width") or key in header:
            raise ConfigError(
                f"{where}: line {first}: expected one of 'type octile', 'height N', 'width N', 'map', each once, "
                f"got {quote_value(line)}; is this a MovingAI map?"
            )
        header[key] = value.strip()
    else:
        raise ConfigError(f"{where}: expected a line 'map' before the rows, got none; is this a MovingAI map?")
    if header.get("type", "octile") != "octile":
        raise ConfigError(f"{where}: expected 'type octile', got {quote_value(header['type'])}; no other is supported")
    height, width = _side(header, "height", where), _side(header, "width", where)
    check_size(height, width, where)
    rows = lines[first : first + height]
    for number, line in enumerate(rows, start=first + 1):
        if wrong := find_wrong_character(line, SYMBOLS):
            raise ConfigError(
                f"{where}: line {number}, column {wrong}: expected one of {''.join(SYMBOLS)}, "
                f"got {line[wrong - 1]!r}; replace that character"
            )
        if len(line) != width:
            raise ConfigError(
                f"{where}: line {number}: expected {width} characters as 'width' says, got {len(line)}; "
                "correct the line or the width"
            )
    rest = "".join(lines[first + height :]).strip()
    if len(rows) != height or rest:
        got = f"{len(rows)}" if len(rows) < height else f"more: {quote_value(rest)}"
        raise ConfigError(f"{where}: expected {height} rows as 'height' says, got {got}; is the file whole?")
    return OccupancyMap(cells_of_drawing(rows, SYMBOLS), float(cell))


def load_scen(path: Path, map: OccupancyMap) -> list[PlanningTask]:  # noqa: A002
    """Load a ``.scen`` for its map. The column with the map's name is ignored: it is often a path of another machine.

    Raises:
        ConfigError: the file is not valid, or belongs to another map.
    """
    return from_scen(read_text(path, SCEN_MAX), map, str(path))


def from_scen(text: str, map: OccupancyMap, where: str = "scenario") -> list[PlanningTask]:  # noqa: A002
    """Read the text of a ``.scen`` (``version 1`` may be missing): one row per line, y counted from the top.

    Some sets have a length of 0 between two different cells, or a size of 0 by 0: both mean "not stated".

    Raises:
        ConfigError: the text is not valid, or belongs to another map.
    """
    rows: list[PlanningTask] = []
    height, width = map.shape
    for number, line in enumerate(text.replace("\r\n", "\n").split("\n"), start=1):
        words = line.split("\t") if line.count("\t") == COLUMNS - 1 else line.split()
        if not words or not line.strip() or (number == 1 and words[0].strip() == "version"):
            continue
        at = f"{where}: line {number}"
        if len(words) != COLUMNS:
            raise ConfigError(
                f"{at}: expected {COLUMNS} columns (bucket, map, width, height, start x, start y, goal x, goal y, "
                f"length), got {len(words)}; is this a MovingAI scenario?"
            )
        size = (_whole(words[2], at), _whole(words[3], at))
        if size not in ((0, 0), (width, height)):
            raise ConfigError(
                f"{at}: expected a map {width} wide and {height} high, got {size[0]} by {size[1]}; "
                "give the map this scenario was made for"
            )
        x0, y0, x1, y1 = (_whole(word, at) for word in words[4:8])
        if x0 >= width or x1 >= width or y0 >= height or y1 >= height:
            raise ConfigError(
                f"{at}: expected start and goal inside {width} by {height}, got ({x0}, {y0}) and ({x1}, {y1}); "
                "give the map this scenario was made for"
            )
        start, goal = (height - 1 - y0, x0), (height - 1 - y1, x1)
        length = _length(words[8], at)
        rows.append(PlanningTask(start, goal, None if length == 0.0 and start != goal else length))
    if not rows:
        raise ConfigError(f"{where}: expected at least one row, got none; is this a MovingAI scenario?")
    return rows


def _side(header: dict[str, str], key: str, where: str) -> int:
    if key not in header:
        raise ConfigError(f"{where}: expected a line '{key} N' before 'map', got none; add it")
    return _whole(header[key], f"{where}: {key}")


def _whole(word: str, where: str) -> int:
    word = word.strip()
    if not (word.isascii() and word.isdigit() and len(word) <= 9):
        raise ConfigError(f"{where}: expected a whole number up to {SIDE_MAX}, got {quote_value(word)}; correct it")
    return int(word)


def _length(word: str, where: str) -> float:
    try:
        length = float(word)
    except ValueError:
        length = -1.0
    if not (isfinite(length) and length >= 0.0):
        raise ConfigError(f"{where}: expected a length in cells, 0 or more, got {quote_value(word)}; correct it")
    return length
