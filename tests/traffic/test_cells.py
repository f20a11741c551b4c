"""The lattice of cells against the map it was made from."""

from itertools import pairwise
from math import hypot

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm.geometry import Pose
from swarm.maps.occupancy import OccupancyMap
from swarm.traffic.cells import FAR, OUTSIDE, CellMap, best_offset
from swarm.traffic.route import own_way
from tests.traffic.maps import BAY, DOOR

maps = st.builds(
    lambda seed, density, yaw: OccupancyMap(
        (np.random.default_rng(seed).random((26, 31)) < density).astype(np.uint8), 0.1, Pose(-1.0, 2.0, yaw)
    ),
    st.integers(0, 1000),
    st.sampled_from([0.0, 0.01, 0.05]),
    st.sampled_from([0.0, 0.7]),
)


def clear_by_force(occupancy: OccupancyMap, x: float, y: float, radius: float) -> bool:
    """Whether a disc given in the map's own frame meets no solid square and stays inside."""
    rows, columns = occupancy.shape
    side = occupancy.resolution
    if not (radius - 1e-9 <= x <= columns * side - radius + 1e-9 and radius - 1e-9 <= y <= rows * side - radius + 1e-9):
        return False
    return all(
        hypot(max(c * side - x, x - (c + 1) * side, 0), max(r * side - y, y - (r + 1) * side, 0)) >= radius - 1e-9
        for r, c in np.argwhere(occupancy.cells).tolist()
    )


@given(occupancy=maps, side=st.sampled_from([0.5, 0.62]), offset=st.sampled_from([(0.0, 0.0), (0.15, 0.05)]))
def test_cells_are_those_a_disc_fits_in(occupancy: OccupancyMap, side: float, offset: tuple[float, float]) -> None:
    cells = CellMap(occupancy, side=side, radius=0.2, offset=offset)
    for cell in range(len(cells)):
        row, column = divmod(cell, cells.columns)
        x, y = offset[0] + (column + 0.5) * side, offset[1] + (row + 0.5) * side
        assert cells.stands[cell] == clear_by_force(occupancy, x, y, 0.2)
        assert cells.cell_of(*cells.centre(cell)) == cell
        right = cell + 1 in cells.neighbours[cell] if column + 1 < cells.columns else False
        if right:
            assert all(clear_by_force(occupancy, x + side * k / 20, y, 0.2) for k in range(21))
        for other in cells.neighbours[cell]:
            assert cell in cells.neighbours[other]


@given(x=st.floats(-0.5, 10), y=st.floats(-0.5, 4), radius=st.floats(0.01, 0.5))
def test_touched_cells_hold_the_disc(x: float, y: float, radius: float) -> None:
    touched = BAY.cells.touched(x, y, radius)
    assert BAY.cells.cell_of(x, y) in touched
    for k in range(24):
        edge = x + 0.999 * radius * np.cos(k), y + 0.999 * radius * np.sin(k)
        assert BAY.cells.cell_of(*edge) in touched


def test_a_disc_fits_only_in_held_cells_and_off_walls() -> None:
    a = BAY.at("a")[0]
    x, y = BAY.cells.centre(a)
    assert BAY.cells.fits((a,), x, y, 0.3)
    assert not BAY.cells.fits((a,), x + 0.4, y, 0.3)
    assert BAY.cells.fits((a, a + 1), x + 0.4, y, 0.3)
    fine = OccupancyMap(np.zeros((24, 24), dtype=np.uint8), 0.1)
    fine.cells[0:3, 0:3] = 1
    cells = CellMap(fine, side=1.2, radius=0.2)
    assert cells.stands[0]
    assert not cells.fits((0,), 0.35, 0.35, 0.2)
    assert cells.fits((0,), 0.6, 0.6, 0.2)


def test_distances_go_round_walls_and_what_is_shut() -> None:
    a, b, c = BAY.at("abc")
    assert BAY.cells.distances(b)[a] == 7
    assert BAY.cells.distances(b)[c] == 5
    assert BAY.cells.distances(b, {a + 3})[a] == FAR


def test_the_lattice_is_shifted_to_where_doors_open() -> None:
    fine = np.zeros((24, 30), dtype=np.uint8)
    fine[:, 15] = 1
    fine[9:15, 15] = 0  # a door of 0.6 m about y = 1.2 m, on the border of two rows of cells
    occupancy = OccupancyMap(fine, 0.1)
    shut = CellMap(occupancy, side=1.2, radius=0.2)
    assert shut.distances(0)[shut.cell_of(2.9, 0.7)] == FAR
    offset = best_offset(occupancy, side=1.2, radius=0.2)
    opened = CellMap(occupancy, side=1.2, radius=0.2, offset=offset)
    start, goal = opened.nearest_standable(0.6, 1.2), opened.nearest_standable(2.6, 1.2)
    assert opened.distances(goal)[start] < FAR


def test_outside_is_no_cell() -> None:
    assert BAY.cells.cell_of(-0.1, 0.5) == OUTSIDE
    assert OUTSIDE in BAY.cells.touched(0.1, 0.6, 0.2)


@pytest.mark.parametrize(("start", "goal"), ["ab", "ah", "gd", "cf"])
def test_an_own_way_is_a_shortest_one(start: str, goal: str) -> None:
    (a, b), cells = DOOR.at(start + goal), DOOR.cells
    way = (a, *own_way(cells, a, b))
    assert way[-1] == b
    assert len(way) - 1 == cells.distances(b)[a]
    assert all(other in cells.neighbours[cell] for cell, other in pairwise(way))
