"""What one robot knows of an unknown floor: from its rays, from edits and from the radio, and what it forgets."""

from collections.abc import Callable
from dataclasses import replace
from itertools import chain, pairwise
from math import pi

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from shapely.geometry.base import BaseGeometry

from swarm.geometry import Pose, distance
from swarm.maps.occupancy import FREE, UNKNOWN, WALL, OccupancyMap, Point
from swarm.messages import Activity, Broadcast, Sense
from swarm.planning.path import plan
from swarm.robot.ground import DEAF, TELL, Ground
from swarm.scenario.load import Scenario
from tests.shared import scenario_of, with_block, with_settings
from world.world import World

TEXT = """\
##########
#........#
#...##...#
#...##...#
#........#
##########
"""
START = Pose(2.5, 2.5, 0.0)
NEAR = 0.35  # m, so far from a robot's middle a hit may be on it


def unknown(**sensors: object) -> Scenario:
    """An unknown room, each cell half a metre."""
    scenario = scenario_of(
        TEXT,
        map={"text": TEXT, "cell": 1.0, "known": False},
        start={"poses": [[*START]]},
        targets=[[7.5, 2.5]],
    )
    return with_settings(scenario, sensors=sensors) if sensors else scenario


def looks(scenario: Scenario, seed: int = 1, place: tuple[float, float] = START[:2], turns: int = 80) -> list[Sense]:
    """What a robot senses that turns on the spot."""
    senses: list[Sense] = []
    for turn in range(turns):
        world = World(scenario, [Pose(*place, 2 * pi * turn / turns - pi)], seed + turn)
        senses += world.senses(lockstep=True).values()
    return senses


def learned(scenario: Scenario, place: tuple[float, float] = START[:2]) -> Ground:
    ground = Ground(scenario)
    for _ in range(4):
        for sense in looks(scenario, place=place):
            ground.learn(sense, nobody)
    return ground


def nobody(place: Point) -> bool:
    """Know of no robot anywhere."""
    return False


def near(body: Point) -> Callable[[Point], bool]:
    """Know of one robot."""
    return lambda place: distance(body, place) < NEAR


def walls_of(floor: OccupancyMap) -> BaseGeometry:
    blocks = (shapely.Polygon(floor.corners(low, high)) for low, high in floor.blocks(WALL))
    union: BaseGeometry = shapely.unary_union(list(blocks))
    return union


@pytest.mark.parametrize("noise", [0.0, 0.02])
def test_walls_in_sight_are_learned_where_they_are_and_nowhere_else(noise: float) -> None:
    scenario = unknown(noise=noise)
    ground = learned(scenario)
    assert (ground.map.cells == WALL).sum() > 40
    truth = walls_of(scenario.map)
    for low, high in ground.map.blocks(WALL):
        strayed = shapely.Polygon(ground.map.corners(low, high)).difference(truth.buffer(0.11 if noise else 0.1))
        assert strayed.area < 1e-6
    assert ground.map.at(*START[:2]) == FREE
    assert ground.map.at(9.5, 5.5) == UNKNOWN, "nobody looked there"


@pytest.mark.parametrize(("resolution", "factor"), [(0.05, 1), (0.1, 1), (0.11, 2), (0.2, 2), (0.25, 3), (1.0, 10)])
def test_an_unknown_floor_has_cells_of_a_decimetre_at_most(resolution: float, factor: int) -> None:
    walls = OccupancyMap(np.full((30, 40), WALL, np.uint8), resolution)
    blank = Ground(replace(unknown(), map=walls)).map
    assert blank.shape == (30 * factor, 40 * factor)
    assert blank.resolution == pytest.approx(resolution / factor)
    assert (blank.cells == UNKNOWN).all()


def test_beside_the_corner_of_the_map_walls_are_learned_too() -> None:
    """Its rays reach farther than the map there."""
    scenario = unknown()
    for x, y in ((1.3, 1.3), (8.7, 4.7)):
        floor = learned(scenario, place=(x, y)).map
        outwards = 0.35 if x > 5.0 else -0.35
        assert floor.at(x, y) == FREE
        assert floor.at(x + outwards, y) == floor.at(x, y + outwards) == WALL


def test_nothing_is_learned_before_one_has_heard_who_is_near() -> None:
    scenario = unknown()
    ground = Ground(scenario)
    (sense,) = World(scenario, [START], 1).senses(lockstep=True).values()
    assert not ground.learn(sense, nobody)
    assert (ground.map.cells == UNKNOWN).all()


def test_another_robot_in_sight_is_no_wall() -> None:
    scenario = unknown()
    here, there = Pose(2.0, 2.0, 0.0), Pose(2.0, 3.0, 0.0)
    grounds = {"told of": Ground(scenario), "not told of": Ground(scenario)}
    for _ in range(4):
        for turn in range(60):
            world = World(scenario, [Pose(*here[:2], 2 * pi * turn / 60 - pi), there], 1)
            sense = world.senses(lockstep=True)["r1"]
            grounds["told of"].learn(sense, near(there[:2]))
            grounds["not told of"].learn(sense, nobody)
    box = shapely.box(1.8, 2.8, 2.2, 3.2)
    assert not walls_of(grounds["told of"].map).intersects(box)
    assert walls_of(grounds["not told of"].map).intersects(box)


