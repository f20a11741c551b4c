"""What moves: where it is taken to be while little or nothing of it is seen, and how long it keeps a robot from its way."""

from collections.abc import Callable
from math import cos, hypot, sin

import pytest

from swarm.geometry import Pose
from swarm.maps.occupancy import Point
from swarm.messages.traffic import Moving
from swarm.traffic.interface import MovingObstacle
from swarm.traffic.obstacles.detector import COMING, HALF_WIDTH, KEPT, LATELY, NOTED, BlockageChecker, Tracker
from swarm.traffic.obstacles.scan import Scan
from swarm.traffic.reservations.route import ALONE, BESIDE, RouteProgress
from swarm.traffic.reservations.rules import Reservations

DT = 0.05  # s
RADIUS = 0.2  # m
HERE = Pose(0.0, 0.0, 0.0)


def rim(middle: Point, *angles: float) -> list[Point]:
    """Return hits on a disc, at angles about its middle [rad]."""
    return [(middle[0] + HALF_WIDTH * cos(angle), middle[1] + HALF_WIDTH * sin(angle)) for angle in angles]


BLIND = Scan()


def follow(threats: Tracker, began: int, looks: list[tuple[Point, list[float]]]) -> list[tuple[MovingObstacle, ...]]:
    """Look at a disc, tick by tick: its middle, and where on its rim rays end."""
    return [
        threats.track_threats(began + tick, HERE, rim(at, *angles), BLIND) for tick, (at, angles) in enumerate(looks)
    ]


def straight(began: int, ticks: int) -> list[Point]:
    return [(1.5 - 0.3 * DT * tick, 0.2) for tick in range(began, began + ticks)]


FACING = [2.6, 2.9, 3.3, 3.6]


def known(ticks: int = 2 * NOTED) -> Tracker:
    threats = Tracker(DT, RADIUS)
    assert len(follow(threats, 0, [(at, FACING) for at in straight(0, ticks)])[-1]) == 1
    return threats


def test_of_what_one_ray_alone_still_hits_place_and_speed_stay() -> None:
    threats, began = known(), 2 * NOTED
    path = straight(began, 20)
    for at, (now,) in zip(path, follow(threats, began, [(at, [2.2]) for at in path]), strict=True):
        assert hypot(now.x - at[0], now.y - at[1]) < 0.05
        assert hypot(now.vx + 0.3, now.vy) < 0.1


@pytest.mark.parametrize("y", [-1.8, -1.2])
def test_what_is_seen_does_not_replace_what_is_remembered_elsewhere(y: float) -> None:
    threats, began = known(), 2 * NOTED
    others = [(0.0, y + 0.4 * DT * tick) for tick in range(NOTED)]
    (*_, found) = follow(threats, began, [(at, [1.2, 1.6, 2.0]) for at in others])
    seen, remembered = found
    assert abs(seen.x) < 0.1
    assert abs(remembered.y - 0.2) < 0.1
    assert abs(remembered.x - straight(began + NOTED - 1, 1)[0][0]) < 0.1


def test_what_came_into_view_a_moment_ago_is_not_known_to_move() -> None:
    """While the robot turns, more and more of an edge comes into view: it seems to slide."""
    found = follow(Tracker(DT, RADIUS), 0, [(at, FACING) for at in straight(0, NOTED)])
    assert [bool(now) for now in found] == [False] * LATELY + [True] * (NOTED - LATELY)


def test_hits_are_on_one_obstacle_counted_from_the_nearest_one_on() -> None:
    """Three hits in a row, each 0.4 m behind the one before: the first two are on one obstacle, the last is not.

    The middle of the first obstacle is between its two hits, that of the last one half a width behind its hit.
    """
    threats = Tracker(DT, RADIUS)
    for tick in range(2 * LATELY):
        moved = 0.3 * DT * tick
        found = threats.track_threats(tick, HERE, [(x - moved, 0.0) for x in (1.8, 1.0, 1.4)], BLIND)
    assert sorted(now.x + moved for now in found) == pytest.approx([1.2, 1.8 + HALF_WIDTH], abs=0.01)


