"""Paths in metres, checked with shapely, and the arithmetic along them."""

from itertools import pairwise
from math import dist, hypot, inf

import numpy as np
import pytest
import shapely
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from swarm.geometry import Pose
from swarm.maps.occupancy import FREE, WALL, OccupancyMap, Point
from swarm.maps.text import from_text
from swarm.planning.grid import UNIT, Grid
from swarm.planning.path import Path, is_reachable, line_is_free, plan
from swarm.planning.path_check import Judge
from tests.shared import DATA, needs_data

ROOMS = from_text(
    """\
####################
#..................#
#..##..............#
#....o...####..#####
#....o...#.........#
#........#.........#
#..###...#...###...#
#....#.......#.....#
####################""",
    0.5,
)
millimetres = st.integers(0, 8999).map(lambda each: each / 1000)


places = st.tuples(millimetres, st.integers(0, 7999).map(lambda each: each / 1000))


def random_map(seed: int, yaw: float = 0.0) -> OccupancyMap:
    """Draw scattered walls, each cell half a metre."""
    cells = np.where(np.random.default_rng(seed).random((16, 18)) < 0.13, WALL, FREE).astype(np.uint8)
    return OccupancyMap(cells, 0.5, Pose(-3.0, 2.0, yaw))


@given(
    seed=st.integers(0, 50),
    yaw=st.sampled_from((0.0, 0.7)),
    radius=st.sampled_from((0.11, 0.2, 0.3)),
    margin=st.sampled_from((0.0, 0.1, 0.3)),
    ends=st.tuples(*[st.floats(0.0, 1.0)] * 4),
)
def test_the_disc_touches_nothing_on_any_planned_path(
    seed: int, yaw: float, radius: float, margin: float, ends: tuple[float, float, float, float]
) -> None:
    drawn = random_map(seed, yaw)
    grid = Grid.grown(drawn, radius, margin, 0.1)
    free = np.argwhere(grid.free)
    if not len(free):
        return
    (r0, c0), (r1, c1) = (free[int(each * (len(free) - 1))].tolist() for each in ends[:2])
    start = grid.from_cells(c0 + 3 * ends[2] - 1, r0 + 3 * ends[3] - 1)  # perhaps too near a wall
    goal = grid.from_cells(c1 + ends[3], r1 + ends[2])
    path = plan(grid, start, goal)
    if path is None:
        assert grid.room_at(*start) <= radius or grid.room_at(*goal) <= radius or r0 != r1 or c0 != c1
        return
    assert path.points[0] == start
    assert path.points[-1] == goal
    assert not Judge(drawn, radius).faults(start, goal, path.points, path.length)
    for a, b in zip(path.points[:-1], path.points[1:], strict=True):
        assert line_is_free(grid, a, b)


@given(seed=st.integers(0, 50), radius=st.sampled_from((0.0, 0.11, 0.25, 0.3)), start=places, goal=places)
def test_a_goal_is_reachable_if_and_only_if_a_path_is_found(
    seed: int, radius: float, start: Point, goal: Point
) -> None:
    grid = Grid.grown(random_map(seed), radius, 0.0, 0.1)
    a, b = ((x - 3.0, y + 2.0) for x, y in (start, goal))
    assert is_reachable(grid, a, b) == (plan(grid, a, b) is not None)


@given(seed=st.integers(0, 50), margin=st.sampled_from((0.0, 0.2)), data=st.data())
def test_a_path_is_never_longer_than_the_grids_way_and_keeps_its_room(
    seed: int, margin: float, data: st.DataObject
) -> None:
    grid = Grid.grown(random_map(seed), 0.2, margin, 0.1)
    cells = np.argwhere(grid.free).tolist()
    (r0, c0), (r1, c1) = data.draw(st.sampled_from(cells)), data.draw(st.sampled_from(cells))
    start, goal = (r0, c0), (r1, c1)
    way = grid.lattice().cheapest(grid.cost, UNIT, start, goal)
    path = plan(grid, grid.centre_of(start), grid.centre_of(goal))
    assert (way is None) == (path is None)
    if way is None or path is None:
        return
    assert path.length <= way[0] * grid.resolution + 1e-9
    least = min(float(grid.clearance[cell]) for cell in way[1])
    kept = min(grid.room_at(*path.point_at(s)) for s in np.linspace(0, path.length, 200))
    # no nearer to anything than the radius; shortcuts give up less than a cell of what the grid's way kept
    assert kept >= max(0.2, min(0.2 + margin, least) - 0.75 * grid.resolution - 0.01) - 1e-6


