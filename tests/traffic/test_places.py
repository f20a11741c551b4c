"""Missions to any free place, and halls that are two robots wide, in physics; the world's own watch checks them."""

from dataclasses import replace
from typing import Any

import msgspec
import pytest

from benchmarks.floor import find_rest, hall, load_scenario, mission_to_places
from swarm.maps.occupancy import Point
from swarm.scenario.load import Scenario
from swarm.scenario.prepare import settle_lattice
from swarm.settings import LocalisationSettings, StartSettings
from tests.shared import mostly_long, scenario_of
from world.simulate import Simulation


def assert_clean(report: dict[str, Any]) -> None:
    assert report["complete"], report["reason"]
    assert report["contacts"] == {"robot": 0, "wall": 0, "obstacle": 0}
    assert report["traffic"]["overlaps"] == report["traffic"]["outside"] == 0


@pytest.mark.parametrize(
    ("robots", "reach", "seed"),
    [
        (1, 0.05, 12),
        pytest.param(4, 0.1, 101, marks=pytest.mark.long("a whole mission of 4 robots")),
        pytest.param(8, 0.1, 3, marks=pytest.mark.long("a whole mission of 8 robots")),
    ],
)
def test_robots_come_to_any_free_place(paper: Scenario, robots: int, reach: float, seed: int) -> None:
    mission = mission_to_places(paper, robots, 3, reach, seed)
    assert_clean(Simulation.of(mission, robots, 1).run(limit=500.0))


# fmt: off
RESTS: dict[str, tuple[str, int]] = {  # the scenario, and the seed that draws a place
    "in the middle of a floor":                        ("paper", 0),
    "over a cell of its way, which it needs there":    ("paper", 9626),
    "within reach from inside its cell":               ("office", 9612),
    "the robot then waits for orders":                 ("box", 9619),
    "the same, and it came in beside its way":         ("box", 9613),
    "it counts as there before it holds the cells":    ("unknown", 9713),
}
# fmt: on


@pytest.mark.parametrize("name", RESTS)
def test_a_robot_stands_on_its_place_to_3_cm_and_stays(name: str) -> None:
    scenario, seed = RESTS[name]
    assert find_rest(scenario, seed) <= 0.03


def test_a_robot_that_leaves_its_way_for_the_straight_line_keeps_what_the_line_needs() -> None:
    """It gave up the cell between the two that it had left, and drove round in them for ever."""
    office = settle_lattice(load_scenario("office"))
    settings = msgspec.structs.replace(
        office.settings,
        start=StartSettings(poses=[(13.968, 9.915, 0.0)]),
        own_targets=[[(1.88, 7.796)]],
        targets=[],
        reach=0.05,
        return_home=False,
    )
    assert_clean(Simulation.of(replace(office, settings=settings), 1, 1).run(limit=90.0))


@pytest.mark.parametrize("width", [1.0, 1.2, 1.4, 1.6, 2.0])
def test_two_robots_pass_where_two_bodies_fit_beside_each_other(width: float) -> None:
    assert_clean(Simulation.of(hall(width, 2), 2, 1).run(limit=250.0))


@pytest.mark.parametrize("robots", mostly_long("a mission of many robots", (2, 4, 6), 2))
def test_a_hall_of_four_diameters_takes_many_robots_little_longer_than_one(robots: int) -> None:
    """They pass in two lanes. Their plans took corners for short cuts, and six robots wove through each other."""
    alone, together = (
        [Simulation.of(hall(1.6, count, seed), count, seed).run(limit=250.0) for seed in (1, 2)]
        for count in (1, robots)
    )
    for report in (*alone, *together):
        assert_clean(report)
    mean, mean_alone = (sum(report["sim_time"] for report in reports) / 2 for reports in (together, alone))
    assert mean <= 1.3 * mean_alone


@pytest.mark.long("three minutes of six robots")
def test_six_robots_pass_where_two_bodies_barely_fit() -> None:
    assert_clean(Simulation.of(hall(1.0, 6), 6, 1).run(limit=250.0))


def test_a_robot_comes_as_near_to_a_wall_as_its_place_is(paper: Scenario) -> None:
    """It faces the wall, 5 cm before it: more than 5 cm would not be within the reach."""
    mission = mission_to_places(paper, 1, 1, 0.04, 0)
    x = mission.map.origin.x + mission.map.resolution + mission.settings.robot.radius + 0.05
    settings = msgspec.structs.replace(mission.settings, own_targets=[[(x, 1.5)]])
    assert_clean(Simulation.of(replace(mission, settings=settings), 1, 1).run(limit=200.0))


