"""The cells that a robot has to hold because its body is there, on bodies that are placed by hand."""

import pytest
from msgspec.structs import replace

from swarm.geometry import Pose
from swarm.messages.traffic import Claim, Record
from swarm.traffic.interface import TrafficInputs
from swarm.traffic.lattice.cell_map import OUTSIDE
from swarm.traffic.reservations.route import (
    ALONE,
    BESIDE,
    OFF_WAY,
    Footprint,
    OffRouteChecker,
    RouteProgress,
    footprint_of,
    free_drive_cells,
    give_back,
    hold_free_drive_cells,
    hold_under_body,
    resume_after_sleep,
)
from swarm.traffic.reservations.rules import Reservations
from swarm.traffic.settings import TrafficConstants
from tests.traffic.maps import Drawn

FLOOR = Drawn("abcd", "efg#")
A, B, C, D, E, F, G = FLOOR.at("abcdefg")
WALL = FLOOR.cell((1, 3))
SETTINGS = TrafficConstants()
BODY = SETTINGS.radius + SETTINGS.margin  # m


def body(cell: int, *touched: int, tick: int = 0, dx: float = 0.0) -> Footprint:
    pose = FLOOR.pose(cell)
    return Footprint(tick, pose._replace(x=pose.x + dx), cell, frozenset(touched or (cell,)))


def progress(held: tuple[int, ...], beside: int = 0, *, following: bool = False) -> RouteProgress:
    """Return the progress of a robot that holds these cells, the first ``beside`` of them off its way."""
    steps = (BESIDE,) * beside + (ALONE,) * (len(held) - beside)
    return RouteProgress(Reservations(held, (), 9), steps, (), following)


# fmt: off
OFF: dict[str, tuple[RouteProgress, Footprint, bool]] = {  # body beside the way for long: does the way begin again?
    "off its way":                       (progress((E, A, B), 1),                  body(E),             True),
    "on it":                             (progress((E, A, B), 1),                  body(A),             False),
    "in room beside a plan's way":       (progress((E, A, B), 1, following=True),  body(E),             False),
    "far from a plan's way":             (progress((G, A, B), 1, following=True),  body(G),             True),
    "off the map":                       (progress((E, A, B), 1),                  body(A)._replace(cell=OUTSIDE), False),
    "where nobody can stand":            (progress((WALL, A, C), 1),               body(WALL),          False),
}
# fmt: on


@pytest.mark.parametrize("name", OFF)
def test_a_robot_long_off_its_way_begins_again_where_it_is(name: str) -> None:
    way, where, again = OFF[name]
    presence = OffRouteChecker()
    for tick in range(100, 100 + OFF_WAY + 1):
        now = body(A, tick=tick) if tick == 100 else where._replace(tick=tick)
        assert presence.keep_on_way(way, now, FLOOR.cells, threatened=False) is way, tick
    got = presence.keep_on_way(way, where._replace(tick=101 + OFF_WAY), FLOOR.cells, threatened=False)
    if again:
        assert got == RouteProgress(Reservations((where.cell,), (), 9), (ALONE,))
        got = presence.keep_on_way(way, where._replace(tick=102 + OFF_WAY), FLOOR.cells, threatened=False)
    assert got is way, "or not again so soon"


@pytest.mark.parametrize(("threatened", "again"), [({101}, True), ({140}, True), ({100}, False), (set(), False)])
def test_who_fled_from_a_threat_into_room_beside_a_plans_way_does_not_come_back(
    threatened: set[int], again: bool
) -> None:
    """At tick 100 it is on its way, and beside it from then on."""
    way, presence = progress((E, A, B), 1, following=True), OffRouteChecker()
    kept = [
        presence.keep_on_way(way, body(A if tick == 100 else E, tick=tick), FLOOR.cells, threatened=tick in threatened)
        is way
        for tick in range(100, 200)
    ]
    assert (not all(kept)) is again


def test_a_footprint_is_what_the_body_and_its_brake_reach_into() -> None:
    pose = FLOOR.pose(A)
    stands = footprint_of(TrafficInputs(3, pose, None), BODY, FLOOR.cells)
    assert stands == Footprint(3, pose, A, frozenset({A}))
    path = ((pose.x + 0.2, pose.y), (pose.x + 0.6 - BODY + 0.01, pose.y))
    assert footprint_of(TrafficInputs(3, pose, None, path), BODY, FLOOR.cells).touched == {A, B}


def test_who_starts_holds_what_it_touches_and_stands_in_the_nearest() -> None:
    got = resume_after_sleep(None, body(B, A, B, tick=6, dx=-0.5), FLOOR.cells)
    assert (got.reservations.held, got.steps) == ((A, B), (BESIDE, ALONE))
    later = resume_after_sleep(None, body(B, tick=7), FLOOR.cells)
    assert later.reservations.number > got.reservations.number + 7, "more numbers than claims in a tick"


def test_who_wakes_goes_on_if_it_is_still_on_its_way() -> None:
    way = progress((E, A, B), 1)
    assert resume_after_sleep(way, body(A), FLOOR.cells).reservations.held == (E, A)
    assert resume_after_sleep(way, body(E), FLOOR.cells) == RouteProgress(Reservations((E,), (), 9), (ALONE,)), (
        "off its way"
    )
    assert resume_after_sleep(way, body(A, A, F), FLOOR.cells).reservations.held == (A,), (
        "it touches what it does not hold"
    )
    assert resume_after_sleep(way, body(F), FLOOR.cells).reservations.held == (F,), "it holds nothing of what it is in"


