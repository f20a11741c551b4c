"""Cells for a radio that walls stop, where one cell is joined to several."""

import pytest

from swarm.traffic.lattice.line_of_sight import without_unheard
from tests.traffic.maps import Drawn

CORNER = Drawn("ab#", "#cd", "##e")
CROSS = Drawn("#u#", "lmr", "#d#")
STRAIGHT = Drawn("abc")


def joins(drawn: Drawn, room: float) -> set[str]:
    """Return the joined pairs by name, each once."""
    cells = without_unheard(drawn.cells, room)
    names = dict(zip(drawn.at("".join(drawn.names)), drawn.names, strict=True))
    pairs = {(cell, near) for cell in names for near in cells.neighbours[cell]}
    assert pairs == {(near, cell) for cell, near in pairs}
    return {names[cell] + names[near] for cell, near in pairs if cell < near}


# fmt: off
JOINED: dict[str, tuple[Drawn, float, set[str]]] = {
    "from where they lean they see each other":    (CORNER,   0.4,  {"ab", "cb", "cd", "ed"}),
    "in the middle of their cells they do not":    (CORNER,   0.5,  {"ab", "ed"}),
    "of four, two opposite ones are left":         (CROSS,    0.6,  {"dm", "mu"}),
    "of four that lean none is parted":            (CROSS,    0.3,  {"dm", "mu", "lm", "mr"}),
    "along a straight way all see each other":     (STRAIGHT, 0.6,  {"ab", "bc"}),
}
# fmt: on


@pytest.mark.parametrize("name", JOINED)
def test_cells_over_which_robots_would_not_hear_each_other_are_parted(name: str) -> None:
    """The line between two that lean 0.2 m from their middles passes a corner 0.14 m off, at 0.1 m only 0.07 m off."""
    drawn, room, pairs = JOINED[name]
    assert joins(drawn, room) == pairs
