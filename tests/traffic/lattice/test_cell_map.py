"""The lattice of cells, compared with the map from which it is made."""

from itertools import product
from math import hypot, pi

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from swarm.geometry import Pose, from_frame
from swarm.maps.occupancy import OccupancyMap
from swarm.traffic.lattice.cell_map import OUTSIDE, CellMap
from swarm.traffic.lattice.discs import OPEN, compute_flags
from swarm.traffic.lattice.distances import FAR
from swarm.traffic.lattice.offset import best_offset
from swarm.traffic.own_route import find_own_way
from tests.traffic.maps import BAY, SIDE, Drawn


def test_a_disc_fits_only_in_held_cells_and_off_walls() -> None:
    a = BAY.at("a")[0]
    x, y = BAY.cells.centre(a)
    assert BAY.cells.can_fit_disc((a,), x, y, 0.3)
    assert not BAY.cells.can_fit_disc((a,), x + 0.4, y, 0.3)
    assert BAY.cells.can_fit_disc((a, a + 1), x + 0.4, y, 0.3)
    fine = OccupancyMap(np.zeros((24, 24), dtype=np.uint8), 0.1)
    fine.cells[0:3, 0:3] = 1
    cells = CellMap(fine, side=1.2, radius=0.2)
    assert cells.stands[0]
    assert not cells.can_fit_disc((0,), 0.35, 0.35, 0.2)
    assert cells.can_fit_disc((0,), 0.6, 0.6, 0.2)


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
    assert OUTSIDE in BAY.cells.cells_under_disc(0.1, 0.6, 0.2)


# --- the same floor elsewhere, and turned ---

ROOMS = Drawn("######", "#a..b#", "#.##.#", "#c..d#", "######")


@given(
    origin=st.builds(Pose, st.floats(-30.0, 30.0), st.floats(-30.0, 30.0), st.floats(-pi, pi)),
    x=st.floats(0.0, 7.2), y=st.floats(0.0, 6.0), radius=st.floats(0.05, 0.5),
)  # fmt: skip
def test_a_floor_that_lies_elsewhere_and_turned_has_the_same_cells(
    origin: Pose, x: float, y: float, radius: float
) -> None:
    here = ROOMS.cells
    there = CellMap(OccupancyMap(ROOMS.occupancy.cells, SIDE, origin), side=SIDE, radius=0.23)
    assert (there.stands, there.neighbours) == (here.stands, here.neighbours)
    point = from_frame(origin, x, y)
    assume(min(abs(v / SIDE - round(v / SIDE)) for v in (x, y, x - radius, x + radius, y - radius, y + radius)) > 1e-6)
    assert there.cell_of(*point) == here.cell_of(x, y)
    held = here.cells_under_disc(x, y, radius)
    assert there.cells_under_disc(*point, radius) == held
    assert there.can_fit_disc(held, *point, radius) is here.can_fit_disc(held, x, y, radius)
    for cell in ROOMS.at("abcd"):
        assert there.centre(cell) == pytest.approx(from_frame(origin, *here.centre(cell)))
        inside = from_frame(origin, *here.move_inside(cell, (x, y), 0.25))
        assert there.move_inside(cell, point, 0.25) == pytest.approx(inside, abs=1e-6)


@given(x=st.floats(-1.0, 8.0), y=st.floats(-1.0, 7.0), radius=st.floats(0.1, 0.55))
def test_a_place_moved_into_a_cell_fits_and_is_no_farther_than_it_has_to_be(x: float, y: float, radius: float) -> None:
    cells = ROOMS.cells
    for cell in ROOMS.at("abcd"):
        place = cells.move_inside(cell, (x, y), radius)
        assert cells.can_fit_disc((cell,), *place, radius - 1e-6)
        x0, y0 = cells.centre(cell)
        room = SIDE / 2 - radius
        nearest = x0 + max(-room, min(room, x - x0)), y0 + max(-room, min(room, y - y0))
        assert place == pytest.approx(nearest), "nothing solid is in these cells"