@given(
    seed=st.integers(0, 30),
    radius=st.sampled_from((0.0, 0.05, 0.2, 0.45)),
    a=places,
    b=places,
)
@example(seed=0, radius=0.2, a=(1.0, 1.0), b=(1.0, 1.0))
def test_a_line_is_free_exactly_when_shapely_says_so(seed: int, radius: float, a: Point, b: Point) -> None:
    drawn = OccupancyMap(random_map(seed).cells, 0.5)
    grid = Grid.grown(drawn, radius, resolution=0.25)
    judge = Judge(drawn, radius)
    room = judge.room(shapely.LineString([a, b]))
    at_start = judge.room(shapely.Point(a))
    keep = min(max(radius, 0.00025), at_start)  # a point keeps a thousandth of a cell
    if keep == 0.0:
        assert not line_is_free(grid, a, b)
    elif abs(room - keep) > 1e-6:
        assert line_is_free(grid, a, b) == (room > keep)
    elif room == keep:
        assert line_is_free(grid, a, b)


def test_a_robot_too_near_a_wall_may_leave_it_but_not_approach() -> None:
    grid = Grid.grown(ROOMS, 0.2, resolution=0.1)
    beside = (0.65, 2.0)  # 0.15 m from the wall at x = 0.5
    assert line_is_free(grid, beside, (1.5, 2.0))
    assert line_is_free(grid, beside, (0.65, 1.5))  # along it
    assert not line_is_free(grid, beside, (0.6, 2.0))
    assert not line_is_free(grid, beside, (0.64, 1.0))
    path = plan(grid, beside, (2.0, 2.0))
    assert path is not None
    assert path.points[0] == beside


UNREACHABLE = {
    "goal in a wall": ((1.0, 1.0), (0.2, 0.2)),
    "goal too near a wall": ((1.0, 1.0), (0.69, 2.0)),
    "goal outside": ((1.0, 1.0), (11.0, 1.0)),
    "start outside": ((-1.0, 1.0), (2.0, 1.0)),
    "start in a wall": ((0.2, 0.2), (1.0, 1.0)),
}


@pytest.mark.parametrize(("start", "goal"), UNREACHABLE.values(), ids=UNREACHABLE)
def test_there_is_no_path(start: Point, goal: Point) -> None:
    assert plan(Grid.grown(ROOMS, 0.2, resolution=0.1), start, goal) is None


def test_no_path_through_a_gap_too_narrow() -> None:
    gap = from_text("...#...\n.......\n...#...", 0.5)
    assert plan(Grid.grown(gap, 0.2, 0.1, 0.1), (0.75, 0.75), (2.75, 0.75)) is not None
    assert plan(Grid.grown(gap, 0.26, 0.1, 0.1), (0.75, 0.75), (2.75, 0.75)) is None


def test_the_middle_of_a_passage_is_kept_where_it_costs_little() -> None:
    corridor = from_text("#" * 20 + "\n" + ("." * 20 + "\n") * 3 + "#" * 20, 0.5)
    path = plan(Grid.grown(corridor, 0.2, 0.2, 0.1), (0.6, 0.8), (9.4, 1.7))
    assert path is not None
    middle = path.point_at(path.length / 2)
    assert 0.5 + 0.4 <= middle[1] <= 2.0 - 0.4
    assert len(path.points) <= 4


def test_an_open_floor_is_crossed_in_one_line() -> None:
    floor_ = OccupancyMap(np.zeros((40, 40), np.uint8), 0.25)
    path = plan(Grid.grown(floor_, 0.2, 0.1), (1.0, 1.3), (8.7, 6.1))
    assert path is not None
    assert path.points == ((1.0, 1.3), (8.7, 6.1))


def test_standing_robots_are_walked_around() -> None:
    grid = Grid.grown(ROOMS, 0.2, 0.1, 0.1)
    start, goal = (1.0, 1.0), (8.6, 0.8)
    through = plan(grid, start, goal)
    assert through is not None
    other = (4.75, 0.8)  # in the only lower passage
    around = plan(grid.with_discs([other], 0.25), start, goal)
    assert around is not None
    assert around.length > through.length + 0.4
    assert shapely.LineString(around.points).distance(shapely.Point(other)) >= 0.45 - 1e-9
    assert not line_is_free(grid.with_discs([other], 0.25), (4.2, 0.8), (5.4, 0.8))
    # one that already touches it may go away from it, and plan
    touching = grid.with_discs([(1.3, 1.0)], 0.2)
    assert line_is_free(touching, start, (1.0, 2.0))
    assert not line_is_free(touching, start, (1.1, 1.0))
    assert plan(touching, start, goal) is not None


