"""A robot's goal, the cell for a wanted point, and its own way there: the shortest one, or one near a given path."""

from itertools import pairwise

import networkx as nx
import numpy as np
import pytest
import shapely
from hypothesis import assume, given
from hypothesis import strategies as st
from msgspec.structs import replace

from swarm.geometry import Pose
from swarm.maps.occupancy import OccupancyMap, Point
from swarm.messages.traffic import Claim, Record
from swarm.traffic.interface import TrafficInputs
from swarm.traffic.lattice.cell_map import OUTSIDE, CellMap
from swarm.traffic.lattice.distances import FAR
from swarm.traffic.lattice.dock import Dock
from swarm.traffic.own_route import (
    STRAY,
    DockCells,
    GoalCell,
    OwnRoute,
    Wish,
    cells_at_dock,
    distance_to_polyline,
    find_own_way,
)
from swarm.traffic.peers.situation import Situation
from swarm.traffic.reservations.route import ALONE, BESIDE, Footprint, RouteProgress
from swarm.traffic.reservations.rules import Reservations
from swarm.traffic.settings import TrafficConstants
from swarm.traffic.step import Traffic
from tests.traffic.maps import SIDE, Drawn

ROWS, COLUMNS = 6, 8
RING = Drawn("1234567", "8#####9", "abcdefg", "h#####i", "jklmnop")  # from a to g: through the middle, over or under
places = st.tuples(st.floats(0.0, COLUMNS * SIDE), st.floats(0.0, ROWS * SIDE))


# fmt: off
KEPT_TO = {  # the path's corners: the cells that follow
    "no path":                        ("",       "bcdefg"),
    "the straight one":               ("ag",     "bcdefg"),
    "over the top":                   ("a17g",   "81234567" "9g"),
    "under it":                       ("ajpg",   "hjklmnop" "ig"),
    "a point is no path":             ("1",      "bcdefg"),
    "two points are one":             ("17",     "81234567" "9g"),
}
# fmt: on


@pytest.mark.parametrize("name", KEPT_TO)
def test_the_way_keeps_to_the_path_though_another_is_shorter(name: str) -> None:
    corners, way = KEPT_TO[name]
    start, goal = RING.at("ag")
    assert find_own_way(RING.cells, start, goal, path=RING.points(corners)) == RING.at(way)


def test_a_way_is_looked_for_when_there_is_a_reason_to() -> None:
    row, own = Drawn("abcde"), OwnRoute()
    a, b, c, e = row.at("abce")

    def find(progress: RouteProgress, tick: int, goal: int = e, *blocked: int) -> RouteProgress:
        situation = Situation(
            tick=tick, cells=row.cells, head=progress.head, goal=goal, blocked=frozenset(blocked), others={}, fresh={}
        )  # fmt: skip
        return own.find(progress, situation, ())

    progress = find(RouteProgress(Reservations((a,)), (ALONE,)), 0)
    assert progress.route == row.at("bcde")
    assert find(progress, 1) is progress, "it has one"
    assert find(progress, 99) is progress, "however long ago"
    there = find(RouteProgress(Reservations((e,)), (ALONE,)), 1)
    assert not there.route
    assert find(there, 99) is there, "it is there"
    assert find(progress, 2, c).route == row.at("bc"), "another goal"
    shut = find(progress, 3, e, b)
    assert not shut.route
    assert find(shut, 22, e, b) is shut, "there was none a moment ago"
    assert find(shut, 23, e, b) is not shut
    assert find(shut, 24).route == row.at("bcde"), "it is free now"
    assert find(progress.on_joint_way((a, b)), 25).route == row.at("bcde"), "it has left a joint plan"
    assert find(progress.without_way(), 26).route == row.at("bcde"), "its way was given up"


def test_a_small_detour_of_the_path_is_not_worth_two_steps_more() -> None:
    """One row aside for one cell of it: the path is smooth, and a way of cells is not."""
    room = Drawn("vwxyz", "abcde")
    start, goal = room.at("ae")
    path = room.points("abxde")
    assert find_own_way(room.cells, start, goal, path=path) == room.at("bcde")


