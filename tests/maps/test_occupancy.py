"""The occupancy map."""

from math import cos, pi, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm.geometry import Pose
from swarm.maps.occupancy import FREE, OBSTACLE, WALL, Cell, OccupancyMap, Point

EMPTY = OccupancyMap(np.zeros((4, 6), np.uint8), 0.5)

BLOCKS: dict[str, tuple[Point, Point, tuple[Cell, Cell]]] = {
    "one cell": ((0.5, 0.5), (1.0, 1.0), ((1, 1), (2, 2))),
    "corners swapped": ((1.0, 0.5), (0.5, 1.0), ((1, 1), (2, 2))),
    "touched cells count": ((0.4, 0.6), (1.1, 0.9), ((1, 0), (2, 3))),
    "a point": ((0.7, 0.7), (0.7, 0.7), ((1, 1), (2, 2))),
    "clipped": ((-5.0, -5.0), (0.6, 0.6), ((0, 0), (2, 2))),
    "beyond": ((7.0, 7.0), (8.0, 8.0), ((14, 14), (14, 14))),
}


OTHERS = {
    "a cell": OccupancyMap(np.eye(4, 6, dtype=np.uint8), 0.5),
    "the shape": OccupancyMap(np.zeros((6, 4), np.uint8), 0.5),
    "the resolution": OccupancyMap(np.zeros((4, 6), np.uint8), 0.25),
    "the origin": OccupancyMap(np.zeros((4, 6), np.uint8), 0.5, Pose(0.0, 0.0, 0.1)),
}


@pytest.mark.parametrize("other", OTHERS.values(), ids=OTHERS)
def test_maps_are_equal_if_all_of_them_is(other: OccupancyMap) -> None:
    again = OccupancyMap(np.zeros((6, 4), np.uint8).T, 0.5)
    assert again == EMPTY
    assert hash(again) == hash(EMPTY)
    assert other != EMPTY
    assert len({EMPTY, again, other}) == 2


@pytest.mark.parametrize(("a", "b", "block"), BLOCKS.values(), ids=BLOCKS)
def test_blocks_between_corners(a: Point, b: Point, block: tuple[Cell, Cell]) -> None:
    assert EMPTY.edit_rectangle(WALL, a, b)[1:] == block


def test_blocks_follow_the_origin() -> None:
    turned = OccupancyMap(EMPTY.cells, 0.5, Pose(3.0, -1.0, pi / 2))
    assert turned.edit_rectangle(WALL, (2.5, -0.5), (2.0, 0.0))[1:] == ((1, 1), (2, 2))


def test_an_edit_leaves_the_old_map_as_it_was() -> None:
    walled, _, _ = EMPTY.edit_rectangle(WALL, (1.0, 0.5), (4.5, 1.5))
    assert (walled.cells == WALL).sum() == 2 * 4
    assert (EMPTY.cells == FREE).all()
    assert (walled.edit_rectangle(FREE, (-1.5, -1.5), (4.5, 4.5))[0].cells == FREE).all()
    assert (walled.edit_rectangle(OBSTACLE, (-1.5, -1.5), (-0.5, -0.5))[0].cells == walled.cells).all()


@given(st.integers(1, 8), st.integers(1, 8), st.integers(0, 2**32))
def test_blocks_cover_every_cell_of_a_kind_once(rows: int, columns: int, seed: int) -> None:
    cells = np.random.default_rng(seed).integers(0, 3, (rows, columns)).astype(np.uint8)
    covered = np.zeros((rows, columns), int)
    for low, high in OccupancyMap(cells, 1.0).blocks(WALL):
        covered[low[0] : high[0], low[1] : high[1]] += 1
    np.testing.assert_array_equal(covered, cells == WALL)


@given(st.floats(-20, 20), st.floats(-20, 20), st.floats(-3.1, 3.1), st.integers(0, 3), st.integers(0, 5))
def test_a_cells_centre_lies_in_it(x: float, y: float, yaw: float, row: int, column: int) -> None:
    placed = OccupancyMap(EMPTY.cells, 0.5, Pose(x, y, yaw))
    assert placed.cell_of(*placed.centre_of((row, column))) == (row, column)
    assert placed.at(x - cos(yaw) - sin(yaw), y - sin(yaw) + cos(yaw)) == WALL  # outside