@settings(deadline=None, max_examples=40)
@given(seed=st.integers(0, 30), discs=st.lists(st.tuples(st.floats(1, 8), st.floats(1, 7)), min_size=1, max_size=4))
def test_planned_paths_keep_off_discs(seed: int, discs: list[Point]) -> None:
    drawn = OccupancyMap(random_map(seed).cells, 0.5)
    grid = Grid.grown(drawn, 0.2, 0.1, 0.1).with_discs(discs, 0.3)
    free = np.argwhere(grid.free)
    assume(len(free) > 1)
    start, goal = grid.centre_of(tuple(free[0])), grid.centre_of(tuple(free[-1]))
    path = plan(grid, start, goal)
    if path is not None:
        line = shapely.LineString(path.points)
        assert min(line.distance(shapely.Point(disc)) for disc in discs) >= 0.5 - 1e-9
        assert not Judge(drawn, 0.2).faults(start, goal, path.points, path.length)


def test_a_wall_across_a_path_makes_the_next_one_longer() -> None:
    grid = Grid.grown(ROOMS, 0.2, 0.1, 0.1)
    path = plan(grid, (1.0, 1.0), (8.6, 0.8))
    assert path is not None
    x, y = path.point_at(2.0)
    edited = grid.update_cells(*ROOMS.edit_rectangle(WALL, (x - 0.2, y - 0.2), (x + 0.2, y + 0.2)))
    assert not all(line_is_free(edited, a, b) for a, b in pairwise(path.points))
    around = plan(edited, (1.0, 1.0), (8.6, 0.8))
    assert around is not None
    assert all(line_is_free(edited, a, b) for a, b in pairwise(around.points))
    assert around.length > path.length


def test_the_same_place_twice_is_a_path_of_no_length() -> None:
    path = plan(Grid.grown(ROOMS, 0.2, resolution=0.1), (1.0, 1.0), (1.0, 1.0))
    assert path == Path(((1.0, 1.0), (1.0, 1.0)))
    assert (path.length, path.point_at(0.0), path.project(5.0, 5.0)) == (0.0, (1.0, 1.0), 0.0)


paths = st.lists(st.tuples(st.floats(-20, 20), st.floats(-20, 20)), min_size=2, max_size=7).map(
    lambda points: Path(tuple(points))
)


@given(
    path=paths, x=st.floats(-25, 25), y=st.floats(-25, 25), fraction=st.floats(0, 1), within=st.sampled_from((inf, 2.0))
)
def test_projection_is_the_nearest_point_onward(path: Path, x: float, y: float, fraction: float, within: float) -> None:
    from_s = fraction * path.length
    s = path.project(x, y, from_s, within)
    assert from_s <= s <= min(path.length, from_s + within)
    until = min(path.length, from_s + within)
    best = min(dist(path.point_at(each), (x, y)) for each in np.linspace(from_s, until, 400).tolist())
    assert dist(path.point_at(s), (x, y)) <= best + 1e-6


@given(path=paths, s=st.floats(-5, 200))
def test_points_lie_on_the_path_at_their_arc_length(path: Path, s: float) -> None:
    x, y = path.point_at(s)
    inside = min(max(s, 0.0), path.length)
    assert path.remaining(s) == pytest.approx(path.length - inside)
    leg = max(i for i, station in enumerate(path.stations) if station <= inside)
    assert hypot(x - path.points[leg][0], y - path.points[leg][1]) == pytest.approx(
        inside - path.stations[leg], abs=1e-6
    )


def test_a_path_has_two_points() -> None:
    with pytest.raises(ValueError, match="two points"):
        Path(((0.0, 0.0),))


@needs_data
def test_paths_across_a_real_map_touch_nothing() -> None:
    from swarm.maps.load import load_map

    drawn = load_map(DATA / "rosmaps" / "turtlebot3_world" / "map.yaml")
    grid, judge = Grid.grown(drawn, 0.15, 0.1), Judge(drawn, 0.15)
    cells = np.argwhere(grid.free)
    random = np.random.default_rng(0)
    found = 0
    for first, last in random.integers(len(cells), size=(40, 2)):
        start, goal = grid.centre_of(tuple(cells[first])), grid.centre_of(tuple(cells[last]))
        path = plan(grid, start, goal)
        if path is not None:
            found += 1
            assert not judge.faults(start, goal, path.points, path.length)
    assert found > 20