def test_a_place_beside_a_wall_inside_its_cell_is_moved_towards_the_middle() -> None:
    """Cells twice as wide as the map's own: a quarter of the cell is solid, and its middle free of it."""
    solid = np.zeros((6, 6), np.uint8)
    solid[3, 3] = 1
    cells = CellMap(OccupancyMap(solid, 0.6, Pose(0.0, 0.0, 0.0)), side=1.8, radius=0.1)
    cell = cells.cell_of(2.0, 2.0)
    x0, y0 = cells.centre(cell)
    x, y = cells.move_inside(cell, (1.8 + 0.65, 1.8 + 0.15), 0.1)
    assert cells.can_fit_disc((cell,), x, y, 0.1 - 1e-6)
    assert hypot(x - x0, y - y0) < hypot(2.45 - x0, 1.95 - y0) + 1e-9


def test_the_place_to_lean_is_at_the_edge_to_the_next_cell() -> None:
    cells = ROOMS.cells
    a, b = ROOMS.at("ab")
    x, y = cells.centre(a)
    assert cells.leaning_point(a, a + 1, 0.3) == pytest.approx((x + SIDE / 2 - 0.3, y))
    assert cells.leaning_point(a, a - cells.columns, 0.3) == pytest.approx((x, y - SIDE / 2 + 0.3))
    assert cells.leaning_point(a, a + 1, SIDE) == pytest.approx((x, y)), "a disc too large stays in the middle"
    assert a + 3 == b


def test_a_way_round_a_corner_is_blind_and_a_straight_one_is_not() -> None:
    cells = ROOMS.cells
    a, b, c = ROOMS.at("abc")
    assert cells.is_blind(a + 1, a), "from beyond the corner comes who enters a from below"
    assert cells.is_blind(c + cells.columns, c)
    straight = Drawn(".....").cells
    assert not any(straight.is_blind(cell, cell + 1) for cell in range(4))
    assert b == a + 3


def test_who_stands_nowhere_is_put_to_the_nearest_place_with_room() -> None:
    cells = ROOMS.cells
    a, b, c, d = ROOMS.at("abcd")
    for cell in (a, b, c, d):
        x, y = cells.centre(cell)
        assert cells.nearest_standable(x + 0.5, y - 0.5) == cell
    wall_x, wall_y = cells.centre(a + cells.columns)  # in the wall above a
    assert cells.nearest_standable(wall_x, wall_y) == a
    assert cells.nearest_standable(wall_x, wall_y, among=(b, d)) == b
    assert cells.nearest_standable(wall_x, wall_y, among=(a + cells.columns,)) == a, "none of these has room"
    assert Drawn("###").cells.nearest_standable(0.0, 0.0) == OUTSIDE


@pytest.mark.parametrize("drawn", [Drawn("a##b"), Drawn("a", "#", "#", "b")], ids=["beside", "above"])
def test_of_two_places_the_nearer_is_chosen(drawn: Drawn) -> None:
    cells, (a, b) = drawn.cells, drawn.at("ab")
    (x0, y0), (x1, y1) = cells.centre(a), cells.centre(b)
    for share, nearest in ((0.3, a), (0.45, a), (0.55, b), (0.7, b)):
        assert cells.nearest_standable(x0 + share * (x1 - x0), y0 + share * (y1 - y0)) == nearest


def test_the_cells_around_are_a_square_cut_at_the_edge() -> None:
    cells = Drawn("abcd", "efgh", "ijkl").cells  # row 0 is i to l
    assert cells.cells_around(5, 1) == [0, 1, 2, 4, 5, 6, 8, 9, 10]
    assert cells.cells_around(0, 1) == [0, 1, 4, 5]
    assert cells.cells_around(11, 1) == [6, 7, 10, 11]
    assert cells.cells_around(5, 0) == [5]
    assert cells.cells_around(5, 9) == list(range(12))
    assert cells.cells_around(OUTSIDE, 3) == []