def test_who_gives_back_turns_round_only_on_its_way() -> None:
    assert give_back(progress((A, B, C)), body(A, A, B), FLOOR.cells).reservations.held == (B, A)
    assert give_back(progress((E, A, B), 1), body(A, A, E), FLOOR.cells).reservations.held == (E, A)


def test_a_body_in_a_cell_that_it_does_not_hold_holds_it_too() -> None:
    way, edge = progress((A,)), 0.6 - BODY + 0.01  # m, to where the body reaches into the next cell
    assert hold_under_body(way, body(A), FLOOR.cells, BODY) is way
    pushed = hold_under_body(way, body(A, A, B, C, dx=edge), FLOOR.cells, BODY)
    assert (pushed.reservations.held, pushed.steps) == ((B, A), (BESIDE, ALONE)), "what the brake reaches into is not"


@pytest.mark.parametrize(("dx", "held"), [(0.27, (A,)), (0.30, (B, A)), (0.61, (A, B))])
def test_in_free_drive_a_robot_holds_what_it_could_reach_within_two_ticks(dx: float, held: tuple[int, ...]) -> None:
    """0.2 m of body, 0.03 m of margin and twice 0.045 m: from 0.28 m off the middle it may be in the next cell."""
    pose = FLOOR.pose(A)
    got, footprint = hold_free_drive_cells(
        progress((A,)), TrafficInputs(5, pose._replace(x=pose.x + dx), None), FLOOR.cells, SETTINGS
    )
    assert got.reservations.held == held
    assert footprint.touched == set(held)


ROW = Drawn("abcdefghi", ".#.......")
NEAR = SETTINGS.alone_distance  # m, 3.5 of claims and 2.5 of driving
ABOUT = (*ROW.at("abcd"), *(ROW.cell((1, column)) for column in (0, 2, 3)))


def told(away: float, *held: str, claims: str = "") -> Record:
    """Return the record of a robot ``away`` [m] to the right of b."""
    x, y = ROW.cells.centre(ROW.at("b")[0])
    asked = tuple(Claim(cell, 1, 0) for cell in ROW.at(claims))
    return replace(Record(robot="r2", stamp=0, x=x + away, y=y, goal=0), held=ROW.at("".join(held)), claims=asked)


# fmt: off
FREE: dict[str, tuple[Record | None, bool, bool]] = {  # what another robot told, whether it is heard, free drive
    "nobody":                       (None,                       True,  True),
    "far enough":                   (told(NEAR + 0.1, "i"),      True,  True),
    "too near":                     (told(NEAR - 0.1, "i"),      True,  False),
    "too near on the other side":   (told(0.1 - NEAR, "i"),      True,  False),
    "silent, near, holds nothing":  (told(1.0, "i"),             False, True),
    "silent, holds one of them":    (told(9.0, "d"),             False, False),
    "silent, claims one of them":   (told(9.0, claims="d"),      False, False),
    "silent, holds the next one":   (told(9.0, "e"),             False, True),
}
# fmt: on


@pytest.mark.parametrize("name", FREE)
def test_a_robot_drives_freely_round_its_cell_if_nobody_can_ask_for_any_of_it(name: str) -> None:
    record, heard, free = FREE[name]
    others = {} if record is None else {"r2": record}
    b = ROW.at("b")[0]
    where = Footprint(0, ROW.pose(b), b, frozenset({b}))
    got = free_drive_cells(where, others, others if heard else {}, ROW.cells, SETTINGS)
    assert set(got) == (set(ABOUT) if free else set())


def test_along_the_other_axis_nearness_is_the_same() -> None:
    b = ROW.at("b")[0]
    where = Footprint(0, ROW.pose(b), b, frozenset({b}))
    for away, free in ((NEAR - 0.1, False), (NEAR + 0.1, True)):
        x, y, _ = Pose(*ROW.pose(b))
        others = {"r2": replace(told(0.0, "i"), x=x, y=y + away)}
        assert bool(free_drive_cells(where, others, others, ROW.cells, SETTINGS)) is free


def test_the_first_ticks_of_a_robot() -> None:
    way = progress((E, A, B), 1)
    for tick, kept in ((30, True), (31, False)):
        assert (OffRouteChecker().keep_on_way(way, body(E, tick=tick), FLOOR.cells, threatened=False) is way) is kept
    beside, presence = progress((E, A, B), 1, following=True), OffRouteChecker()
    for tick in (0, 31):
        assert presence.keep_on_way(beside, body(E, tick=tick), FLOOR.cells, threatened=False) is beside
    assert resume_after_sleep(None, body(B, tick=6), FLOOR.cells).reservations.number == 385


def test_free_drive_counts_two_cells_to_either_side() -> None:
    drawn = Drawn("abcdefg", "hijklmn", "opqrstu", "vwxyz..", ".......", ".......", ".......")
    (middle,) = drawn.at("y")
    where = Footprint(0, drawn.pose(middle), middle, frozenset({middle}))
    row, column = divmod(middle, 7)
    about = [r * 7 + c for r in range(row - 2, row + 3) for c in range(column - 2, column + 3)]
    assert free_drive_cells(where, {}, {}, drawn.cells, SETTINGS) == tuple(about)


@pytest.mark.parametrize(
    ("held", "kept"),
    [
        ((WALL, C, G), (WALL, G)),  # the nearest of those held that it can stand in
        ((WALL, A), (WALL, A)),
        ((WALL,), (WALL,)),  # nowhere to stand: what it touches, and nothing else
    ],
)
def test_where_it_cannot_stand_it_takes_no_cell_that_it_neither_touches_nor_held(
    held: tuple[int, ...], kept: tuple[int, ...]
) -> None:
    found = give_back(progress(held, 1), body(WALL), FLOOR.cells)
    assert found.reservations.held == kept
    assert not found.reservations.all_claims