# fmt: off
TOLD: dict[str, tuple[Moving, int, bool]] = {  # what another robot says, how many ticks later -> is it a threat?
    "near, just now":         (Moving(-1.0, 0.0, 0.3, 0.0, 0),  0,          True),
    "it comes near by now":   (Moving(-2.4, 0.0, 0.3, 0.0, 0),  40,         True),
    "far off":                (Moving(-2.4, 0.0, 0.3, 0.0, 0),  0,          False),
    "long ago":               (Moving(-1.0, 0.0, 0.0, 0.1, 0),  COMING,     False),
    "not quite so long ago":  (Moving(-1.0, 0.0, 0.0, 0.1, 0),  COMING - 1, True),
}
# fmt: on


@pytest.mark.parametrize("name", TOLD)
def test_what_others_saw_is_where_it_has_moved_since(name: str) -> None:
    told, later, counts = TOLD[name]
    found = Tracker(DT, RADIUS).track_threats(later, HERE, (), BLIND, [told])
    place = MovingObstacle(told.x + told.vx * DT * later, told.y + told.vy * DT * later, told.vx, told.vy)
    assert [tuple(one) for one in found] == ([pytest.approx(place)] if counts else [])


def test_what_the_robot_sees_itself_others_need_not_tell_it() -> None:
    threats, tick = known(), 2 * NOTED
    (x, y), told = straight(tick, 1)[0], [Moving(1.3, 0.3, 0.0, 0.3, tick - 4), Moving(-1.0, 0.0, 0.3, 0.0, tick - 4)]
    mine, theirs = threats.track_threats(tick, HERE, rim((x, y), *FACING), BLIND, told)
    assert hypot(mine.x - x, mine.y - y) < 0.05
    assert theirs.x < 0.0
    (seen,) = threats.moving_obstacles()
    assert seen.tick == tick, "and it tells what it saw, not what it heard"


# fmt: off
RAYS: dict[str, tuple[dict[float, float], bool]] = {  # bearing and length of the rays [rad, m] -> is it still believed in?
    "they go through where it should be":  ({-0.2: 1.6, 0.0: 1.6, 0.2: 1.6}, False),
    "one ends where it should be":         ({-0.2: 1.6, 0.0: 0.5, 0.2: 1.6}, True),
    "they pass it on one side only":       ({0.2: 1.6, 0.3: 1.6},            True),
    "it is beside all rays":               ({1.2: 1.6, -1.2: 1.6},           True),
    "they do not reach so far":            ({-0.2: 0.7, 0.0: 0.7, 0.2: 0.7}, True),
}
# fmt: on


@pytest.mark.parametrize("own", [True, False])
@pytest.mark.parametrize("name", RAYS)
def test_where_rays_show_that_it_is_gone_it_is_forgotten(name: str, own: bool) -> None:
    rays, believed = RAYS[name]
    threats, tick = known() if own else Tracker(DT, RADIUS), 2 * NOTED + 1
    told = [] if own else [Moving(*straight(tick - 1, 1)[0], -0.3, 0.0, tick - 1)]
    found = threats.track_threats(tick, HERE, (), Scan(tuple(rays), tuple(rays.values())), told)
    assert len(found) == believed
    assert len(threats.moving_obstacles()) == (own and believed)


def progress(held: tuple[int, ...], *route: int, beside: int = 0) -> RouteProgress:
    steps = (BESIDE,) * beside + (ALONE,) * (len(held) - beside)
    return RouteProgress(Reservations(held, (), 5), steps, route)


AHEAD, FLED, WAITS = progress((1, 2), 3), progress((9, 1, 2), 3, beside=1), progress((1,), 2, 3)
FAR = progress((1, 2), *range(3, 30))


def onwards(tick: int) -> RouteProgress:
    """Return a way on which the robot takes its next cell just in time."""
    cell = 1 + tick // KEPT
    return progress((cell, cell + 1), *range(cell + 2, 9))


