"""Whom an edit leaves without a way: the answer of the world's own check, and that a dry run changes nothing."""

from typing import Any

import pytest

from swarm.errors import ConfigError
from swarm.messages import Edit, Kind, Order, PoolTargets
from tests.shared import scenario_of
from world.simulate import Simulation
from world.tasks.edit_cuts import find_cut_targets, format_cut_targets
from world.world import World

ROOMS = """\
############
#....#.....#
#....#.....#
#..........#
#....#.....#
#....#.....#
############
"""
WEST, EAST = (2.5, 3.5), (8.5, 3.5)
DOOR = ((5.2, 3.2), (5.8, 3.8))


def world_of(**fields: Any) -> World:  # noqa: ANN401
    """Return two robots in the western room; r1 is to drive to the east, r2 stays in the west; both return home."""
    scenario: dict[str, Any] = {
        "start": {"poses": [[2.5, 2.5, 0.0], [2.5, 4.5, 0.0]]}, "targets": [], "return_home": True,
        "own_targets": [[EAST], [WEST]],
    }  # fmt: skip
    return Simulation.of(scenario_of(ROOMS, **(scenario | fields)), 2, 1).world


def edit(low: tuple[float, float], high: tuple[float, float], kind: Kind = Kind.WALL) -> Edit:
    return Edit(kind=kind, low=low, high=high)


# fmt: off
CASES = {  # an edit: whether it changes the floor, and whom it leaves without a way
    "the door is shut":            (edit(*DOOR),                      True,  [("r1", "target 1")]),
    "half of the door":            (edit((5.5, 3.5), (5.6, 3.6)),     True,  [("r1", "target 1")]),
    "a wall on the target":        (edit((8.2, 3.2), (8.8, 3.8)),     True,  [("r1", "target 1")]),
    "a wall beside the way":       (edit((8.2, 1.2), (8.8, 1.8)),     True,  []),
    "a wall on a wall":            (edit((5.2, 1.2), (5.8, 1.8)),     False, []),
    "another door":                (edit((5.2, 1.2), (5.8, 1.8), Kind.FREE), True, []),
}
# fmt: on


@pytest.mark.parametrize("name", CASES)
def test_an_edit_names_the_targets_whose_last_way_it_takes(name: str) -> None:
    asked, changes, lost = CASES[name]
    world = world_of()
    before = world.bodies.floor
    assert find_cut_targets(world.tasks, world.bodies, asked, sensed=False) == (changes, lost)
    assert world.bodies.floor is before
    assert world.bodies.edits == 0


def test_homes_and_the_pool_count_and_what_was_without_a_way_before_does_not() -> None:
    world = world_of(serve=True)
    world.request("r2", Order(id="a", targets=[EAST], home=True))
    world.put_in(PoolTargets(id="p", targets=[EAST]))
    assert find_cut_targets(world.tasks, world.bodies, edit(*DOOR), sensed=False)[1] == [
        ("r1", "target 1"), ("r2", "target 1"), ("pool", "pool target p/1"),
    ]  # fmt: skip
    world.edit(edit(*DOOR))
    assert find_cut_targets(world.tasks, world.bodies, edit((8.2, 3.2), (8.8, 3.8)), sensed=False) == (True, [])
    assert find_cut_targets(world.tasks, world.bodies, edit((1.2, 1.2), (1.8, 5.8)), sensed=False) == (True, [])


def test_a_robot_away_from_home_has_no_way_back() -> None:
    world = world_of(own_targets=[[EAST], [EAST]], start={"poses": [[2.5, 2.5, 0.0], [8.5, 4.5, 0.0]]})
    world.request("r2", Order(id="a", targets=[WEST], home=True))
    assert find_cut_targets(world.tasks, world.bodies, edit(*DOOR), sensed=False)[1] == [
        ("r1", "target 1"),
        ("r2", "target 1"),
    ]


def test_an_edit_that_is_refused_is_refused_in_a_dry_run_as_well() -> None:
    world = world_of()
    with pytest.raises(ConfigError, match="r1 stands there"):
        find_cut_targets(world.tasks, world.bodies, edit((2.2, 2.2), (2.8, 2.8)), sensed=False)


def test_a_long_list_is_cut() -> None:
    many = [("r1", f"target {number}") for number in range(1, 6)]
    assert format_cut_targets(many) == "; no way leads r1 to target 1, target 2, target 3 and 2 more any more"
    assert format_cut_targets([]) == ""
