"""The goal of a robot: the cell for a wanted point, and the point in that cell."""

import pytest

from swarm.geometry import Pose
from swarm.maps.occupancy import Point
from swarm.traffic.lattice.cell_map import OUTSIDE
from swarm.traffic.own_route import Goal
from swarm.traffic.reservations.route import ALONE, BESIDE, Footprint, RouteProgress
from swarm.traffic.reservations.rules import Reservations
from tests.traffic.maps import Drawn

FLOOR = Drawn("ab#c", "de#f")
A, B, C, D, E, F = FLOOR.at("abcdef")
RADIUS = 0.2  # m
ROOM = 0.28  # m, of the disc that has to fit


def near(cell: int, dx: float = 0.0, dy: float = 0.0) -> Point:
    x, y = FLOOR.cells.centre(cell)
    return x + dx, y + dy


def wish(goal: Goal, place: Point | None, head: int = A, tick: int = 0) -> bool:
    body = Footprint(tick, FLOOR.pose(head), head, frozenset({head}))
    return goal.set(place, RouteProgress(Reservations((head,)), (ALONE,)), body, FLOOR.cells, RADIUS)


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
    goal = Goal()
    assert wish(goal, place, tick=7)
    assert (goal.cell, goal.since, goal.wish, goal.way_out) == (cell, 7, place, ())


def test_a_goal_changes_when_its_cell_does() -> None:
    goal = Goal()
    told = [
        (wish(goal, place, tick=tick), goal.cell, goal.since)
        for tick, place in enumerate((near(B), near(B), near(B, 0.3), near(E), None, near(E), near(B)))
    ]
    assert told == [
        (True, B, 0), (False, B, 0), (False, B, 0), (True, E, 3), (False, A, 3), (True, E, 5), (True, B, 6),
    ]  # fmt: skip


def test_without_a_wish_the_goal_is_where_the_robot_was_then() -> None:
    goal = Goal()
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
    goal = Goal()
    wish(goal, near(E, dx, dy))
    for _ in range(2):
        assert goal.place(near(E, dx, dy), ROOM, FLOOR.cells) == pytest.approx(near(E, x, y))
    wish(goal, near(B))
    assert goal.place(near(B), ROOM, FLOOR.cells) == pytest.approx(near(B))


def test_a_goal_is_not_chosen_again_while_the_wish_stays() -> None:
    goal = Goal()
    assert goal.since == 0
    wish(goal, near(C), A)
    assert (wish(goal, near(C), C), goal.cell) == (False, B), "though there is a way from where it is now"
    goal.cell = OUTSIDE
    assert (wish(goal, near(C), C), goal.cell) == (True, C)


def test_beside_an_open_floor_the_goal_is_the_nearest_cell() -> None:
    floor = Drawn("ab", "cd")
    (a,), (x, y) = floor.at("a"), floor.points("a")[0]
    goal, body = Goal(), Footprint(0, floor.pose(a), a, frozenset({a}))
    assert goal.set((x - 2.0, y), RouteProgress(Reservations((a,)), (ALONE,)), body, floor.cells, RADIUS)
    assert goal.cell == a


class Edited:
    """A row of three cells 1 m wide: no robot can stand in the first one, nor in the second if ``shut``."""

    def __init__(self, *, shut: bool) -> None:
        self.stands = (False, not shut, True)

    def around(self, cell: int, reach: int) -> range:
        return range(cell + reach + 1)

    def centre(self, cell: int) -> Point:
        return cell + 0.5, 0.5

    def cell_of(self, x: float, y: float) -> int:
        return int(x)

    def in_sight(self, *_: object) -> bool:
        return True

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
        goal = Goal()
        goal.set((2.5, 0.5), RouteProgress(Reservations(held), steps), body, Edited(shut=shut), RADIUS)  # type: ignore[arg-type]
        assert goal.way_out == ((1,) if looked and not shut else ()), "only into a cell beside"
        assert goal.cell == (1 if goal.way_out else 2)