def test_the_cells_beside_share_a_side_and_are_on_the_lattice() -> None:
    cells = Drawn("ab", "cd", "ef").cells  # row 0 is e and f
    assert [cells.adjacent_cells(cell) for cell in range(6)] == [[1, 2], [0, 3], [0, 3, 4], [1, 2, 5], [2, 5], [3, 4]]


@pytest.mark.parametrize(
    ("walls", "passes"), [((), True), ((0, 4), False), ((1, 4), False), ((2, 4), True), ((0, 2), True)]
)
@pytest.mark.parametrize("turned", [False, True])
def test_a_body_passes_where_the_wall_along_a_common_side_leaves_it_room(
    walls: tuple[int, ...], passes: bool, turned: bool
) -> None:
    """The disc is 0.46 m wide, fine cells are 0.3 m: it passes where two of them are free."""
    solid = np.zeros((8, 8), np.uint8)
    solid[4, slice(*walls) if walls else slice(0)] = 1
    solid[:, 4] = 1  # beyond the other end of that side there is a wall
    cells = CellMap(OccupancyMap(np.ascontiguousarray(solid.T if turned else solid), 0.3), side=1.2, radius=0.23)
    other = 1 if turned else 2
    assert cells.is_passable(0, other) is passes
    assert cells.is_passable(other, 0) is passes


def test_a_disc_swept_along_points_is_in_all_cells_it_touches_and_in_none_outside() -> None:
    cells = Drawn("abcd").cells
    x, y = cells.centre(0)
    assert cells.swept_cells([(x, y)], 0.3) == {0}
    assert cells.swept_cells([(x, y), (x + SIDE, y)], 0.3) == {0, 1}
    assert cells.swept_cells([(x + SIDE / 2, y)], 0.3) == {0, 1}
    assert cells.swept_cells([(x - SIDE / 2, y)], 0.3) == {0}


@pytest.mark.parametrize(("x", "y"), [(0.0, 0.6), (1.2, 0.6), (0.6, 0.0), (0.6, 1.2)])
def test_a_disc_that_reaches_beyond_the_map_does_not_fit_though_its_cell_does(x: float, y: float) -> None:
    """Cells may reach beyond the map by half their side: here by 0.2 m at each edge."""
    floor = OccupancyMap(np.zeros((12, 12), np.uint8), 0.1, Pose(0.0, 0.0, 0.0))
    cells = CellMap(floor, side=0.8, radius=0.2, offset=(-0.2, -0.2))
    edge, held = max(abs(x - 0.6), abs(y - 0.6)), range(len(cells))
    for left, fits in ((0.21, True), (0.15, False)):
        share = 1.0 - left / edge
        assert cells.can_fit_disc(held, 0.6 + share * (x - 0.6), 0.6 + share * (y - 0.6), 0.2) is fits


def test_joins_can_be_left_out() -> None:
    a, b = BAY.at("ab")
    first = find_own_way(BAY.cells, a, b)[0]
    shut = BAY.cells.without_joins([(first, a)])
    assert first not in shut.neighbours[a]
    assert a not in shut.neighbours[first]
    assert first in BAY.cells.neighbours[a], "the others stay as they are"
    assert BAY.cells.without_joins([]) is BAY.cells