@pytest.mark.parametrize(("goal", "way"), [("d", "bcd"), ("e", "vwxyze")])
def test_three_cells_off_the_path_are_worth_two_steps_more_and_two_are_not(goal: str, way: str) -> None:
    """A cell off the path costs 0.7 steps."""
    room = Drawn("vwxyz", "abcde")
    (start,), (end,) = room.at("a"), room.at(goal)
    assert find_own_way(
        room.cells, start, end, path=room.points("av" + way[-2] * (goal == "e") + "y" * (goal == "d") + goal)
    ) == room.at(way)


def test_a_way_across_an_open_floor_is_a_staircase_along_the_line() -> None:
    cells = Drawn(*["." * 12] * 8).cells
    start, goal = 0, len(cells) - 1
    line = shapely.LineString([cells.centre(start), cells.centre(goal)])
    way = find_own_way(cells, start, goal)
    assert len(way) == cells.distances(goal)[start]
    assert max(shapely.distance(line, shapely.Point(cells.centre(cell))) for cell in way) < 0.75 * SIDE


def test_no_way_leads_into_what_is_left_out() -> None:
    start, goal, middle, top = RING.at("agd4")
    assert middle not in find_own_way(RING.cells, start, goal, {middle})
    assert find_own_way(RING.cells, start, goal, {middle, top, *RING.at("m")}) == ()
    assert find_own_way(RING.cells, start, start) == ()


@given(st.integers(0, 1000), st.lists(places, max_size=4), st.data())
def test_the_way_is_the_cheapest_in_steps_and_in_what_it_strays(
    seed: int, path: list[tuple[float, float]], data: st.DataObject
) -> None:
    solid = (np.random.default_rng(seed).random((ROWS, COLUMNS)) < 0.2).astype(np.uint8)
    cells = CellMap(OccupancyMap(solid, SIDE, Pose(0.0, 0.0, 0.0)), side=SIDE, radius=0.2)
    cell = st.integers(0, len(cells) - 1)
    start, goal, shut = data.draw(cell), data.draw(cell), data.draw(st.sets(cell, max_size=3))
    assume(start not in shut and goal not in shut)
    line = shapely.LineString(path if len(path) > 1 else [cells.centre(start), cells.centre(goal)])

    def cost(into: int) -> float:
        return 1.0 + STRAY * float(shapely.distance(line, shapely.Point(cells.centre(into)))) / SIDE

    way = find_own_way(cells, start, goal, shut, path)
    graph = nx.DiGraph()
    graph.add_nodes_from(range(len(cells)))
    graph.add_weighted_edges_from(
        (a, b, cost(b)) for a, near in enumerate(cells.neighbours) for b in near if not {a, b} & shut
    )
    if not nx.has_path(graph, start, goal):
        assert way == ()
        assert cells.distances(goal, shut)[start] >= FAR
        return
    assert all(b in cells.neighbours[a] and b not in shut for a, b in pairwise((start, *way)))
    assert (start, *way)[-1] == goal
    assert sum(map(cost, way)) == pytest.approx(nx.shortest_path_length(graph, start, goal, "weight"))


def test_a_way_round_is_kept_though_the_obstacle_is_forgotten() -> None:
    """It takes longer than an obstacle is remembered: a robot that turned back would find it again, for ever."""
    start, goal, middle, other = RING.at("agdi")
    own, progress = OwnRoute(), RouteProgress(Reservations((start,)), (ALONE,))
    ways = []
    for tick, blocked in enumerate(((), (middle,), (), (middle,), (middle, other))):
        situation = Situation(
            tick=tick, cells=RING.cells, head=start, goal=goal, blocked=frozenset(blocked), others={}, fresh={}
        )  # fmt: skip
        progress = own.find(progress, situation, ())
        ways.append(progress.route)
    straight, under, over = RING.at("bcdefg"), RING.at("hjklmnopig"), RING.at("812345679g")
    assert ways[0] == straight
    assert ways[1] in {under, over}
    assert ways[2:4] == [ways[1]] * 2
    assert find_own_way(RING.cells, start, goal, {middle, other}) == ways[4] == over


