"""Rays over solid cells, compared with shapely, which works on squares and lines without cells."""

from math import cos, floor, hypot, pi, sin

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from swarm.geometry import Pose, to_frame
from swarm.maps.occupancy import WALL, OccupancyMap
from swarm.planning.grid import Grid
from swarm.planning.rays import distances_on_map, note_ray

SIDE = 12  # cells
EDGE = 1e-6  # cells: a ray that only grazes a corner may count as a hit or not

angles = st.floats(-pi, pi)
places = st.tuples(st.floats(1.01, SIDE - 1.01), st.floats(1.01, SIDE - 1.01))
solids = st.sets(st.tuples(st.integers(0, SIDE - 1), st.integers(0, SIDE - 1)), max_size=25)
GAIN, LOSS, MOST, SOLID = 2, 1, 10, 4


def with_border(solid: set[tuple[int, int]], but: tuple[int, int]) -> set[tuple[int, int]]:
    border = {(r, c) for r in range(SIDE) for c in range(SIDE) if r in {0, SIDE - 1} or c in {0, SIDE - 1}}
    return (solid | border) - {but}


def first_hit(solid: set[tuple[int, int]], x: float, y: float, heading: float, reach: float, wider: float) -> float:
    """How far a ray gets before squares that are ``wider`` on each side [cells]."""
    ray = shapely.LineString([(x, y), (x + reach * cos(heading), y + reach * sin(heading))])
    squares = [shapely.box(c - wider, r - wider, c + 1 + wider, r + 1 + wider) for r, c in solid]
    met = shapely.unary_union(squares).intersection(ray)
    return reach if met.is_empty else min(reach, shapely.Point(x, y).distance(met))


@given(solids, places, angles, st.floats(0.1, 30.0), st.floats(-3.0, 3.0))
def test_a_ray_reads_what_shapely_measures(
    solid: set[tuple[int, int]], place: tuple[float, float], heading: float, reach: float, turned: float
) -> None:
    x, y = place
    walls = with_border(solid, (floor(y), floor(x)))
    cells = np.zeros((SIDE, SIDE), np.uint8)
    for cell in walls:
        cells[cell] = WALL
    side = 0.25
    origin = Pose(3.0, -2.0, turned)
    grid = Grid.grown(OccupancyMap(cells, side, origin), 0.1)
    here = grid.from_cells(x, y)
    read = distances_on_map(grid, Pose(*here, heading), [turned], reach * side).min()
    x, y = (part / side for part in to_frame(origin, *here))
    longest = first_hit(walls, x, y, heading, reach, -EDGE)
    shortest = first_hit(walls, x, y, heading, reach, EDGE)
    assert shortest - 1e-4 <= read / side <= longest + 1e-4


def test_the_nearest_of_several_rays_counts() -> None:
    cells = np.zeros((SIDE, SIDE), np.uint8)
    cells[:, 8] = WALL
    grid = Grid.grown(OccupancyMap(cells, 1.0), 0.1)
    assert distances_on_map(grid, Pose(5.5, 5.5, 0.0), [-0.5, 0.0, 0.5], 10.0).min() == pytest.approx(2.5)
    assert distances_on_map(grid, Pose(5.5, 5.5, pi), [0.0], 4.0).min() == 4.0


def test_outside_the_grid_everything_is_solid() -> None:
    grid = Grid.grown(OccupancyMap(np.zeros((SIDE, SIDE), np.uint8), 1.0), 0.1)
    assert distances_on_map(grid, Pose(5.5, 5.5, 0.0), [0.0], 100.0).min() == pytest.approx(6.5)
    assert distances_on_map(grid, Pose(-5.0, 5.5, 0.0), [0.0], 100.0).min() == 0.0


def noted(place: tuple[float, float], heading: float, length: float, hit: bool) -> NDArray[np.int8]:
    odds = np.zeros((SIDE, SIDE), np.int8)
    note_ray(odds, *place, heading, length, 0.0, 0.0, hit, GAIN, LOSS, MOST, SOLID)
    return odds