@pytest.mark.parametrize(
    ("wall", "wanted", "got"),
    [
        (2.4, 0.32, 0.32),
        (2.4, 0.5, 0.32),  # inside the edge of the cell
        (2.3, 0.26, 0.8 * 0.26),
        (2.3, 0.32, 0.6 * 0.32),
        (2.3, 0.22 + 5e-7, 0.22 + 5e-7),  # as exact as rounding
        (2.3, 0.22 + 1.5e-6, 0.8 * 0.22),
        (2.2, 0.28, 0.4 * 0.28),
        (2.2, 0.32, 0.2 * 0.32),
        (2.1, 0.32, 0.0),
    ],
)
def test_a_place_beside_a_wall_moves_towards_the_middle_until_a_disc_fits(
    wall: float, wanted: float, got: float
) -> None:
    """The middle of the cell is at 1.8 m, its edge at 2.4 m; a disc with a radius of 0.28 m stands left of a wall."""
    for turned in (False, True):
        solid = np.zeros((36, 36), np.uint8)
        column = round(wall / 0.1)
        solid[17:19, column] = 1
        floor = OccupancyMap(solid.T.copy() if turned else solid, 0.1)
        cells = CellMap(floor, side=1.2, radius=0.23)
        middle = cells.cell_of(1.8, 1.8)
        here, there = [(1.8, 1.8 + off) if turned else (1.8 + off, 1.8) for off in (wanted, got)]
        assert cells.move_inside(middle, here, 0.28) == pytest.approx(there)


@pytest.mark.parametrize("origin", [Pose(3.0, -7.0, 0.0), Pose(-2.0, 5.0, 0.7)])
def test_on_a_map_that_lies_elsewhere_and_turned_cells_are_the_same(origin: Pose) -> None:
    solid = np.zeros((36, 48), np.uint8)
    solid[12:20, 24:26] = 1
    here, there = (CellMap(OccupancyMap(solid, 0.1, at), side=1.2, radius=0.23) for at in (Pose(0.0, 0.0, 0.0), origin))
    assert here.neighbours == there.neighbours
    for x, y in ((0.6, 0.6), (1.1, 1.3), (2.3, 3.1), (4.5, 0.2)):
        moved = from_frame(origin, x, y)
        assert set(here.cells_under_disc(x, y, 0.23)) == set(there.cells_under_disc(*moved, 0.23))
        path = here.swept_cells([(x, y), (x, y)], 0.23)
        assert path == there.swept_cells([moved, moved], 0.23) == set(here.cells_under_disc(x, y, 0.23)) - {OUTSIDE}
        assert here.cell_of(x, y) == there.cell_of(*moved)
        for other in ((3.3, 1.4), (0.5, 2.9), (4.3, 3.2)):
            assert here.in_sight((x, y), other) is there.in_sight(moved, from_frame(origin, *other))
        cell = here.cell_of(x, y)
        assert there.move_inside(cell, moved, 0.28) == pytest.approx(
            from_frame(origin, *here.move_inside(cell, (x, y), 0.28))
        )
    assert not here.in_sight((1.1, 1.3), (3.3, 1.4))


@pytest.mark.parametrize(
    ("aside", "apart", "stands"),
    [(1, 1, False), (1, 2, False), (2, 2, True), (0, 2, False), (0, 3, True), (1, 3, True)],
)
def test_a_disc_is_round(aside: int, apart: int, stands: bool) -> None:
    """Its radius is 0.23 m; the nearest corner of the wall is so many fine cells of 0.1 m off its middle, each way.

    0.1 and 0.2 m make 0.224 m, 0.2 and 0.2 m make 0.283 m.
    """
    for down, left, turned in product((False, True), repeat=3):
        row, column = (apart, aside) if turned else (aside, apart)
        solid = np.zeros((12, 12), np.uint8)
        solid[5 - row if down else 6 + row, 5 - column if left else 6 + column] = 1
        assert bool(CellMap(OccupancyMap(solid, 0.1), side=1.2, radius=0.23).stands[0]) is stands