def test_a_way_that_leads_to_the_goal_is_kept_though_the_planner_finds_another_path() -> None:
    """Claims are made along it; only another goal, or something in the way, is a reason to look again."""
    start, goal = RING.at("ag")
    traffic = Traffic("r1", RING.cells, TrafficConstants())
    ways = []
    for tick in range(120):
        path = RING.points("a17g" if tick < 20 else "ajpg")
        inputs = TrafficInputs(tick, RING.pose(start), RING.cells.centre(goal), path=path)
        ways.append(traffic.step(inputs, RING.cells).way)
    assert ways[0][1:] == RING.at("812345679g")
    assert set(ways) == {ways[0]}


def test_of_equal_ways_the_first_found_stays() -> None:
    square = Drawn("cd", "ab")
    (start,), (end,) = square.at("a"), square.at("d")
    assert find_own_way(square.cells, start, end) == square.at("bd")


# fmt: off
OFF = {  # a line, a point, the distance between them [m]
    "beside it":               (((0.0, 0.0), (2.0, 0.0)),             (1.0, 1.0),  1.0),
    "beyond its end":          (((0.0, 0.0), (2.0, 0.0)),             (3.0, 0.0),  1.0),
    "before its beginning":    (((0.0, 0.0), (2.0, 0.0)),             (-1.0, 0.0), 1.0),
    "beside a short one":      (((0.0, 0.0), (0.5, 0.0)),             (0.5, 1.0),  1.0),
    "beside a slanting one":   (((0.0, 0.0), (2.0, 2.0)),             (2.0, 0.0),  2.0**0.5),
    "a line that is a point":  (((1.0, 1.0), (1.0, 1.0)),             (1.0, 3.0),  2.0),
    "the second of two":       (((0.0, 0.0), (2.0, 0.0), (2.0, 2.0)), (3.0, 1.0),  1.0),
    "the first of two":        (((0.0, 0.0), (2.0, 0.0), (2.0, 2.0)), (0.5, -0.5), 0.5),
}
# fmt: on


@pytest.mark.parametrize("name", OFF)
def test_how_far_a_point_is_off_a_line(name: str) -> None:
    line, point, off = OFF[name]
    assert distance_to_polyline(line, point) == pytest.approx(off)


FLOOR = Drawn("ab#c", "de#f")
A, B, C, D, E, F = FLOOR.at("abcdef")
RADIUS = 0.2  # m
CONSTANTS = TrafficConstants(radius=RADIUS)
ROOM = 0.28  # m, of the disc that has to fit


def near(cell: int, dx: float = 0.0, dy: float = 0.0) -> Point:
    x, y = FLOOR.cells.centre(cell)
    return x + dx, y + dy


def wish(
    goal: GoalCell, place: Point | None, head: int = A, tick: int = 0, occupied: frozenset[int] = frozenset()
) -> bool:
    body = Footprint(tick, FLOOR.pose(head), head, frozenset({head}))
    progress = RouteProgress(Reservations((head,)), (ALONE,))
    return goal.set_wish(place, progress, body, FLOOR.cells, CONSTANTS, occupied)


# fmt: off
WISHES: dict[str, tuple[Point, int]] = {
    "in a cell":                          (near(E),              E),
    "at its edge":                        (near(E, 0.59, -0.59), E),
    "where it is":                        (near(A, 0.1),         A),
    "no way leads there":                 (near(C),              B),
    "no way leads there, lower":          (near(F, 0.0, -0.1),   E),
    "off the map":                        (near(D, -2.0),        D),
    "in a wall":                          (near(B, 1.2, 0.1),    B),
}
# fmt: on


@pytest.mark.parametrize("name", WISHES)
def test_the_goal_is_the_cell_of_the_wanted_point_or_the_nearest_that_can_be_reached(name: str) -> None:
    place, cell = WISHES[name]
    goal = GoalCell()
    assert wish(goal, place, tick=7)
    assert (goal.cell, goal.since, goal.wish, goal.way_out) == (cell, 7, place, ())


