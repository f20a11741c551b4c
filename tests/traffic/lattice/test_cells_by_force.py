"""Cells and the space between their walls, compared with shapely; ways, compared with networkx."""

from collections.abc import Sequence
from math import hypot

import networkx as nx
import numpy as np
import shapely
from hypothesis import assume, given
from hypothesis import strategies as st

from swarm.geometry import Pose
from swarm.maps.occupancy import FREE, UNKNOWN, WALL, OccupancyMap, Point
from swarm.traffic.lattice.cell_map import OUTSIDE, SIGHT, CellMap
from swarm.traffic.lattice.distances import FAR
from tests.shared import with_block

FINE = 0.2  # m, a square of the map
SIDE = 0.7  # m, a cell: no multiple of a square
ROWS, COLUMNS = 14, 18  # squares
HEIGHT, WIDTH = ROWS * FINE, COLUMNS * FINE  # m
HAIR = 1e-6  # m, what is nearer to a limit than that is not judged
ORIGIN = Pose(0.0, 0.0, 0.0)

floors = st.builds(
    lambda seed, walls: OccupancyMap(
        np.where(np.random.default_rng(seed).random((ROWS, COLUMNS)) < walls, WALL, FREE).astype(np.uint8), FINE, ORIGIN
    ),
    st.integers(0, 10_000),
    st.sampled_from([0.0, 0.03, 0.1]),
)
offsets = st.tuples(st.sampled_from([0.0, -0.175, 0.1]), st.sampled_from([0.0, -0.35, 0.1]))
radii = st.floats(0.05, 0.6)
xs, ys = st.floats(-0.3, WIDTH + 0.3), st.floats(-0.3, HEIGHT + 0.3)


def lattice(floor: OccupancyMap, offset: Point, radius: float = 0.2) -> CellMap:
    return CellMap(floor, side=SIDE, radius=radius, offset=offset)


def box_of(cells: CellMap, cell: int) -> shapely.Geometry:
    row, column = divmod(cell, cells.columns)
    x, y = cells.offset[0] + column * SIDE, cells.offset[1] + row * SIDE
    return shapely.box(x, y, x + SIDE, y + SIDE)


def solid_of(floor: OccupancyMap) -> shapely.Geometry:
    """Everything a disc may not reach into: the solid squares, and all that is off the map."""
    squares = [
        shapely.box(column * FINE, row * FINE, (column + 1) * FINE, (row + 1) * FINE)
        for row, column in np.argwhere(floor.cells != FREE).tolist()
    ]
    return shapely.union_all([*squares, shapely.box(-9, -9, 19, 19) - shapely.box(0, 0, WIDTH, HEIGHT)])


def clear(solid: shapely.Geometry, place: Sequence[Point], radius: float) -> bool:
    """Return True if a disc stays off what is solid at a point, or along a line; what is too close to call is left out."""
    gap = shapely.distance(solid, shapely.LineString(place) if len(place) > 1 else shapely.Point(*place[0]))
    assume(abs(gap - radius) > HAIR)
    return bool(gap > radius)


@given(floors, offsets)
def test_the_lattice_covers_the_floor_to_half_a_cell(floor: OccupancyMap, offset: Point) -> None:
    cells = lattice(floor, offset)
    for count, first, length in ((cells.columns, offset[0], WIDTH), (cells.rows, offset[1], HEIGHT)):
        assert abs(first + count * SIDE - length) <= SIDE / 2 + 1e-9
    assert [cells.cell_of(*cells.centre(cell)) for cell in range(len(cells))] == list(range(len(cells)))
    assert len(cells) == len(cells.stands) == len(cells.neighbours) == cells.rows * cells.columns