@pytest.mark.parametrize(("along", "up"), [(0.0, 0.0), (0.3, 0.5), (-0.2, 0.1), (0.1, -0.7)])
def test_a_cell_is_open_if_it_is_all_on_the_map_and_nothing_solid_is_in_it(along: float, up: float) -> None:
    """Counted fine cell by fine cell; cells of 1.2 m on a map of 4 m, twelve fine cells to a side."""
    solid = np.random.default_rng(3).random((40, 40)) < 0.003
    flags = np.zeros((4, 3, 3), np.bool_)
    compute_flags(np.pad(solid, 1, constant_values=True), 0.1, along, up, 1.2, 0.23, 0, 0, 3, 3, flags)
    wide = np.pad(solid, 40, constant_values=True)
    low, left = 40 + round(up / 0.1), 40 + round(along / 0.1)
    blocks = [[wide[low + 12 * row :, left + 12 * column :][:12, :12] for column in range(3)] for row in range(3)]
    assert flags[OPEN].tolist() == [[not block.any() for block in row] for row in blocks]
    assert 0 < flags[OPEN].sum() < 9


def test_a_cell_all_beyond_the_map_is_no_place_to_stand() -> None:
    floor = OccupancyMap(np.zeros((12, 12), np.uint8), 0.1)
    cells = CellMap(floor, side=1.2, radius=0.23, offset=(-1.2, -1.2))
    assert cells.stands == (False, False, False, True)


@pytest.mark.parametrize(("over", "stands"), [(0.0, True), (1e-12, True), (3e-12, False), (0.01, False)])
def test_a_disc_may_touch_a_wall_and_reach_into_it_by_what_rounding_makes(over: float, stands: bool) -> None:
    """A cell of 1 m with a wall 0.25 m off its middle; a disc of 0.25 m that reaches in by 2e-12 m is refused."""
    for row, column in ((1, 4), (6, 4), (4, 1), (4, 6)):
        solid = np.zeros((8, 8), np.uint8)
        solid[row - (row == 4) : row + 1, column - (column == 4) : column + 1] = 1
        cells = CellMap(OccupancyMap(solid, 0.125), side=1.0, radius=0.25 + over)
        assert cells.stands[0] is stands, (row, column)


@pytest.mark.parametrize(("wall", "stands"), [(7, False), (8, False), (9, True), (4, False), (3, False), (2, True)])
def test_a_large_disc_is_looked_round_as_far_as_it_reaches(wall: int, stands: bool) -> None:
    """A disc with a radius of 3 m in the middle of 12 m, and a wall 1 m wide."""
    for turned in (False, True):
        solid = np.zeros((12, 12), np.uint8)
        solid[wall] = 1
        floor = OccupancyMap(solid.T.copy() if turned else solid, 1.0)
        assert CellMap(floor, side=12.0, radius=3.0).stands[0] is stands


@pytest.mark.parametrize(("over", "is_open"), [(0.5e-6, True), (1.5e-6, False)])
@pytest.mark.parametrize("side", ["left", "right", "below", "above"])
def test_a_cell_that_reaches_into_a_wall_by_rounding_alone_is_open(side: str, over: float, is_open: bool) -> None:
    """A cell of 4 x 4 m over fine cells of 1 m; what solid cells it overlaps by less than a millionth do not count."""
    solid = np.ones((8, 8), np.bool_)
    solid[2:6, 2:6] = False
    along = {"left": 2.0 - over, "right": 2.0 + over}.get(side, 2.0)
    up = {"below": 2.0 - over, "above": 2.0 + over}.get(side, 2.0)
    flags = np.zeros((4, 1, 1), np.bool_)
    compute_flags(np.pad(solid, 1, constant_values=True), 1.0, along, up, 4.0, 0.5, 0, 0, 1, 1, flags)
    assert bool(flags[OPEN, 0, 0]) is is_open


def test_a_long_sweep_of_a_large_disc_is_in_all_cells() -> None:
    cells = CellMap(OccupancyMap(np.zeros((3, 400), np.uint8), SIDE), side=SIDE, radius=0.23)
    path = np.column_stack([np.linspace(SIDE, 399 * SIDE, 4000), np.full(4000, 1.5 * SIDE)])
    assert cells.swept_cells(path, 2 * SIDE) == set(range(1200))
    assert cells.swept_in_order(path[:1], 0.1) == (400, 401)
    assert cells.swept_in_order(path[[-1, 0]], 0.1) == (798, 799, 400, 401)


