"""Good scenarios: the round trip over the wire, starts from the seed, and the contents of paper.yaml."""

from itertools import combinations, pairwise
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from swarm.bus.codec import decode, encode
from swarm.errors import ConfigError, PeerError, SwarmError
from swarm.geometry import distance
from swarm.messages import MAP, Map
from swarm.planning.grid import Grid
from swarm.planning.path import plan
from swarm.scenario.check import check
from swarm.scenario.load import Scenario, load
from swarm.scenario.starts import number_of, robot_names, starts
from swarm.traffic.lattice.placement import cells_of
from tests.shared import ROOM, ROOT, scenario_of, with_settings


def test_a_scenario_comes_back_from_the_wire_as_it_went(paper: Scenario) -> None:
    scenario, packed = paper.to_wire()
    floor = decode(encode(Map(scenario=scenario, packed=packed)), Map, MAP.limit)
    back = Scenario.from_wire(floor.scenario, floor.packed)
    assert back.settings == paper.settings
    assert back.profile == paper.profile
    assert np.array_equal(back.map.cells, paper.map.cells)
    assert (back.map.resolution, back.map.origin) == (paper.map.resolution, paper.map.origin)


BROKEN: dict[str, dict[str, Any]] = {
    "nothing": {"settings": None, "profile": None},
    "no settings": {"settings": {}},
    "numbers": {"settings": 3, "profile": 3},
    "a setting of the future": {"settings": {"name": "x", "map": {}, "start": {}, "wings": 2}},
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_scenario_on_the_wire_is_refused_on_arrival(paper: Scenario, name: str) -> None:
    scenario, packed = paper.to_wire()
    message = {"v": 1, "scenario": msgspec.to_builtins(scenario) | BROKEN[name], "packed": packed}
    with pytest.raises(PeerError, match="scenario"):
        decode(msgspec.msgpack.encode(message), Map, MAP.limit)


def test_settings_and_rules_on_the_wire_that_contradict_each_other_are_refused(paper: Scenario) -> None:
    scenario, packed = paper.to_wire()
    settings = replace(scenario.settings, targets=[], own_targets=[])
    with pytest.raises(SwarmError, match="expected either `targets`"):
        Scenario.from_wire(replace(scenario, settings=settings), packed)
    with pytest.raises(SwarmError, match="behaviours"):
        Scenario.from_wire(replace(scenario, profile=replace(scenario.profile, behaviours={"a": "no rules"})), packed)


@pytest.mark.parametrize("seed", range(1, 6))
def test_the_paper_scenario_passes_its_check_with_many_robots(paper: Scenario, paper_grid: Grid, seed: int) -> None:
    assert len(check(paper, 12, seed).starts) == 12


@pytest.mark.parametrize("seed", range(1, 6))
def test_the_shortest_way_of_the_paper_scenario_is_well_longer_than_the_straight_one(
    paper: Scenario, paper_grid: Grid, seed: int
) -> None:
    (start,) = starts(paper, 1, seed)
    legs = list(pairwise((start[:2], *paper.stops(0, start[:2]))))
    ways = [plan(paper_grid, a, b) for a, b in legs]
    assert sum(way.length for way in ways if way) >= 1.3 * sum(distance(a, b) for a, b in legs)
    assert len(legs) == 4
    assert legs[-1][1] == start[:2], "home"


@given(seed=st.integers(0, 2**53), robots=st.integers(1, 6))
def test_drawn_starts_lie_in_their_area_apart_from_each_other_and_from_walls(seed: int, robots: int) -> None:
    scenario = scenario_of(start={"area": [6.5, 4.9, 1.1, 1.1]})
    poses = starts(scenario, robots, seed)
    assert poses == starts(scenario, robots, seed)
    for pose in poses:
        assert 1.1 <= pose.x <= 6.5
        assert 1.1 <= pose.y <= 4.9
        assert min(pose.x - 1, pose.y - 1, 5 - pose.y) >= 0.2 + 0.2 - 0.1, "walls are a radius and a gap away"
    for one, other in combinations(poses, 2):
        assert distance(one, other) >= 0.6


@given(st.integers(0, 2**53))
def test_starts_drawn_under_holds_have_a_cell_each(paper: Scenario, paper_grid: Grid, seed: int) -> None:
    cells = cells_of(paper.map, paper.settings)
    radius = paper.settings.robot.radius
    touched = [cells.cells_under_disc(pose.x, pose.y, radius) for pose in starts(paper, 12, seed)]
    assert all(len(under) == 1 for under in touched)
    assert len(set(touched)) == 12


def test_a_floor_that_nobody_is_given_has_the_same_lattice() -> None:
    known, unknown = (scenario_of(map={"text": ROOM, "cell": 1.0, "known": given}) for given in (True, False))
    assert known.settings.traffic == unknown.settings.traffic


def corner_target(reach: float, **traffic: object) -> Scenario:
    """Return a target where four cells of 1 m meet, unless the lattice lies elsewhere."""
    return scenario_of(targets=[[5.0, 3.0]], reach=reach, traffic={"cell": 1.0, "offset": [0.0, 0.0]} | traffic)


# fmt: off
CORNERS: dict[str, tuple[float, dict[str, Any]]] = {  # reach [m], traffic
    "at the corner of cells": (0.3, {}),
    "to the centimetre":      (0.05, {}),
    "a longer reach":         (0.5, {}),
    "another lattice":        (0.3, {"offset": [-0.25, -0.25]}),
    "the best lattice":       (0.3, {"cell": 1.2, "offset": None}),
}
# fmt: on


@pytest.mark.parametrize("name", CORNERS)
def test_no_lattice_refuses_a_stop(name: str) -> None:
    reach, traffic = CORNERS[name]
    assert len(check(corner_target(reach, **traffic), 2, 1).starts) == 2


# fmt: off
LATTICES = {  # traffic, whether it is refused; the floor has a door from 3 m to 4 m
    "no row of cells in the door": ({"cell": 1.0, "offset": [0.0, -0.5]}, True),
    "one in the middle of it":     ({"cell": 1.0, "offset": [0.0, 0.0]}, False),
    "the best lattice":            ({}, False),
}
# fmt: on


@pytest.mark.parametrize("name", LATTICES)
def test_a_stop_that_no_way_over_cells_leads_to_is_refused(name: str) -> None:
    traffic, refused = LATTICES[name]
    door = "##########\n#...#....#\n#........#\n#...#....#\n#...#....#\n##########\n"
    scenario = scenario_of(door, start={"poses": [[2.5, 2.5, 0.0]]}, reach=0.6, traffic=traffic)
    if refused:
        with pytest.raises(
            ConfigError,
            match=r"target 1 of r1 at \(7.5, 3.5\): expected a way from \(.*\) on which a robot reserves squares of 1 m",
        ):
            check(scenario, 1, 1)
    else:
        assert check(scenario, 1, 1).starts == [(2.5, 2.5, 0.0)]


def test_the_first_robots_start_where_they_did_when_more_join(paper: Scenario, paper_grid: Grid) -> None:
    assert starts(paper, 8, 3)[:4] == starts(paper, 4, 3)


@pytest.mark.parametrize("robots", [1, 9, 10, 100, 1000])
def test_names_sort_by_number(robots: int) -> None:
    given_names = robot_names(robots)
    assert sorted(given_names) == list(given_names)
    assert [number_of(name) for name in given_names] == list(range(robots))


def test_stops_end_at_home_only_where_the_mission_returns() -> None:
    scenario = scenario_of(targets=[], own_targets=[[[7.5, 3.5]], [[3.5, 3.5], [4.5, 3.5]]])
    assert scenario.stops(0, (2.5, 2.5)) == ((7.5, 3.5), (2.5, 2.5))
    assert scenario.stops(1, (2.5, 4.5)) == ((3.5, 3.5), (4.5, 3.5), (2.5, 4.5))
    assert with_settings(scenario, return_home=False).stops(0, (2.5, 2.5)) == ((7.5, 3.5),)


@pytest.mark.parametrize(("folder", "path"), [(".", "scenarios/office.yaml"), ("scenarios", "depot.yaml")])
def test_a_map_file_is_found_beside_the_scenario_wherever_one_stands(
    monkeypatch: pytest.MonkeyPatch, folder: str, path: str
) -> None:
    monkeypatch.chdir(ROOT / folder)
    assert load(Path(path)).map.shape > (1, 1)


LONG_AND_NARROW = """\
###############
#.............#
###############
"""


@pytest.mark.parametrize(
    ("cell", "fields", "side", "refused"),
    [
        (1.2, {}, 1.2, ""),
        (0.6, {}, 1.2, ""),  # cells may reach into walls
        (0.45, {}, 1.2, "expected a place with room to drive off, got a nook between walls"),  # no room to stray in
        (1.2, {"radio": {"range": 3.0}}, 0.8, ""),  # two that claim a cell must hear each other
        (1.2, {"radio": {"range": 2.5}}, 0.6, ""),
        (1.2, {"radio": {"range": 2.1}}, 1.2, "radio.range: expected 3.88 m or more for cells of 1.2 m, got 2.1 m"),
    ],
)
def test_cells_are_the_largest_that_serve(cell: float, fields: dict[str, Any], side: float, refused: str) -> None:
    middle = 1.5 * cell
    scenario = scenario_of(
        LONG_AND_NARROW,
        map={"text": LONG_AND_NARROW, "cell": cell},
        start={"poses": [[middle, middle, 0.0]]},
        targets=[[10.5 * cell, middle]],
        return_home=False,
        **fields,
    )
    assert scenario.settings.traffic.cell == pytest.approx(side)
    if refused:
        with pytest.raises(ConfigError, match=refused):
            check(scenario, 1, 1)
    else:
        assert check(scenario, 1, 1)