@given(floors, offsets, st.floats(0.1, 0.4))
def test_cells_are_joined_where_a_disc_stays_clear_from_middle_to_middle(
    floor: OccupancyMap, offset: Point, radius: float
) -> None:
    cells, solid = lattice(floor, offset, radius), solid_of(floor)
    for cell in range(len(cells)):
        row, column = divmod(cell, cells.columns)
        here = cells.centre(cell)
        assert cells.stands[cell] is clear(solid, [here], radius)
        beside = {cell + 1: column + 1 < cells.columns, cell + cells.columns: row + 1 < cells.rows}
        for other in (other for other, there in beside.items() if there):
            joined = clear(solid, [here, cells.centre(other)], radius)
            assert (other in cells.neighbours[cell]) is (cell in cells.neighbours[other]) is joined


@given(offsets, xs, ys, radii)
def test_a_disc_touches_the_cells_that_it_overlaps(offset: Point, x: float, y: float, radius: float) -> None:
    cells = lattice(OccupancyMap(np.zeros((ROWS, COLUMNS), np.uint8), FINE, ORIGIN), offset)
    disc, overlapped = shapely.Point(x, y), []
    for cell in range(len(cells)):
        gap = shapely.distance(disc, box_of(cells, cell))
        assume(abs(gap - radius) > HAIR)
        if gap < radius:
            overlapped.append(cell)
    touched = cells.cells_under_disc(x, y, radius)
    assert [cell for cell in touched if cell != OUTSIDE] == overlapped
    x0, y0 = offset
    inside = min(x - x0, y - y0, x0 + cells.columns * SIDE - x, y0 + cells.rows * SIDE - y)
    assume(abs(inside - radius) > HAIR)
    assert (OUTSIDE in touched) is (inside < radius)


@given(floors, offsets, st.floats(0.0, WIDTH), st.floats(0.0, HEIGHT), st.floats(0.05, 0.5), st.data())
def test_a_disc_fits_where_all_it_touches_is_held_and_no_wall_is_in_it(
    floor: OccupancyMap, offset: Point, x: float, y: float, radius: float, data: st.DataObject
) -> None:
    cells = lattice(floor, offset)
    touched = cells.cells_under_disc(x, y, radius)
    free = clear(solid_of(floor), [(x, y)], radius)
    held = {*touched, data.draw(st.integers(0, len(cells) - 1))} - {OUTSIDE}  # which nobody holds
    assert cells.can_fit_disc(held, x, y, radius) is (free and OUTSIDE not in touched)
    assert not cells.can_fit_disc(held - {data.draw(st.sampled_from(touched))}, x, y, radius)


@given(floors, st.floats(0.0, WIDTH), st.floats(0.0, HEIGHT), st.floats(0.0, WIDTH), st.floats(0.0, HEIGHT))
def test_what_a_wall_lies_across_is_out_of_sight_and_what_has_room_all_along_is_seen(
    floor: OccupancyMap, ax: float, ay: float, bx: float, by: float
) -> None:
    """The line is tried each 0.1 m, its ends left out: between these two, either answer will do."""
    seen = lattice(floor, (0.0, 0.0)).in_sight((ax, ay), (bx, by))
    assume(hypot(bx - ax, by - ay) > HAIR)  # shapely divides by the length of a line
    line, solid = shapely.LineString([(ax, ay), (bx, by)]), solid_of(floor)
    if shapely.distance(line, solid) > SIGHT:
        assert seen
    if shapely.intersection(line, shapely.buffer(solid, -0.01)).length > SIGHT:
        assert not seen


@given(floors, st.integers(0, 10_000), st.data())
def test_an_unknown_square_is_solid_unless_it_is_taken_for_free(
    floor: OccupancyMap, seed: int, data: st.DataObject
) -> None:
    unknown = np.random.default_rng(seed).random((ROWS, COLUMNS)) < 0.1

    def with_(kind: int) -> OccupancyMap:
        return OccupancyMap(np.where(unknown & (floor.cells == FREE), kind, floor.cells).astype(np.uint8), FINE, ORIGIN)

    for taken_for_free, kind in ((True, FREE), (False, WALL)):
        one = CellMap(with_(UNKNOWN), side=SIDE, radius=0.2, unknown_is_free=taken_for_free)
        other = CellMap(with_(kind), side=SIDE, radius=0.2)
        assert (one.stands, one.neighbours) == (other.stands, other.neighbours)
        x, y = data.draw(st.tuples(st.floats(0.3, WIDTH - 0.3), st.floats(0.3, HEIGHT - 0.3)))
        held = one.cells_under_disc(x, y, 0.2)
        assert one.can_fit_disc(held, x, y, 0.2) is other.can_fit_disc(held, x, y, 0.2)