@pytest.mark.parametrize("seed", mostly_long("half a minute of two robots", (None, 9941, 9943), 9941))
def test_they_pass_with_poses_that_are_3_cm_off(seed: int | None) -> None:
    """In seed 9941 the place lies between two lanes: from inside its cell it may be out of reach."""
    error = LocalisationSettings(error=0.03, yaw_error_deg=1.5)
    scenario = hall(1.6, 2, seed)
    settings = msgspec.structs.replace(scenario.settings, localisation=error)
    assert_clean(Simulation.of(replace(scenario, settings=settings), 2, seed or 1).run(limit=100.0))


WIDE = "\n".join(["#" * 30, *["#" + "." * 28 + "#"] * 5, "#" * 30])  # 2.5 m between the walls
HEAD_ON: dict[str, dict[str, object]] = {
    "large": {"radius": 0.45, "track_width": 0.8},
    "small": {"radius": 0.06, "track_width": 0.1},
}


def change_sides(text: str, west: list[Point], east: list[Point], **more: object) -> Scenario:
    """Return robots at places [m] at both ends of a drawing in squares of 0.5 m; each drives to one of the other end."""
    starts = [*([*place, 0.0] for place in west), *([*place, 3.1] for place in east)]
    fields: dict[str, Any] = {
        "map": {"text": text, "cell": 0.5},
        "start": {"poses": starts},
        "targets": [],
        "own_targets": [[place] for place in (*east, *west)],
        "robots": len(starts),
        "return_home": False,
    }
    return scenario_of(text, **(fields | more))


@pytest.mark.parametrize("size", HEAD_ON)
def test_large_and_small_robots_pass_on_the_same_floor_and_come_to_rest(size: str) -> None:
    """The large ones drove round their places for a minute, in arcs that were wider than what was left of the way."""
    scenario = change_sides(WIDE, [(1.5, 1.7)], [(13.0, 1.7)], robot=HEAD_ON[size])
    assert_clean(Simulation.of(scenario, 2, 1).run(limit=60.0))


SHUFFLE = "\n".join(["########", *["#......#"] * 6, "########"])
CORNERS = [(1.2 + 1.2 * (number % 3), 1.2 + 1.2 * (number // 3)) for number in range(8)]  # m


def test_eight_robots_on_nine_places_move_on_by_one_place() -> None:
    """On cells of 1.2 m they filled eight of nine cells, and needed 132 s."""
    scenario = scenario_of(
        SHUFFLE,
        map={"text": SHUFFLE, "cell": 0.6},
        start={"poses": [[*place, 0.0] for place in CORNERS]},
        targets=[],
        own_targets=[[place] for place in (*CORNERS[1:], CORNERS[0])],
        robots=8,
        return_home=False,
    )
    report = Simulation.of(scenario, 8, 1).run(limit=45.0)
    assert_clean(report)


LONG, BAY = 102, (47, 8)  # squares of 0.5 m: a corridor 1.5 m wide, and a bay at its middle
BAY_ROW = "#" * (BAY[0] + 1) + "." * BAY[1] + "#" * (LONG - sum(BAY) + 1)
CORRIDOR = "\n".join(["#" * (LONG + 2), *[BAY_ROW] * 3, *["#" + "." * LONG + "#"] * 3, "#" * (LONG + 2)])


@pytest.mark.long("two minutes of six robots")
def test_robots_that_start_1_4_m_apart_in_a_corridor_own_a_cell_each() -> None:
    """Their starts were taken, and two cells of 1.2 m had two owners before anybody moved."""
    west, east = ([(x, 1.25) for x in row] for row in ((1.2, 2.6, 4.0), (50.8, 49.4, 48.0)))
    scenario = change_sides(CORRIDOR, west, east)
    assert_clean(Simulation.of(scenario, 6, 1).run(limit=250.0))


ROOMS = "\n".join(
    [
        "#" * 30,
        *["#" + "." * (13 + free) + "#" * (1 - free) + "." * 14 + "#" for free in (0, 0, 1, 1, 1, 1, 0, 0)],
        "#" * 30,
    ]
)


@pytest.mark.long("a minute of six robots")
def test_a_door_that_shuts_again_and_again_lets_all_through() -> None:
    west, east = ([(x, y) for y in (1.0, 2.4, 3.8)] for x in (1.5, 13.3))
    edits = [
        {"at": 5.0 + 10.0 * number, "kind": ("wall", "free")[number % 2], "low": (7.0, 1.5), "high": (7.5, 3.5)}
        for number in range(12)
    ]
    simulation = Simulation.of(change_sides(ROOMS, west, east, edits=edits), 6, 1)
    assert_clean(simulation.run(limit=120.0))
    assert simulation.world.bodies.edits >= 3, "it shut, opened and shut before all were through"