# fmt: off
GIVEN_UP: dict[str, tuple[Callable[[int], tuple[RouteProgress, int, int, bool]], int, dict[int, int]]] = {
    # by tick the way, the cell of the body, the goal and if there is a threat; how many ticks; when which cell is given up
    "on its way":                        (lambda tick: (AHEAD, 1, 3, True),                            802,  {400: 2, 801: 2}),
    "beside its way":                    (lambda tick: (FLED, 1, 3, True),                             402,  {400: 2}),
    "it fled: the way begins beside it": (lambda tick: (FLED, 9, 3, True),                             402,  {400: 1}),
    "it flees and comes back":           (lambda tick: (FLED, 9 if tick % 40 < 20 else 1, 3, True),    421,  {420: 2}),
    "others hold its next cell":         (lambda tick: (WAITS, 1, 3, True),                            900,  {}),
    "and now and then they do not":      (lambda tick: ((AHEAD, WAITS)[tick % 2], 1, 3, True),         900,  {800: 2}),
    "a threat every other tick":         (lambda tick: (AHEAD, 1, 3, tick % 2 == 0),                   801,  {800: 2}),
    "a longer way, round the threat":    (lambda tick: ((AHEAD, FAR)[tick // 100 % 2], 1, 3, True),    500,  {400: 2}),
    "another goal":                      (lambda tick: (AHEAD, 1, 3 if tick < 200 else 4, True),       700,  {600: 2}),
    "it gets on":                        (lambda tick: (onwards(tick), 1 + tick // KEPT, 8, True),     2000, {}),
}
# fmt: on


@pytest.mark.parametrize("name", GIVEN_UP)
def test_the_next_cell_is_given_up_after_400_ticks_under_a_threat(name: str) -> None:
    at, ticks, given_up = GIVEN_UP[name]
    kept, found = BlockageChecker(), dict[int, int | None]()
    for tick in range(ticks):
        way, body, goal, threatened = at(tick)
        found[tick] = kept.check(way, body, goal, threatened=threatened)
    assert {tick: cell for tick, cell in found.items() if cell is not None} == given_up


@pytest.mark.parametrize(("then", "updated"), [(0.15, True), (-0.15, False), (-0.3, True)])
def test_what_was_seen_to_move_counts_as_moving_while_it_comes_at_all(then: float, updated: bool) -> None:
    """It comes at 0.3 m/s, and then slower: 0.045 m in 6 ticks would not make it a threat; nor does it if it goes."""
    threats, began = known(), 2 * NOTED
    x, y = straight(began, 1)[0]
    path = [(x - then * DT * tick, y) for tick in range(24)]
    follow(threats, began, [(at, FACING) for at in path])
    (seen,) = threats.moving_obstacles()
    assert (seen.tick == began + 23) is updated
    if updated:
        assert (seen.vx, seen.vy) == pytest.approx((-then, 0.0), abs=0.01)
        assert (seen.x, seen.y) == pytest.approx(path[-1], abs=0.01)


def test_what_is_always_slow_is_no_threat() -> None:
    path = [(1.5 - 0.15 * DT * tick, 0.2) for tick in range(40)]
    assert not any(follow(Tracker(DT, RADIUS), 0, [(at, FACING) for at in path]))


def test_what_is_not_seen_for_100_ticks_is_told_no_more() -> None:
    threats, last = known(), 2 * NOTED - 1
    for unseen in range(1, 102):
        threats.track_threats(last + unseen, HERE, (), BLIND)
        assert len(threats.moving_obstacles()) == (unseen < 100), unseen


def test_of_two_obstacles_the_nearer_one_is_seen_on() -> None:
    """One comes at y = 0.4 m, one stands at y = -0.25 m; then something is seen at y = 0.2 m, within 0.5 m of both."""

    def front(x: float, y: float) -> Point:
        share = 1.0 - HALF_WIDTH / hypot(x, y)
        return x * share, y * share

    threats = Tracker(DT, RADIUS)
    for tick in range(24):
        threats.track_threats(tick, HERE, [front(1.5 - 0.3 * DT * tick, 0.4), front(1.14, -0.25)], BLIND)
    assert [one.tick for one in threats.moving_obstacles()] == [23]
    threats.track_threats(24, HERE, [front(1.14, 0.2)], BLIND)
    assert [one.tick for one in threats.moving_obstacles()] == [24]
