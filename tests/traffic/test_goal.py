"""The goal of a robot: the cell for a wanted point, and the point in that cell."""

import pytest

from swarm.maps.occupancy import Point
from swarm.traffic.cells import OUTSIDE
from swarm.traffic.goal import Goal
from swarm.traffic.presence import Footprint
from swarm.traffic.reservations import Reservations
from swarm.traffic.route_progress import ALONE, RouteProgress
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