def test_a_goal_changes_when_its_cell_does() -> None:
    goal = GoalCell()
    told = [
        (wish(goal, place, tick=tick), goal.cell, goal.since)
        for tick, place in enumerate((near(B), near(B), near(B, 0.3), near(E), None, near(E), near(B)))
    ]
    assert told == [
        (True, B, 0), (False, B, 0), (False, B, 0), (True, E, 3), (False, A, 3), (True, E, 5), (True, B, 6),
    ]  # fmt: skip


def test_without_a_wish_the_goal_is_where_the_robot_was_then() -> None:
    goal = GoalCell()
    assert goal.cell == OUTSIDE
    assert [(wish(goal, None, head), goal.cell) for head in (A, B)] == [(False, A), (False, A)]
    wish(goal, near(E), B)
    assert (wish(goal, None, B), goal.cell) == (False, B)


@pytest.mark.parametrize(
    ("dx", "dy", "x", "y"),
    [(0.1, -0.2, 0.1, -0.2), (0.5, 0.0, 0.32, 0.0), (0.0, -0.5, 0.0, -0.32), (-0.59, 0.59, -0.32, 0.32)],
)
def test_a_robot_stands_at_the_wanted_point_or_as_near_as_it_fits_in_the_cell(
    dx: float, dy: float, x: float, y: float
) -> None:
    """The cell's half side is 0.6 m, the disc's radius 0.28 m."""
    goal = GoalCell()
    wish(goal, near(E, dx, dy))
    for _ in range(2):
        assert goal.place(near(E, dx, dy), ROOM, FLOOR.cells) == pytest.approx(near(E, x, y))
    wish(goal, near(B))
    assert goal.place(near(B), ROOM, FLOOR.cells) == pytest.approx(near(B))


def test_a_goal_is_not_chosen_again_while_the_wish_stays() -> None:
    goal = GoalCell()
    assert goal.since == 0
    wish(goal, near(C), A)
    assert (wish(goal, near(C), C), goal.cell) == (False, B), "though there is a way from where it is now"
    goal.cell = OUTSIDE
    assert (wish(goal, near(C), C), goal.cell) == (True, C)


def test_beside_an_open_floor_the_goal_is_the_nearest_cell() -> None:
    floor = Drawn("ab", "cd")
    (a,), (x, y) = floor.at("a"), floor.points("a")[0]
    goal, body = GoalCell(), Footprint(0, floor.pose(a), a, frozenset({a}))
    assert goal.set_wish((x - 2.0, y), RouteProgress(Reservations((a,)), (ALONE,)), body, floor.cells, CONSTANTS)
    assert goal.cell == a


UP = 0.59 if near(B)[1] > near(E)[1] else -0.59  # m, from the middle of e to its edge with b
# fmt: off
OCCUPIED: dict[str, tuple[Point, int, set[int], int]] = {
    #                            place                head  occupied  goal
    "not its cell":             (near(E, -0.59),      A,    {D},      E),
    "its cell":                 (near(E, -0.59),      A,    {E},      D),
    "at another edge":          (near(E, 0.0, UP),    A,    {E},      B),
    "out of reach from others": (near(E),             A,    {E},      E),
    "all within reach too":     (near(E, -0.59),      A,    {D, E},   E),
    "no way leads beside it":   (near(E, 0.0, UP),    D,    {A, E},   E),
    "it is there":              (near(E, -0.59),      E,    {E},      E),
}
# fmt: on


@pytest.mark.parametrize("name", OCCUPIED)
def test_a_robot_goes_to_a_cell_beside_if_a_body_stands_in_that_of_its_stop(name: str) -> None:
    place, head, occupied, cell = OCCUPIED[name]
    goal = GoalCell()
    wish(goal, place, head)
    assert goal.cell == E
    found = [wish(goal, place, head, tick, frozenset(occupied)) for tick in (8, 9)]
    assert (goal.cell, found) == (cell, [cell != E, False])
    assert goal.since == (8 if cell != E else 0)


