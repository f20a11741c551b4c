"""Ways from a cell straight to a place: which cells they need, and where none leads."""

from dataclasses import replace
from math import cos, hypot, sin, tau

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from swarm.maps.occupancy import FREE, WALL, OccupancyMap, Point
from swarm.traffic.lattice.cell_map import OUTSIDE, CellMap
from swarm.traffic.lattice.dock import Dock, find_dock, gap_to_place
from swarm.traffic.settings import TrafficConstants

FINE, WIDE, HIGH = 0.1, 6.0, 4.8  # m
CLEAR = 0.05  # m, between a body at its place and the walls
EXACT = TrafficConstants(reach=0.05)


def room(*walls: tuple[float, float, float, float]) -> OccupancyMap:
    """Return a room, with boxes (x0, y0, x1, y1) [m] of wall in it."""
    cells = np.full((round(HIGH / FINE), round(WIDE / FINE)), FREE, np.uint8)
    cells[[0, -1], :] = cells[:, [0, -1]] = WALL
    for x0, y0, x1, y1 in walls:
        cells[round(y0 / FINE) : round(y1 / FINE), round(x0 / FINE) : round(x1 / FINE)] = WALL
    return OccupancyMap(cells, FINE)


def lattice(floor: OccupancyMap, side: float, offset: Point = (0.0, 0.0)) -> CellMap:
    return CellMap(floor, side=side, radius=EXACT.radius + 0.05, offset=offset)


near = EXACT.radius + CLEAR + FINE
places = st.tuples(st.floats(near, WIDE - near), st.floats(near, HIGH - near))


@given(place=places, side=st.sampled_from([0.5, 0.6, 0.8, 1.2]), shift=st.tuples(st.floats(0, 1), st.floats(0, 1)))
def test_a_robot_comes_to_every_free_place_of_a_room_within_cells_that_it_can_hold(
    place: Point, side: float, shift: tuple[float, float]
) -> None:
    """No lattice decides where a robot may stand. The judge tries the rim of the body along the way, and knows no sweep."""
    cells = lattice(room(), side, (-shift[0] * side, -shift[1] * side))
    assume(cells.cell_of(*place) != OUTSIDE)  # a lattice may end up to half a cell before the map does
    dock = find_dock(cells, place, EXACT)
    if dock is None:
        assert gap_to_place(cells, cells.cell_of(*place), place, EXACT) <= EXACT.reach
        return
    held = {dock.cell, *dock.cells_beside(cells, EXACT)}
    (x0, y0), (x1, y1) = cells.centre(dock.cell), place
    assert hypot(x1 - x0, y1 - y0) <= 1.5 * side * 2**0.5 + 1e-9
    for share in np.linspace(0.0, 1.0, 9):
        for turn in np.linspace(0.0, tau, 16):
            x, y = x0 + share * (x1 - x0) + EXACT.radius * cos(turn), y0 + share * (y1 - y0) + EXACT.radius * sin(turn)
            assert cells.cell_of(x, y) in {*held, OUTSIDE}


@pytest.mark.parametrize("off", [0.0, 0.03, 0.1])
def test_a_robot_that_only_nearly_knows_where_it_is_holds_more(off: float) -> None:
    cells = lattice(room(), 1.2)
    place = (2.4 - EXACT.standing_room - 0.05, 1.8)  # m; its body ends 5 cm before the edge of the cell
    beside = Dock(place, cells.cell_of(*place)).cells_beside(cells, EXACT, off)
    assert bool(beside) == (off > 0.05)


BETWEEN = (2.0, 1.0, 2.2, 3.6)  # m, between two halves of the room
# fmt: off
HIDDEN: dict[str, tuple[Point, bool]] = {  # a place [m], whether a robot drives straight there from the left half
    "before the wall":        ((1.7, 1.9), True),
    "round its end":          ((2.3, 0.45), True),
    "behind it":              ((3.0, 2.3), False),
    "far beyond":             ((5.0, 2.3), False),
}
# fmt: on


@pytest.mark.parametrize("name", HIDDEN)
def test_no_robot_drives_straight_through_a_wall(name: str) -> None:
    place, seen = HIDDEN[name]
    cells = lattice(room(BETWEEN), 1.2)

    def is_left(cell: int) -> bool:
        return cells.centre(cell)[0] < BETWEEN[0]

    dock = find_dock(cells, place, EXACT, is_left)
    inside = is_left(cells.cell_of(*place)) and gap_to_place(cells, cells.cell_of(*place), place, EXACT) <= 0.05
    assert (dock is not None or inside) == seen
    assert dock is None or is_left(dock.cell)


def test_the_middle_of_the_cell_comes_first_where_the_straight_line_leaves_the_held_cells() -> None:
    cells = lattice(room(), 1.2)
    dock = find_dock(cells, (2.4, 2.4), EXACT)  # at the corner of four cells
    assert dock is not None
    held = {dock.cell, *dock.cells_beside(cells, EXACT)}
    middle = cells.centre(dock.cell)
    assert dock.next_point(middle, held, cells, EXACT) == dock.place
    assert dock.next_point((4.2, 4.2), held, cells, EXACT) == middle


def test_the_middle_of_the_cell_comes_first_where_a_corner_is_in_the_way() -> None:
    cells = lattice(room((3.0, 1.9, 3.2, 2.4)), 1.2)
    dock = find_dock(cells, (2.4, 2.4), EXACT)
    assert dock is not None
    held = range(len(cells))
    assert dock.next_point(cells.centre(dock.cell), held, cells, EXACT) == dock.place
    assert dock.next_point((3.5, 2.15), held, cells, EXACT) == cells.centre(dock.cell)


def test_where_walls_stop_the_radio_nobody_docks() -> None:
    cells, corner = lattice(room(), 1.2), (2.4, 2.4)
    assert find_dock(cells, corner, EXACT) is not None
    assert find_dock(cells, corner, replace(EXACT, in_sight=True)) is None


def test_a_robot_drives_to_no_place_for_which_it_may_not_claim_all_cells() -> None:
    """From the middle of a cell of 2.8 m a cell at its corner is 3.96 m off: it stood there and claimed nothing."""
    cells = CellMap(OccupancyMap(np.zeros((4, 4), np.uint8), 2.8), side=2.8, radius=0.51)
    wide = replace(EXACT, radius=0.46, reach=0.3)
    assert wide.claim_radius == 3.5
    assert find_dock(cells, (2.8, 2.8), wide) is None
    dock = find_dock(cells, (2.8, 4.2), wide)  # between two cells that share a side
    assert dock is not None
    assert len(dock.cells_beside(cells, wide)) == 1