def test_another_robot_hides_no_wall_that_is_farther_off_than_its_body_may_be() -> None:
    scenario = unknown()
    body = (1.0, 3.0)  # in the wall on the left: a robot is never there, but it is near it that walls are looked for
    alone, told = Ground(scenario), Ground(scenario)
    for _ in range(4):
        for sense in looks(scenario):
            alone.learn(sense, nobody)
            told.learn(sense, near(body))
    rows, columns = np.nonzero((alone.map.cells == WALL) & (told.map.cells != WALL))
    away = [
        np.hypot((column + 0.5) * 0.1 - body[0], (row + 0.5) * 0.1 - body[1])
        for row, column in zip(rows, columns, strict=True)
    ]
    assert 0 < len(away) < (alone.map.cells == WALL).sum() / 2
    assert max(away) < NEAR + 0.5 * scenario.settings.robot.radius + 0.1


def test_a_wall_that_goes_is_unlearned() -> None:
    scenario = unknown()
    ground = learned(scenario)
    assert ground.map.at(4.05, 2.5) == WALL
    opened = Scenario(scenario.settings, with_block(scenario.map, (2, 4), (4, 6), FREE), scenario.profile)
    for _ in range(12):
        for sense in looks(opened):
            ground.learn(sense, nobody)
    assert ground.map.at(4.05, 2.5) != WALL


def test_what_one_tells_another_plans_around() -> None:
    scenario = unknown()
    teller, hearer = learned(scenario, place=(3.0, 3.0)), Ground(scenario)
    straight = plan(hearer.grid, (3.0, 2.5), (7.5, 2.5))
    assert straight is not None
    assert straight.length == pytest.approx(4.5), "the unknown is taken for free"
    for _ in range(30):
        hearer.hear(teller.tell(), 0.0)
    told = np.flatnonzero(hearer.map.cells == WALL)
    assert set(told) <= set(np.flatnonzero(teller.map.cells == WALL))
    assert hearer.map.at(4.05, 2.5) == WALL
    around = plan(hearer.grid, (3.0, 2.5), (7.5, 2.5))
    assert around is not None
    heard = walls_of(hearer.map)
    for a, b in pairwise(around.points):
        assert shapely.LineString([a, b]).distance(heard) > 0.19


def test_news_fit_into_a_broadcast_and_come_round_to_late_comers() -> None:
    ground = learned(unknown(), place=(3.0, 3.0))
    told = [ground.tell() for _ in range(20)]
    assert all(len(cells) <= TELL for cells in told)
    assert set(told[0]) <= set(chain.from_iterable(told[10:]))
    Broadcast(
        robot="r1", run=0, tick=0, x=0.0, y=0.0, yaw=0.0, activity=Activity.DRIVE, target=0, distance=0.0, reached=[],
        walls=told[0],
    )  # fmt: skip


def test_all_that_is_known_is_told_in_turn_and_nothing_twice_in_a_round(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("swarm.robot.ground.TELL", 7)
    ground = learned(unknown(), place=(3.0, 3.0))
    told = list(chain.from_iterable([ground.tell() for _ in range(60)][30:]))  # what is new was told before
    known = len(set(told))
    assert known > 2 * 7
    assert all(len(set(told[first : first + known])) == known for first in range(len(told) - known))


def test_a_robot_with_a_given_map_tells_learns_and_forgets_nothing_of_it() -> None:
    scenario = scenario_of(TEXT)
    ground = Ground(scenario)
    before = ground.map
    for sense in looks(scenario, turns=4):
        assert not ground.learn(sense, nobody)
    assert ground.tell() == []
    assert ground.map is before


def test_what_the_own_eyes_saw_free_is_not_believed_from_others() -> None:
    ground = learned(unknown())
    columns = ground.map.shape[1]
    row, column = ground.map.cell_of(*START[:2])
    assert not ground.hear([row * columns + column], 0.0)
    assert ground.map.at(*START[:2]) == FREE


@given(st.lists(st.integers(-(2**60), 2**60) | st.integers(-5000, 20_000), max_size=20))
def test_cell_numbers_off_the_floor_are_ignored(cells: list[int]) -> None:
    ground = Ground(unknown())
    ground.hear(cells, 0.0)
    rows, columns = ground.map.shape
    known = {cell for cell in cells if 0 <= cell < rows * columns}
    assert set(np.flatnonzero(ground.map.cells == WALL).tolist()) == known


def test_hearing_the_same_again_is_no_news() -> None:
    ground = Ground(unknown())
    assert ground.hear([500, 501], 0.0)
    assert not ground.hear([500, 501], 0.0)


def test_forgetting_leaves_an_empty_floor_that_can_be_learned_anew() -> None:
    scenario = unknown()
    ground = learned(scenario)
    ground.forget(7.0)
    assert not (ground.map.cells == WALL).any()
    assert not ground.hear([500], 7.0 + DEAF - 0.1), "what others tell may be what was wrong"
    assert bool(ground.grid.free[5:-5, 5:-5].all())
    for _ in range(12):
        for sense in looks(scenario):
            ground.learn(sense, nobody)
    assert ground.map.at(4.05, 2.5) == WALL


def test_the_grid_is_always_the_one_grown_from_the_map() -> None:
    from swarm.scenario.prepare import planning_grid

    scenario = unknown(noise=0.03)
    ground = Ground(scenario)
    for number, sense in enumerate(looks(scenario)):
        ground.learn(sense, nobody)
        ground.hear([number * 37], 0.0)
    grown = planning_grid(scenario, ground.map)
    assert (ground.grid.solid == grown.solid).all()
    assert (ground.grid.free == grown.free).all()
    assert np.allclose(ground.grid.clearance, grown.clearance)