# fmt: off
SHORT: dict[str, tuple[Point, Point, float, bool]] = {
    #                              place                   robot at                off [m]  docks
    "exact":                      (near(E, 0.0, 0.5),      near(E, 0.0, 0.32),     0.0,     False),
    "off, and out of reach":      (near(E, 0.0, 0.5),      near(E, 0.0, 0.20),     0.12,    True),
    "still on its way":           (near(E, 0.0, 0.5),      near(E, 0.0, 0.10),     0.12,    False),
    "off, and within reach":      (near(E, 0.0, 0.4),      near(E, 0.0, 0.27),     0.05,    False),
}
# fmt: on


@pytest.mark.parametrize("name", SHORT)
def test_a_robot_that_may_be_out_of_reach_in_its_cell_drives_straight_to_its_place(name: str) -> None:
    place, (x, y), off, docks = SHORT[name]
    goal, progress = GoalCell(), RouteProgress(Reservations((E,)), (ALONE,))
    for at in (near(E), (x, y)):
        body = Footprint(0, Pose(*at, 0.0), E, frozenset({E}))
        goal.set_wish(place, progress, body, FLOOR.cells, CONSTANTS, (), off)
    assert goal.dock == (Dock(place, E) if docks else None)


def test_the_place_in_a_cell_follows_the_room_that_a_body_needs() -> None:
    goal = GoalCell()
    wish(goal, near(E, 0.5), E)
    found = [goal.place(near(E, 0.5), room, FLOOR.cells) for room in (0.28, 0.4, 0.28)]
    assert found == [pytest.approx(near(E, dx)) for dx in (0.32, 0.2, 0.32)]


class Edited:
    """A row of three cells 1 m wide: no robot can stand in the first one, nor in the second if ``shut``."""

    def __init__(self, *, shut: bool) -> None:
        self.stands = (False, not shut, True)

    def cells_around(self, cell: int, reach: int) -> range:
        return range(cell + reach + 1)

    def centre(self, cell: int) -> Point:
        return cell + 0.5, 0.5

    def cell_of(self, x: float, y: float) -> int:
        return int(x)

    def in_sight(self, *_: object) -> bool:
        return True

    def move_inside(self, cell: int, point: Point, radius: float) -> Point:
        return point

    def distances(self, cell: int) -> list[int]:
        return [abs(cell - other) for other in range(3)]


# fmt: off
OUTS = {  # steps of the cells held: is the way out looked for?
    "just there":           ((ALONE,),                True),
    "it reaches into more": ((BESIDE, ALONE),         True),
    "it drove there":       ((ALONE, ALONE),          False),
    "from farther":         ((BESIDE, ALONE, ALONE),  False),
}
# fmt: on


@pytest.mark.parametrize("name", OUTS)
def test_a_way_leads_out_of_a_cell_in_which_an_edit_left_the_robot(name: str) -> None:
    steps, looked = OUTS[name]
    held = (2, 1, 0)[-len(steps) :]
    body = Footprint(0, Pose(0.5, 0.5, 0.0), 0, frozenset({0}))
    for shut in (False, True):
        goal = GoalCell()
        goal.set_wish((2.5, 0.5), RouteProgress(Reservations(held), steps), body, Edited(shut=shut), CONSTANTS)  # type: ignore[arg-type]
        assert goal.way_out == ((1,) if looked and not shut else ()), "only into a cell beside"
        assert goal.cell == (1 if goal.way_out else 2)