blocks = st.tuples(
    st.integers(0, ROWS), st.integers(0, ROWS), st.integers(0, COLUMNS), st.integers(0, COLUMNS), st.integers(0, 3)
)


@given(floors, offsets, st.lists(blocks, max_size=4), st.booleans())
def test_cells_after_edits_are_those_made_anew(
    floor: OccupancyMap, offset: Point, edits: list[tuple[int, int, int, int, int]], free: bool
) -> None:
    def made(of: OccupancyMap) -> CellMap:
        return CellMap(of, side=SIDE, radius=0.2, offset=offset, unknown_is_free=free)

    cells = made(floor)
    for a, b, c, d, kind in edits:
        low, high = (min(a, b), min(c, d)), (max(a, b), max(c, d))
        floor, before = with_block(floor, low, high, kind), cells
        cells, again = cells.update_cells(floor, low, high), made(floor)
        assert (cells.stands, cells.neighbours) == (again.stands, again.neighbours)
        assert (cells.neighbours is before.neighbours) is (again.neighbours == before.neighbours)
        for cell in range(len(cells)):
            x, y = cells.centre(cell)
            assert cells.can_fit_disc((cell,), x, y, 0.2) is again.can_fit_disc((cell,), x, y, 0.2)


@given(floors, offsets, st.data())
def test_steps_are_those_of_a_shortest_way_that_enters_nothing_shut(
    floor: OccupancyMap, offset: Point, data: st.DataObject
) -> None:
    cells = lattice(floor, offset)
    some = st.lists(st.integers(0, len(cells) - 1), max_size=4)
    source, shut = data.draw(st.tuples(st.integers(0, len(cells) - 1), some))
    graph = nx.DiGraph([(a, b) for a, near in enumerate(cells.neighbours) for b in near if b not in shut])
    graph.add_nodes_from(range(len(cells)))
    expected = nx.single_source_dijkstra_path_length(graph, source)
    assert cells.distances(source, shut) == [expected.get(cell, FAR) for cell in range(len(cells))]


@given(floors, st.data())
def test_parted_cells_are_no_neighbours_and_no_way_leads_from_one_to_the_other(
    floor: OccupancyMap, data: st.DataObject
) -> None:
    cells = lattice(floor, (0.0, 0.0))
    pairs = [(a, b) for a, near in enumerate(cells.neighbours) for b in near]
    assume(pairs)
    a, b = data.draw(st.sampled_from(pairs))
    assert cells.distances(b)[a] == 1
    parted = cells.without_joins([(a, b)])
    assert parted.distances(b)[a] != 1, "what was counted before is forgotten"
    assert cells.distances(b)[a] == 1, "the cells it was made of stay as they are"
    for cell, near in enumerate(cells.neighbours):
        gone = {a: b, b: a}.get(cell)
        assert parted.neighbours[cell] == tuple(other for other in near if other != gone)


@given(floors, st.data())
def test_two_cells_are_of_one_piece_exactly_if_a_way_joins_them_also_when_cells_are_parted(
    floor: OccupancyMap, data: st.DataObject
) -> None:
    cells = lattice(floor, (0.0, 0.0))
    pairs = [(a, b) for a, near in enumerate(cells.neighbours) for b in near]
    shut = data.draw(st.lists(st.sampled_from(pairs), max_size=9)) if pairs else []
    for one in (cells, cells.without_joins(shut)):
        assert one.pieces[OUTSIDE] == OUTSIDE
        for cell in range(len(one)):
            same = [other for other in range(len(one)) if one.pieces[other] == one.pieces[cell]]
            assert same == [other for other, steps in enumerate(one.distances(cell)) if steps < FAR]