@given(places, angles, st.floats(0.0, 20.0), st.booleans())
def test_a_noted_ray_frees_only_what_it_crossed_and_blames_only_where_it_ended(
    place: tuple[float, float], heading: float, length: float, hit: bool
) -> None:
    odds = noted(place, heading, length, hit)
    (x, y), end = place, (place[0] + (length + 0.01) * cos(heading), place[1] + (length + 0.01) * sin(heading))
    ray = shapely.LineString([(x, y), end])
    for row, column in np.argwhere(odds < 0).tolist():
        assert ray.distance(shapely.box(column, row, column + 1, row + 1)) < EDGE
    blamed = [tuple(cell) for cell in np.argwhere(odds > 0).tolist()]
    last = floor(end[1]), floor(end[0])
    assert blamed in ([], [last])
    if hit and 0 <= last[0] < SIDE and 0 <= last[1] < SIDE:
        assert odds[last] == GAIN


@given(places, angles)
def test_a_long_ray_frees_all_it_crossed(place: tuple[float, float], heading: float) -> None:
    length = 5.0
    odds = noted(place, heading, length, hit=False)
    (x, y), end = place, (place[0] + (length - 0.7) * cos(heading), place[1] + (length - 0.7) * sin(heading))
    ray = shapely.LineString([(x, y), end])
    last = floor(y + (length + 0.01) * sin(heading)), floor(x + (length + 0.01) * cos(heading))
    for row in range(SIDE):
        for column in range(SIDE):
            if (
                ray.intersection(shapely.box(column, row, column + 1, row + 1).buffer(-EDGE)).length > 0.01
                and (row, column) != last
            ):
                assert odds[row, column] < 0, (row, column)


def test_counts_stay_within_their_bounds() -> None:
    odds = np.zeros((SIDE, SIDE), np.int8)
    for _ in range(200):
        note_ray(odds, 2.5, 2.5, 0.0, 4.0, 0.0, 0.0, True, GAIN, LOSS, MOST, SOLID)
    assert odds.min() == -MOST
    assert odds.max() == MOST
    assert odds[2, 6] == MOST


# fmt: off
HITS = {  # cells known to be solid before, length [cells] of a ray along +x from 2.5, nearer, farther: the cell it hit
    "nothing known":              ((),     4.0, 0.8, 0.6, 6),
    "the end is solid":           ((6, 5), 4.0, 0.8, 0.6, 6),
    "a wall a little before it":  ((5,),   4.0, 0.8, 0.0, 5),
    "a wall too far before it":   ((5,),   4.4, 0.8, 0.9, 6),
    "a wall a little behind it":  ((7,),   4.0, 0.0, 0.6, 7),
    "a wall too far behind it":   ((7,),   3.8, 0.9, 0.6, 6),
    "no doubt":                   ((5, 7), 4.0, 0.0, 0.0, 6),
}
# fmt: on


@pytest.mark.parametrize("name", HITS)
def test_a_hit_counts_for_the_wall_that_it_may_be_on(name: str) -> None:
    known, length, nearer, farther, hit = HITS[name]
    odds = np.zeros((SIDE, SIDE), np.int8)
    odds[2, list(known)] = SOLID
    before = odds.copy()
    note_ray(odds, 2.5, 2.5, 0.0, length, nearer, farther, True, GAIN, LOSS, MOST, SOLID)
    assert np.argwhere(odds > before).tolist() == [[2, hit]]


def test_rays_that_lead_off_the_floor_leave_it_whole() -> None:
    for heading in np.linspace(-pi, pi, 33):
        note_ray(
            np.zeros((SIDE, SIDE), np.int8), 0.5, 0.5, float(heading), 40.0, 0.0, 0.0, True, GAIN, LOSS, MOST, SOLID
        )
        assert hypot(cos(heading), sin(heading)) == pytest.approx(1.0)