EXACT = TrafficConstants(radius=RADIUS, reach=0.05)
OTHER = Record(robot="r2", stamp=0, x=0.0, y=0.0, goal=C)
# fmt: off
AT_DOCK: dict[str, tuple[int, Record | None, frozenset[tuple[str, int]], bool, DockCells]] = {
    # where the body is; what another robot says; what was seen empty; whether the robot is done
    "it claims what its body needs":         (A, None,                         frozenset(),            False, DockCells((B,), (), (), drives=True)),
    "it is on its way to its cell":          (D, None,                         frozenset(),            False, DockCells()),
    "another holds a cell":                  (A, replace(OTHER, held=(B,)),    frozenset(),            False, DockCells((B,), ("r2",), (), drives=True)),
    "a silent robot left it":                (A, replace(OTHER, held=(B,)),    frozenset({("r2", B)}), False, DockCells((B,), (), (), drives=True)),
    "another claims a cell that it holds":   (B, replace(OTHER, claims=(Claim(B, 1, 0),)), frozenset(),     False, DockCells((B,), (), (), drives=True)),
    "it is done and holds all":              (B, None,                         frozenset(),            True,  DockCells((), (), (B,), drives=True)),
    "it is done before it holds all":        (A, None,                         frozenset(),            True,  DockCells((B,), (), (), drives=True)),
    "it is done, and another has to pass":   (B, replace(OTHER, ahead=(E, B)), frozenset(),            True,  DockCells()),
    "it is done, and its cell is needed":    (B, replace(OTHER, ahead=(A,)),   frozenset(),            True,  DockCells()),
}
# fmt: on


@pytest.mark.parametrize("name", AT_DOCK)
def test_the_cells_that_a_robot_needs_at_a_place_between_two_cells(name: str) -> None:
    here, other, cleared, done, expected = AT_DOCK[name]
    goal, place = GoalCell(), near(A, dx=SIDE / 2 - 0.02)
    held = (B, A) if here == B else (A,)
    progress = RouteProgress(Reservations(held), (BESIDE,) * (len(held) - 1) + (ALONE,))
    goal.set_wish(place, progress, Footprint(0, FLOOR.pose(A), A, frozenset({A})), FLOOR.cells, EXACT)
    others = {} if other is None else {"r2": other}
    wished = Wish(place, (), done)
    assert cells_at_dock(goal, wished, progress, here, others, cleared, FLOOR.cells, EXACT, 0.0) == expected


def test_a_robot_without_a_wish_stays_at_its_place_as_long_as_it_holds_what_it_needs_there() -> None:
    goal, place = GoalCell(), near(A, dx=SIDE / 2 - 0.02)
    body = Footprint(0, FLOOR.pose(B), B, frozenset({A, B}))
    both, one = (
        RouteProgress(Reservations(held), steps) for held, steps in (((B, A), (BESIDE, ALONE)), ((A,), (ALONE,)))
    )
    goal.set_wish(place, both, body, FLOOR.cells, EXACT)
    assert goal.dock == Dock(place, A)
    nowhere = Wish(None, (), done=True)
    for others, kept in (({}, (B,)), ({"r2": replace(OTHER, ahead=(E, B))}, ())):
        found = cells_at_dock(goal, nowhere, both, B, others, frozenset(), FLOOR.cells, EXACT, 0.0)
        assert (found.kept, found.drives) == (kept, bool(kept))
    for progress, dock in ((both, Dock(place, A)), (one, None), (both, None)):
        goal.set_wish(None, progress, body, FLOOR.cells, EXACT)
        assert (goal.cell, goal.dock) == (A, dock)


def test_a_robot_drives_back_into_its_cell_before_it_goes_elsewhere() -> None:
    goal, place, then = GoalCell(), near(A, dx=SIDE / 2 - 0.02), near(D)
    progress = RouteProgress(Reservations((B, A)), (BESIDE, ALONE))
    inside, outside = (Footprint(0, FLOOR.pose(cell), cell, frozenset({cell})) for cell in (A, B))
    goal.set_wish(place, progress, inside, FLOOR.cells, EXACT)
    dock = goal.dock
    assert dock is not None
    goal.reset_wish()  # the floor has changed, and the place is the same
    goal.set_wish(place, progress, outside, FLOOR.cells, EXACT)
    assert goal.leaves is None
    goal.set_wish(then, progress, outside, FLOOR.cells, EXACT)
    assert goal.leaves == dock
    back = cells_at_dock(goal, Wish(then, (), done=False), progress, B, {}, frozenset(), FLOOR.cells, EXACT, 0.0)
    assert back == DockCells(kept=(B,))
    goal.set_wish(then, progress, inside, FLOOR.cells, EXACT)
    assert goal.leaves is None
