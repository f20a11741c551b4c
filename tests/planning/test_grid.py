"""The grown grid, compared with plain definitions."""

from math import hypot

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from swarm.errors import ConfigError
from swarm.geometry import Pose
from swarm.maps.occupancy import FREE, OBSTACLE, UNKNOWN, WALL, OccupancyMap
from swarm.maps.text import from_text
from swarm.planning.distance import clearance_of
from swarm.planning.grid import Grid
from tests.planning.shared import grids

FIELDS = ("free", "clearance", "solid", "moves")


def plain_clearance(solid: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Measure by brute force from each centre to each solid square, the ring outside among them [cells]."""
    ring = np.argwhere(np.pad(solid, 1, constant_values=True)) - 1
    centres = np.argwhere(np.ones_like(solid))
    gap = np.maximum(np.abs(centres[:, None, :] - ring[None, :, :]) - 0.5, 0.0)
    distances: NDArray[np.float64] = np.hypot(gap[..., 0], gap[..., 1]).min(axis=1).reshape(solid.shape)
    return distances


@given(free=grids())
def test_clearance_is_the_distance_to_the_nearest_solid_square(free: NDArray[np.bool_]) -> None:
    solid = (~free).astype(np.uint8)
    measured = clearance_of(solid, 0.5, (0, 0), solid.shape)
    np.testing.assert_allclose(measured, plain_clearance(~free) * 0.5, rtol=1e-6)


@given(free=grids(), data=st.data())
def test_clearance_of_a_block_is_that_part_of_the_whole(free: NDArray[np.bool_], data: st.DataObject) -> None:
    solid = (~free).astype(np.uint8)
    low = data.draw(st.tuples(*(st.integers(0, side - 1) for side in free.shape)))
    high = tuple(data.draw(st.integers(a + 1, side)) for a, side in zip(low, free.shape, strict=True))
    whole = clearance_of(solid, 0.1, (0, 0), solid.shape)
    block = clearance_of(solid, 0.1, (low[0], low[1]), (high[0], high[1]))
    np.testing.assert_array_equal(block, whole[low[0] : high[0], low[1] : high[1]])


def test_cells_are_divided_until_they_are_fine_enough() -> None:
    drawn = from_text("....\n....\n....", 0.5)
    for resolution, factor in ((None, 1), (0.5, 1), (0.3, 2), (0.1, 5), (0.09, 6), (2.0, 1)):
        grid = Grid.grown(drawn, 0.2, resolution=resolution)
        assert grid.shape == (3 * factor, 4 * factor)
        assert grid.resolution == pytest.approx(0.5 / factor)
        assert grid.free.any()


def test_free_is_where_the_disc_touches_nothing() -> None:
    drawn = from_text("......\n..##..\n......", 0.5)
    grid = Grid.grown(drawn, radius=0.21, resolution=0.1)
    np.testing.assert_array_equal(grid.free, plain_clearance(grid.solid > 0) * 0.1 > 0.21)


def test_margin_closes_no_passage_but_makes_it_dear() -> None:
    drawn = from_text("#####\n.....\n#####", 0.5)
    narrow = Grid.grown(drawn, 0.2, margin=0.3, resolution=0.1)
    np.testing.assert_array_equal(narrow.free, Grid.grown(drawn, 0.2, resolution=0.1).free)
    assert narrow.free[7, 7]
    assert narrow.cost[7, 7] > 2 * 64
    assert narrow.cost.max() <= 7 * 64


def test_unknown_is_solid_unless_told() -> None:
    cells = np.array([[FREE, UNKNOWN, OBSTACLE, WALL]], np.uint8)
    for unknown_free, solid in ((False, [0, 1, 1, 1]), (True, [0, 0, 1, 1])):
        assert Grid.grown(OccupancyMap(cells, 1.0), 0.1, unknown_free=unknown_free).solid.tolist() == [solid]


@given(free=grids(10), data=st.data(), radius=st.sampled_from((0.0, 0.2, 0.26, 0.8)), factor=st.integers(1, 3))
def test_changed_is_the_same_as_grown_anew(
    free: NDArray[np.bool_], data: st.DataObject, radius: float, factor: int
) -> None:
    cells = np.where(free, FREE, WALL).astype(np.uint8)
    grid = Grid.grown(OccupancyMap(cells, 0.5), radius, resolution=0.5 / factor)
    for _ in range(3):
        low = data.draw(st.tuples(*(st.integers(0, side - 1) for side in free.shape)))
        high = data.draw(st.tuples(*(st.integers(a + 1, side) for a, side in zip(low, free.shape, strict=True))))
        cells = cells.copy()
        cells[low[0] : high[0], low[1] : high[1]] = data.draw(st.sampled_from((FREE, WALL, OBSTACLE)))
        edited = OccupancyMap(cells, 0.5)
        grid = grid.update_cells(edited, (low[0], low[1]), (high[0], high[1]))
        again = Grid.grown(edited, radius, resolution=0.5 / factor)
        for name in FIELDS:
            np.testing.assert_array_equal(getattr(grid, name), getattr(again, name), err_msg=name)


def test_changed_refuses_what_it_cannot_do() -> None:
    drawn = from_text("....\n....", 0.5)
    grid = Grid.grown(drawn, 0.1)
    with pytest.raises(ValueError, match="without discs"):
        grid.with_discs([(0.5, 0.5)], 0.1).update_cells(drawn, (0, 0), (1, 1))
    with pytest.raises(ValueError, match="2 rows"):
        grid.update_cells(from_text("....", 0.5), (0, 0), (1, 1))
    assert grid.update_cells(drawn, (5, 5), (9, 9)) is grid


def test_discs_block_the_cells_where_the_two_would_touch() -> None:
    drawn = from_text("\n".join(["." * 12] * 12), 0.5)
    grid = Grid.grown(drawn, 0.2, resolution=0.1)
    centres = [(2.03, 3.0), (5.9, 5.9), (40.0, 1.0)]
    crowded = grid.with_discs(centres, 0.25)
    for row in range(grid.shape[0]):
        for column in range(grid.shape[1]):
            x, y = grid.centre_of((row, column))
            away = min(hypot(x - cx, y - cy) for cx, cy in centres)
            assert crowded.free[row, column] == (grid.free[row, column] and away > 0.45)
    assert grid.discs.shape == (0, 3)
    assert crowded.discs.shape == (3, 3)
    np.testing.assert_array_equal(grid.with_discs([], 0.25).moves, grid.moves)


@given(st.floats(-50, 50), st.floats(-50, 50), st.floats(-3, 3), st.floats(0.01, 2))
def test_cells_and_points_agree_under_any_origin(x: float, y: float, yaw: float, resolution: float) -> None:
    grid = Grid.grown(OccupancyMap(np.zeros((7, 9), np.uint8), resolution, Pose(x, y, yaw)), 0.0)
    for cell in ((0, 0), (6, 8), (3, 2)):
        assert grid.cell_of(*grid.centre_of(cell)) == cell


@given(free=grids(8), x=st.floats(0, 3.99), y=st.floats(0, 3.99))
def test_room_is_the_distance_to_whatever_is_nearest(free: NDArray[np.bool_], x: float, y: float) -> None:
    grid = Grid.grown(OccupancyMap(np.where(free, FREE, WALL).astype(np.uint8), 0.5), 0.1)
    ring = np.argwhere(np.pad(~free, 1, constant_values=True)) - 1
    gap = np.maximum(np.maximum(ring - (y / 0.5, x / 0.5), (y / 0.5, x / 0.5) - ring - 1.0), 0.0)
    expected = float(np.hypot(gap[:, 0], gap[:, 1]).min()) * 0.5
    outside = x >= free.shape[1] * 0.5 or y >= free.shape[0] * 0.5
    assert grid.room_at(x, y) == pytest.approx(0.0 if outside else expected, abs=1e-9)


@pytest.mark.parametrize(
    ("radius", "margin", "resolution"), [(-0.1, 0, None), (float("nan"), 0, None), (0.1, -1, None), (0.1, 0, 0.0)]
)
def test_lengths_that_are_none_are_refused(radius: float, margin: float, resolution: float | None) -> None:
    with pytest.raises(ConfigError, match="expected"):
        Grid.grown(from_text("..", 0.5), radius, margin, resolution)


def test_a_grid_too_large_is_refused_before_it_is_built() -> None:
    with pytest.raises(ConfigError, match=r"planning grid of cells of 0\.0001 m: expected"):
        Grid.grown(from_text("....\n....", 1.0), 0.1, resolution=0.0001)
