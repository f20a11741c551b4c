"""The constants of traffic for a scenario, and where the lattice of its floor lies."""

from itertools import product
from math import inf
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from swarm.errors import ConfigError
from swarm.maps.occupancy import FREE, UNKNOWN, WALL, OccupancyMap, Point
from swarm.settings import MapSettings, RadioSettings, Settings, StartSettings
from swarm.settings import TrafficSettings as LatticeSettings
from swarm.traffic.lattice.cell_map import OUTSIDE, CellMap
from swarm.traffic.lattice.offset import PHASES, best_offset
from swarm.traffic.lattice.placement import (
    DEAF,
    LOSSY,
    UNHEARD,
    cells_of,
    cells_of_learned_floor,
    cells_within,
    comes_near,
    distance_to_stop,
    remove_unheard_joins,
    traffic_settings,
)
from swarm.traffic.lattice_choice import FINER, with_lattice
from swarm.traffic.settings import TrafficConstants
from tests.shared import scenario_of
from tests.traffic.maps import Drawn
from tests.traffic.test_settings import ORDERS

USUAL = TrafficConstants()


@pytest.mark.parametrize("every", [1, 4, 10])
@pytest.mark.parametrize("loss", [0.0, 0.1, 0.3, 0.5, 0.7, 0.8, LOSSY, 1.0])
def test_the_lossier_the_radio_the_longer_a_robot_waits_before_it_takes_another_for_silent(
    loss: float, every: int
) -> None:
    """Two that each take the other for silent may both take a cell: nobody asks them."""
    settings = traffic_settings(scenario_of(radio={"loss": loss, "every": every}).settings)
    worst = min(loss, LOSSY)
    assert worst ** (settings.fresh // every) <= DEAF
    assert settings.fresh >= 4 * every, "nobody counts as silent between two broadcasts"
    assert settings.ripe >= 2 * every, "a claim waits until everybody has broadcast twice"
    assert worst ** (settings.listen // settings.often) <= UNHEARD
    if loss == 0.0:
        assert (settings.fresh, settings.listen) == (USUAL.fresh, USUAL.listen), "no longer than that takes"


@pytest.mark.parametrize("loss", [0.3, 0.5, 0.7, 0.8, LOSSY])
@pytest.mark.parametrize("why", ORDERS)
def test_constants_keep_their_order_however_lossy_the_radio(why: str, loss: float) -> None:
    settings = traffic_settings(scenario_of(radio={"loss": loss}).settings)
    values = [getattr(settings, name) for name in ORDERS[why]]
    assert values == sorted(set(values)), dict(zip(ORDERS[why], values, strict=True))


# fmt: off
TIMES: dict[str, tuple[dict[str, Any], tuple[int, int, int, int, int]]] = {  # fresh, absent, plan_stuck, surmise, listen
    "no loss":                  ({"loss": 0.0},                        (40, 140, 160, 200, 30)),
    "half, 12 and 16 in a row": ({"loss": 0.5},                        (48, 140, 160, 200, 32)),
    "most, 77 and 99 in a row": ({"loss": 0.9},                        (308, 328, 348, 388, 198)),
    "walls stop it":            ({"loss": 0.5, "line_of_sight": True}, (48, 600, 400, 600, 32)),
}
# fmt: on


@pytest.mark.parametrize("name", TIMES)
def test_how_long_robots_wait_for_each_other_in_ticks(name: str) -> None:
    radio, ticks = TIMES[name]
    got = traffic_settings(scenario_of(radio=radio).settings)
    assert (got.fresh, got.absent, got.plan_stuck, got.surmise, got.listen) == ticks
    sight = "line_of_sight" in radio
    assert (got.in_sight, got.horizon, got.ripe) == ((True, 1, 20) if sight else (False, 3, 8))


@pytest.mark.parametrize(("noise", "unexpected"), [(0.0, 0.05), (0.01, 0.05), (0.02, 0.1), (0.03, 0.15)])
def test_the_noisier_the_rays_the_more_a_reading_must_fall_short_of_a_wall(noise: float, unexpected: float) -> None:
    got = traffic_settings(scenario_of(sensors={"noise": noise}).settings)
    assert got.unexpected == pytest.approx(unexpected)


def test_what_a_scenario_says_of_its_robots_traffic_takes_over() -> None:
    fields: dict[str, Any] = {
        "rate": 10.0,
        "robot": {"radius": 0.25, "speed_scale": 0.2},
        "radio": {"range": 7.0, "every": 5},
        "sensors": {"range": 2.0},
    }
    got = traffic_settings(scenario_of(**fields).settings)
    assert (got.tick, got.speed, got.radius, got.radio_range) == pytest.approx((0.1, 0.8, 0.25, 7.0))
    assert (got.every, got.sensor_range, got.learns) == (5, 2.0, False)
    settings = scenario_of().settings
    assert traffic_settings(replace(settings, map=replace(settings.map, known=False))).learns


# --- where the lattice lies ---

FINE = 0.02  # m, the side of a map's own cell
FITS = 0.25  # m, the radius of a robot and how far it may stray


def floor_of(width: float, height: float) -> OccupancyMap:
    return OccupancyMap(np.full((round(height / FINE), round(width / FINE)), FREE, np.uint8), FINE)


def mission(**fields: Any) -> Settings:  # noqa: ANN401
    usual: dict[str, Any] = {"start": StartSettings(poses=[]), "return_home": False, "reach": 1.0}
    return Settings(name="lattice", map=MapSettings(), **(usual | fields))


LEFT, RIGHT = (1.0, 1.4), (3.0, 1.4)
# fmt: off
DOORS: dict[str, tuple[float, float]] = {  # y of a door's middle: side of the cells that lead through it [m]
    "a quarter of 1.2":        (1.2,   1.2),
    "a quarter of 1.0":        (1.24,  1.0),
    "an eighth of 1.0":        (1.4,   1.0),
    "a quarter of 0.8":        (1.42,  0.8),
    "an eighth of 0.8":        (1.32,  0.8),
    "no eighth of any, 0.6":   (1.34,  0.6),
}
WAYS: dict[str, dict[str, Any]] = {  # from the left of the wall to its right
    "from a pose":             {"targets": [RIGHT], "start": StartSettings(poses=[(*LEFT, 0.5)])},
    "from a pose and back":    {"targets": [RIGHT], "start": StartSettings(poses=[(*LEFT, 0.5)]), "return_home": True},
    "from a place in an area": {"targets": [RIGHT], "start": StartSettings(area=(0.2, 0.2, 1.8, 2.8))},
    "from target to target":   {"targets": [LEFT, RIGHT]},
    "to a robot's own":        {"own_targets": [[LEFT], [RIGHT]]},
}
# fmt: on


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("door", DOORS)
def test_cells_are_the_largest_that_lead_through_a_door(door: str, way: str) -> None:
    """A door 0.54 m wide lets a disc of 0.25 m pass within 0.02 m of its middle.

    Lattices are tried by quarters, and smaller ones by eighths.
    """
    y, side = DOORS[door]
    floor = floor_of(4.0, 3.0)
    floor.cells[:, 100] = WALL
    floor.cells[round((y - 0.28) / FINE) : round((y + 0.28) / FINE), 100] = FREE
    settings = mission(**WAYS[way])
    placed = with_lattice(settings, floor).traffic
    assert placed.cell == pytest.approx(side)
    centred = side < 0.9 or "eighth" in door
    assert placed.offset == pytest.approx(
        best_offset(floor, side=side, radius=FITS, centred=centred, phases=FINER if centred else PHASES)
    )
    cells = cells_of(floor, with_lattice(settings, floor))
    assert (cells.side, cells.radius, cells.offset) == (placed.cell, FITS, placed.offset)


# fmt: off
SIDES: dict[str, tuple[dict[str, Any], float]] = {
    "nothing to go to":                        ({}, 1.2),
    "a stop":                                  ({"targets": [(0.6, 1.5)]}, 1.2),
    "a radio that reaches far enough":         ({"radio": RadioSettings(range=3.9)}, 1.2),
    "for cells of 1 m":                        ({"radio": RadioSettings(range=3.8)}, 1.0),
    "just":                                    ({"radio": RadioSettings(range=3.5)}, 1.0),
    "for cells of 0.8 m":                      ({"radio": RadioSettings(range=3.3)}, 0.8),
    "just so":                                 ({"radio": RadioSettings(range=3.0)}, 0.8),
    "for cells of 0.6 m":                      ({"radio": RadioSettings(range=2.8)}, 0.6),
    "for none":                                ({"radio": RadioSettings(range=2.1)}, 1.2),
    # 0.8 m apart: cells of 1.2 m miss one of three by 0.12 m, cells of 1 m one of four
    "three stops":                             ({"targets": [(0.7 + 0.8 * k, 1.5) for k in range(3)], "reach": 0.1}, 1.0),
    "four stops":                              ({"targets": [(0.6 + 0.8 * k, 1.5) for k in range(4)], "reach": 0.1}, 0.8),
    "four near enough":                        ({"targets": [(0.6 + 0.8 * k, 1.5) for k in range(4)], "reach": 0.2}, 1.2),
    "own stops":                               ({"own_targets": [[(0.6 + 0.8 * k, 1.5)] for k in range(4)], "reach": 0.1}, 0.8),
    "starts to come back to":                  ({"start": StartSettings(poses=[(0.6 + 0.8 * k, 1.5, 0.1) for k in range(4)]),
                                                 "return_home": True, "reach": 0.1}, 0.8),
    "starts alone":                            ({"start": StartSettings(poses=[(0.6 + 0.8 * k, 1.5, 0.1) for k in range(4)]),
                                                 "reach": 0.1}, 1.2),
    "a start at a wall, in no cell to be in":  ({"start": StartSettings(poses=[(0.01, 0.01, 0.1)])}, 1.2),
    "larger robots":                           ({"robot": scenario_of(robot={"radius": 0.3}).settings.robot}, 1.8),
}
# fmt: on


@pytest.mark.parametrize("name", SIDES)
def test_cells_are_the_largest_that_serve(name: str) -> None:
    fields, side = SIDES[name]
    assert with_lattice(mission(**fields), floor_of(4.0, 3.0)).traffic.cell == pytest.approx(side)


@pytest.mark.parametrize(
    ("robots", "side"),
    [(6, 1.2), (7, 1.0), (9, 1.0), (10, 0.8), (15, 0.8), (16, 0.6), (22, 0.6), (23, 0.5), (48, 0.5), (49, 1.2)],
)
def test_an_area_for_the_starts_holds_a_cell_for_each_robot(robots: int, side: float) -> None:
    """The floor of 4 x 3 m takes 3 x 3 cells of 1.2 m, 4 x 3 of 1 m, 5 x 4 of 0.8 m; robots fill 3/4 of them at most."""
    settings = mission(start=StartSettings(area=(4.0, 3.0, 0.0, 0.0)), robots=robots)
    assert with_lattice(settings, floor_of(4.0, 3.0)).traffic.cell == pytest.approx(side)


@pytest.mark.parametrize(("robots", "side"), [(None, 1.2), (1, 1.2), (2, 0.8), (5, 0.8)])
def test_so_many_robots_as_drive_can_pass_each_other_in_a_hall(robots: int | None, side: float) -> None:
    """A hall 1.4 m wide is one row of cells of 1.2 m, and two of 0.8 m; the scenario itself is for one robot."""
    settings = mission(targets=[(0.7, 0.7), (5.3, 0.7)])
    assert with_lattice(settings, floor_of(6.0, 1.4), robots).traffic.cell == pytest.approx(side)


@pytest.mark.parametrize(("robots", "side"), [(2, 1.2), (4, 0.8)])
def test_a_small_floor_gets_cells_on_which_a_plan_for_all_is_found(robots: int, side: float) -> None:
    """A hall 1.2 m wide with one bay: in cells of 1.2 m two robots change places in the bay, four never do."""
    floor = floor_of(6.0, 2.4)
    floor.cells[round(1.2 / FINE) :, :] = WALL
    floor.cells[round(1.2 / FINE) :, round(2.4 / FINE) : round(3.6 / FINE)] = FREE
    places = [(0.6, 0.6), (1.8, 0.6), (4.2, 0.6), (5.4, 0.6)]
    ends = [places[0], places[-1]] if robots == 2 else places
    settings = mission(
        start=StartSettings(poses=[(*place, 0.1) for place in ends]), own_targets=[[place] for place in ends[::-1]]
    )
    assert with_lattice(settings, floor, robots).traffic.cell == pytest.approx(side)


@pytest.mark.parametrize(("stop", "side"), [(3.2, 1.2), (3.45, 0.5)])
def test_on_a_small_floor_others_can_make_room_for_who_comes_to_its_place(stop: float, side: float) -> None:
    """A room of two by two cells and a hall of two: the last one's robot can leave the hall only if none comes in.

    A place between the hall's cells needs both of them.
    """
    floor = floor_of(4.8, 2.4)
    floor.cells[: round(1.2 / FINE), round(2.4 / FINE) :] = WALL
    starts = [(1.8, 1.8), (0.6, 1.8), (0.6, 0.6), (4.2, 1.8)]
    settings = mission(
        reach=0.05,
        start=StartSettings(poses=[(*start, 0.1) for start in starts]),
        own_targets=[[(stop, 1.8)], [starts[1]], [starts[2]], [(2.7, 1.8)]],
    )
    assert with_lattice(settings, floor, 4).traffic.cell == pytest.approx(side)


def test_a_start_that_cells_do_not_reach_gets_others() -> None:
    """A hall 0.6 m wide leads into a room; in cells of 1.2 m at the room's offset nobody could stand in the hall."""
    floor = floor_of(5.0, 2.4)
    floor.cells[:, : round(2.6 / FINE)] = WALL
    floor.cells[round(0.35 / FINE) : round(0.95 / FINE), : round(2.6 / FINE)] = FREE
    settings = mission(start=StartSettings(poses=[(0.4, 0.65, 0.1)]), own_targets=[[(4.4, 1.8)]])
    cells = cells_of(floor, with_lattice(settings, floor))
    assert cells.pieces[cells.cell_of(0.4, 0.65)] == cells.pieces[cells.nearest_standable(4.4, 1.8)]


@pytest.mark.parametrize("tenths", range(24, 37))
def test_no_start_or_target_lies_beyond_the_last_cells(tenths: int) -> None:
    """The lattice ends up to half a cell before the edge of the map: where it lies decides at which edge."""
    height = tenths / 10
    start, target = (0.4, height - 0.25), (3.75, 0.3)
    settings = mission(start=StartSettings(poses=[(*start, 0.1)]), own_targets=[[target]])
    floor = floor_of(4.0, height)
    cells = cells_of(floor, with_lattice(settings, floor))
    for place in (start, target):
        assert OUTSIDE not in cells.cells_under_disc(*place, 0.2)


def test_a_lattice_that_is_given_stays() -> None:
    floor = floor_of(4.0, 3.0)
    for cell, offset, expected in (
        (1.1, (-0.2, 0.1), (1.1, (-0.2, 0.1))),
        (None, (0.0, 0.0), (1.2, (0.0, 0.0))),
        (1.1, None, (1.1, best_offset(floor, side=1.1, radius=FITS))),
    ):
        placed = with_lattice(mission(traffic=LatticeSettings(cell=cell, offset=offset)), floor).traffic
        assert placed.cell == pytest.approx(expected[0])
        assert placed.offset == expected[1]


def test_a_map_with_cells_as_large_is_its_own_lattice() -> None:
    solid = np.array([[1, 1, 1, 1], [1, 0, 0, 0], [1, 0, 0, 0]], np.uint8)
    settings = mission(traffic=LatticeSettings(cell=0.52))
    assert with_lattice(settings, OccupancyMap(solid, 0.52)).traffic.offset == (0.0, 0.0)
    missed = mission(traffic=LatticeSettings(cell=0.6), targets=[(0.45, 0.6)], reach=0.05)
    assert with_lattice(missed, floor_of(3.0, 3.0)).traffic.offset != (0.0, 0.0)


@pytest.mark.parametrize("given", [{}, {"cell": 1.2}, {"offset": (0.0, 0.0)}])
def test_cells_without_a_place_are_refused(given: dict[str, Any]) -> None:
    settings = mission(traffic=LatticeSettings(**given))
    for make in (cells_of, cells_of_learned_floor):
        with pytest.raises(ConfigError):
            make(floor_of(4.0, 3.0), settings)


def test_to_one_robots_own_map_unknown_floor_is_free() -> None:
    floor = floor_of(2.4, 1.2)
    floor.cells[:] = UNKNOWN
    settings = mission(traffic=LatticeSettings(cell=1.2, offset=(0.0, 0.0)))
    cells = cells_of_learned_floor(floor, settings)
    assert (cells.stands, cells.radius, cells.side, cells.offset) == ((True, True), FITS, 1.2, (0.0, 0.0))
    assert not any(cells_of(floor, settings).stands)


@pytest.mark.parametrize(("i", "j"), list(product(range(4), repeat=2)))
def test_of_all_offsets_by_quarters_the_one_that_misses_least_is_taken(i: int, j: int) -> None:
    def missed(cells: CellMap) -> int:
        return 0 if cells.offset == pytest.approx((-0.3 * i, -0.3 * j)) else 2

    assert best_offset(floor_of(4.9, 4.9), side=1.2, radius=FITS, missed=missed) == pytest.approx((-0.3 * i, -0.3 * j))


def test_of_offsets_that_miss_nothing_the_one_with_most_joins_is_taken() -> None:
    """2 x 2 cells lie on the floor as it is, and one alone if the lattice is shifted by half a cell."""
    assert best_offset(floor_of(2.4, 2.4), side=1.2, radius=FITS) == (0.0, 0.0)
    assert best_offset(floor_of(3.0, 2.4), side=1.2, radius=0.5) == (0.0, 0.0)
    solid = OccupancyMap(np.full((30, 30), WALL, np.uint8), 0.1)
    assert best_offset(solid, side=1.2, radius=FITS) == (0.0, 0.0), "the first of equals"


def test_one_piece_of_floor_is_worth_more_than_many_joins() -> None:
    """A wall with a door in the middle of 4 rows: only the lattice shifted by half a cell leads through it."""
    floor = OccupancyMap(np.zeros((48, 61), np.uint8), 0.1)
    floor.cells[:, 30] = WALL
    floor.cells[21:27, 30] = FREE
    joined = best_offset(floor, side=1.2, radius=FITS)
    assert joined[1] == -0.6


def test_one_cell_alone_is_worth_more_than_two_apart() -> None:
    """Two rooms: as it is, the lattice has a cell in both; shifted by a quarter, in the left one only."""
    floor = floor_of(2.4, 1.2)
    floor.cells[:, 50:76] = WALL
    floor.cells[:, 104:] = WALL
    assert CellMap(floor, side=1.2, radius=FITS).stands == (True, True)
    assert best_offset(floor, side=1.2, radius=FITS) == pytest.approx((-0.3, 0.0))


def test_a_pocket_of_a_large_floor_is_worth_less_than_a_stop() -> None:
    """One cell of 700 is walled in: a difference of 0.003 of the whole does not count."""
    floor = OccupancyMap(np.zeros((26 * 4, 28 * 4), np.uint8), 0.3)
    floor.cells[:6, :6] = WALL
    floor.cells[:4, :4] = FREE

    def missed(cells: CellMap) -> int:
        return 0 if cells.offset == (0.0, 0.0) else 1

    cells = CellMap(floor, side=1.2, radius=FITS)
    assert cells.stands[0]
    assert cells.neighbours[0] == ()
    assert best_offset(floor, side=1.2, radius=FITS, missed=missed) == (0.0, 0.0)


# --- what cells reach ---

ROW = Drawn("ab#c")
A, B, C = ROW.at("abc")


def near(here: Point, there: Point, reach: float, drawn: Drawn = ROW) -> bool:
    return comes_near(drawn.cells, here, there, mission(reach=reach))


# fmt: off
NEAR: dict[str, tuple[Point, Point, float, bool]] = {  # from, to, reach [m]; a robot stands 0.32 m off a middle at most
    "a corner of a cell that it can reach":   ((0.6, 0.6), (2.39, 1.19), 0.01, True),
    "beyond a wall, too far":                 ((0.6, 0.6), (4.2, 0.6), 2.07, False),
    "beyond a wall, within reach":            ((0.6, 0.6), (4.2, 0.6), 2.09, True),
    "in a wall, too far":                     ((0.6, 0.6), (3.0, 0.6), 0.87, False),
    "in a wall, within reach":                ((0.6, 0.6), (3.0, 0.6), 0.89, True),
    "off the map, too far":                   ((1.8, 0.6), (-0.5, 0.6), 0.77, False),
    "off the map, within reach":              ((1.8, 0.6), (-0.5, 0.6), 0.79, True),
    "off the map, on the other side":         ((0.6, 0.6), (5.3, 0.6), 3.17, False),
    "from c to c":                            ((4.2, 0.6), (4.3, 0.6), 0.01, True),
    "from a wall the cells tell nothing":     ((3.0, 0.6), (0.6, 0.6), 0.01, True),
    "from off the map neither":               ((-2.0, 0.6), (4.2, 0.6), 0.01, True),
    "from a cell in part":                    ((2.3, 0.6), (4.2, 0.6), 2.07, False),
}
# fmt: on


@pytest.mark.parametrize("name", NEAR)
def test_whether_a_robot_comes_near_a_place(name: str) -> None:
    here, there, reach, comes = NEAR[name]
    assert near(here, there, reach) is comes


def test_what_is_off_the_map_is_no_cell_to_start_from() -> None:
    """The last cell can be stood in; its number is not that of the place beyond the edge."""
    drawn = Drawn("##c", "###")
    assert near((0.05, 1.8), (4.2, 0.6), 0.01, drawn), "it stands in a wall and outside: the cells tell nothing"
    last = Drawn("a#b")
    assert not near((0.1, 0.6), (3.0, 0.6), 0.5, last), "a leads nowhere, though it reaches over the edge"
    assert not near((3.0, 0.6), (-9.0, 0.6), 0.5, last)


def test_how_far_short_of_a_stop_a_robot_stands() -> None:
    """0.28 m of body and margins fit in a half cell of 0.6 m; it stops within 0.04 m of its place."""
    for x, short in ((1.8, 0.04), (2.1, 0.04), (2.2, 0.12), (1.3, 0.22)):
        assert distance_to_stop(ROW.cells, (x, 0.6), mission()) == pytest.approx(short)
    assert distance_to_stop(Drawn("##").cells, (0.6, 0.6), mission()) == inf


def test_cells_within_a_box_are_those_with_their_middle_in_it() -> None:
    drawn = Drawn("abcd", "e#gh", "ijkl", side=1.0)  # middles at 0.5 to 3.5, and 0.5 to 2.5
    for x0, x1 in ((0.6, 2.5), (2.5, 0.6)):
        for y0, y1 in ((1.5, 2.9), (2.9, 1.5)):
            assert cells_within(drawn.cells, (x0, y0, x1, y1)) == sorted(drawn.at("bcg"))
    assert cells_within(drawn.cells, (1.5, 0.2, 3.4, 1.6)) == sorted(drawn.at("jkg"))
    assert cells_within(drawn.cells, (0.6, 0.6, 1.4, 1.4)) == []


SQUARES = """\
#######
#.#...#
#.#.#.#
#...#.#
#######
"""  # 11 free squares in one piece, one robot wide


@given(side=st.floats(0.81, 1.95), radius=st.sampled_from([0.2, 0.15, 0.25, 0.1 + 0.1, 0.3 - 0.1]))
def test_a_map_of_squares_that_a_robot_can_turn_in_is_its_own_lattice_and_leaves_no_floor_out(
    side: float, radius: float
) -> None:
    """Also if the side of a square, 6 x 0.2 m as a number, is not the square's of the map in its last digit."""
    for given_side in (side, 6 * radius):
        shape = {"radius": radius, "track_width": 1.9 * radius}
        if not 4.0 * radius <= given_side <= 10.0 * radius:
            continue
        drawn = scenario_of(
            SQUARES, map={"text": SQUARES, "cell": round(given_side, 3)}, robot=shape, return_home=False,
            start={"poses": [[1.5 * given_side, 1.5 * given_side, 0.0]]}, targets=[[5.5 * given_side, 1.5 * given_side]],
        )  # fmt: skip
        cells = cells_of(drawn.map, drawn.settings)
        assert sum(cells.stands) == 11
        assert not cells.has_unused_floor
        assert comes_near(
            cells, (1.5 * given_side, 1.5 * given_side), (5.5 * given_side, 1.5 * given_side), drawn.settings
        )


def test_a_lattice_that_a_wall_reaches_into_leaves_floor_out() -> None:
    shifted = scenario_of(SQUARES, map={"text": SQUARES, "cell": 1.2}, traffic={"cell": 1.2, "offset": [0.0, 0.0]})
    assert not cells_of(shifted.map, shifted.settings).has_unused_floor
    shifted = scenario_of(SQUARES, map={"text": SQUARES, "cell": 1.2}, traffic={"cell": 1.2, "offset": [-0.3, 0.0]})
    assert cells_of(shifted.map, shifted.settings).has_unused_floor


CORNER = Drawn("ab#", "#cd", "##e")
CROSS = Drawn("#u#", "lmr", "#d#")
STRAIGHT = Drawn("abc")


def joins(drawn: Drawn, room: float) -> set[str]:
    """Return the joined pairs by name, each once."""
    cells = remove_unheard_joins(drawn.cells, room)
    names = dict(zip(drawn.at("".join(drawn.names)), drawn.names, strict=True))
    pairs = {(cell, near) for cell in names for near in cells.neighbours[cell]}
    assert pairs == {(near, cell) for cell, near in pairs}
    return {names[cell] + names[near] for cell, near in pairs if cell < near}


# fmt: off
JOINED: dict[str, tuple[Drawn, float, set[str]]] = {
    "from where they lean they see each other":    (CORNER,   0.4,  {"ab", "cb", "cd", "ed"}),
    "in the middle of their cells they do not":    (CORNER,   0.5,  {"ab", "ed"}),
    "of four, two opposite ones are left":         (CROSS,    0.6,  {"dm", "mu"}),
    "of four that lean none is parted":            (CROSS,    0.3,  {"dm", "mu", "lm", "mr"}),
    "along a straight way all see each other":     (STRAIGHT, 0.6,  {"ab", "bc"}),
}
# fmt: on


@pytest.mark.parametrize("name", JOINED)
def test_cells_over_which_robots_would_not_hear_each_other_are_parted(name: str) -> None:
    """The line between two that lean 0.2 m from their middles passes a corner 0.14 m off, at 0.1 m only 0.07 m off."""
    drawn, room, pairs = JOINED[name]
    assert joins(drawn, room) == pairs