def test_the_newest_256_tables_of_distances_are_kept() -> None:
    cells = CellMap(OccupancyMap(np.zeros((20, 20), np.uint8), SIDE), side=SIDE, radius=0.23)
    first, second, *_ = [cells.distances(goal) for goal in range(256)]
    assert cells.distances(0) is first
    cells.distances(256)
    assert cells.distances(1) is second
    assert cells.distances(0) is not first, "the oldest was dropped"


def test_all_tables_of_distances_share_their_numbers() -> None:
    """Each FAR was an object of its own: 32 bytes, beside the 8 in the table."""
    cells = CellMap(OccupancyMap(np.zeros((20, 20), np.uint8), SIDE), side=SIDE, radius=0.23)
    wall = range(200, 220)
    tables = [cells.distances(goal, wall) for goal in (*range(200), *range(220, 276))]
    assert {number for table in tables for number in table} == {*range(19 + 9 + 1), FAR}
    assert len({id(number) for table in tables for number in table if number == FAR}) == 1


def test_numbers_beyond_those_known_are_made_once() -> None:
    path = np.ones((2, 1300), np.uint8)
    path[0] = 0
    cells = CellMap(OccupancyMap(path, SIDE), side=SIDE, radius=0.23)
    near = cells.distances(650, {640, 660})[:1300]
    far, again = (cells.distances(goal)[:1300] for goal in (0, 1299))
    assert near == [abs(cell - 650) if 640 < cell < 660 else FAR for cell in range(1300)]
    assert far == list(range(1300)) == again[::-1]
    assert {id(number) for number in again} == {id(number) for number in far}


@pytest.mark.parametrize(("side", "kept"), [(128, 16), (512, 1)])
def test_tables_of_a_wide_floor_are_fewer(side: int, kept: int) -> None:
    cells = CellMap(OccupancyMap(np.ones((side, side), np.uint8), SIDE), side=SIDE, radius=0.23)
    first = cells.distances(0)
    for goal in range(1, kept):
        cells.distances(goal)
    assert cells.distances(0) is first
    cells.distances(kept)
    assert cells.distances(0) is not first


@pytest.mark.parametrize(("fine", "count"), [(0.5, 1), (0.5 + 1e-10, 1), (0.5 + 1e-8, 2), (0.3, 1), (0.1, 0)])
def test_a_row_counts_from_half_a_cell_on_but_for_rounding(fine: float, count: int) -> None:
    """Three fine cells against half a cell more than one cell of 1 m."""
    cells = CellMap(OccupancyMap(np.zeros((3, 20), np.uint8), fine), side=1.0, radius=0.1)
    assert cells.rows == count
    cells = CellMap(OccupancyMap(np.zeros((20, 3), np.uint8), fine), side=1.0, radius=0.1)
    assert cells.columns == count


def test_one_point_is_swept_as_many_are() -> None:
    cells = Drawn("abcd").cells
    x, y = cells.centre(0)
    assert cells.swept_cells([(x + SIDE * (k // 50), y) for k in range(100)], 0.3) == {0, 1}


@pytest.mark.parametrize(
    ("along", "up", "is_open"), [(0.0, 0.0, True), (-1.0, 0, False), (1.0, 0, False), (0, -1.0, False), (0, 1.0, False)]
)
def test_a_cell_partly_off_a_free_map_is_not_open(along: float, up: float, is_open: bool) -> None:
    flags = np.zeros((4, 1, 1), np.bool_)
    free = np.pad(np.zeros((4, 4), np.bool_), 1, constant_values=True)
    compute_flags(free, 1.0, float(along), float(up), 4.0, 0.5, 0, 0, 1, 1, flags)
    assert bool(flags[OPEN, 0, 0]) is is_open
