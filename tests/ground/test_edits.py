"""Walls that appear and disappear while robots drive; World and Robot run in one process."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from math import ceil, floor
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm.errors import ConfigError
from swarm.geometry import Pose
from swarm.maps.occupancy import FREE, WALL
from swarm.messages import Command, Edit, Event, Kind
from swarm.robot.brain import Inputs, Robot
from swarm.scenario.load import Scenario
from tests.ground.floors import LOWER, TWO_DOORS, UPPER, edit, keeps_clear, overhear, two_doors
from world.simulate import Simulation
from world.world import World

Edits = Mapping[int, tuple[Edit, ...]]
UPPER_CLOSED = TWO_DOORS.replace("#..........#", "#....#.....#", 1)


def at_ticks(edits: Edits) -> Callable[[World], None]:
    def watch(world: World) -> None:
        for one in edits.get(world.tick, ()):
            world.edit(one)

    return watch


def run(scenario: Scenario, edits: Edits, robots: int = 1, seed: int = 1, limit: float = 120.0) -> dict[str, Any]:
    return Simulation.of(scenario, robots, seed).run(limit, at_ticks(edits))


def test_a_closed_door_sends_every_robot_another_way_within_two_ticks_and_nobody_touches_it() -> None:
    scenario = two_doors()
    simulation = Simulation.of(scenario, 2, 1)
    listeners = overhear(simulation)
    report = simulation.run(120.0, at_ticks({20: (edit(Kind.WALL, UPPER),)}))
    for listener in listeners:
        tick, points = listener.first_plan_from(20)
        assert tick <= 22
        assert keeps_clear(points, scenario.settings.robot.radius, ((5.0, 6.0), (6.0, 7.0)))
    assert report["complete"], report["reason"]
    assert report["contacts"] == {"robot": 0, "wall": 0, "obstacle": 0}
    assert report["clearance_min"] > 0.0


def test_a_wall_right_before_a_driving_robot_is_not_touched() -> None:
    """As near as the world allows: any nearer it refuses, since no robot could stop."""
    simulation = Simulation.of(two_doors(), 1, 1)
    put: list[int] = []

    def watch(world: World) -> None:
        pose = world.poses()[0]
        if world.tick < 20 or put:
            return
        for ahead in range(1, 40):
            corner = (pose.x + 0.2 + ahead / 20, 6.0)
            try:
                world.edit(edit(Kind.OBSTACLE, (corner, (corner[0] + 0.1, 7.0))))
            except ConfigError:
                continue
            put.append(ahead)
            return

    report = simulation.run(120.0, watch)
    assert put
    assert report["contacts"] == {"robot": 0, "wall": 0, "obstacle": 0}
    assert report["clearance_min"] > 0.0
    assert report["complete"], report["reason"]


def test_a_wall_that_goes_opens_a_shorter_way() -> None:
    closed = two_doors(UPPER_CLOSED)
    opened = run(closed, {20: (edit(Kind.FREE, UPPER),)})
    never = run(closed, {})
    assert opened["complete"]
    assert never["complete"]
    driven = [report["per_robot"]["r1"]["path_length"] for report in (opened, never)]
    assert driven[0] < driven[1] - 1.0
    assert opened["contacts"]["wall"] == 0


def test_a_target_that_becomes_unreachable_is_told_everywhere_and_the_next_one_is_driven_to() -> None:
    simulation = Simulation.of(two_doors(), 1, 1)
    (listener,) = overhear(simulation)
    world = simulation.world
    events: list[Event] = []
    step = world.step

    def stepped(commands: Mapping[str, Command], sent: Sequence[tuple[str, int]] = ()) -> list[Event]:
        events.extend(made := step(commands, sent))
        return made

    world.step = stepped  # type: ignore[method-assign]
    report = simulation.run(120.0, at_ticks({20: (edit(Kind.WALL, UPPER), edit(Kind.OBSTACLE, LOWER))}))

    first = next(outputs for outputs in listener.said if outputs.command.unreachable)
    assert first.command.tick <= 22
    assert first.command.unreachable == [0]
    assert first.state is not None
    assert first.state.unreachable == [0]
    assert first.state.target == 1
    assert first.plan is not None
    assert first.plan.points[-1] == (2.5, 2.5)
    given_up = [event for event in events if event.kind == "unreachable"]
    assert [(event.robot, event.text) for event in given_up] == [("r1", "gives up target 1: no path leads there")]
    assert not report["complete"]
    assert report["reason"] == "not reached: r1 target 1 (no path)"
    row = report["per_robot"]["r1"]
    assert row["unreachable"] == [0]
    assert [time is not None for time in row["reached"]] == [False, True, True]
    assert row["shortest_length"] is None
    assert report["contacts"]["wall"] == report["contacts"]["obstacle"] == 0


def test_a_target_that_only_a_way_between_the_cells_leads_to_is_given_up() -> None:
    """The lower door lies where no cell of 1.2 m from the corner on does: the map has a way, holds have none."""
    scenario = two_doors(traffic={"offset": [0.0, 0.0]})
    report = run(scenario, {20: (edit(Kind.WALL, UPPER),)})
    assert report["reason"] == "not reached: r1 target 1 (no path)"
    row = report["per_robot"]["r1"]
    assert [time is not None for time in row["reached"]] == [False, True, True]
    assert row["shortest_length"] is not None
    assert report["contacts"] == {"robot": 0, "wall": 0, "obstacle": 0}


def test_a_robot_walled_in_gives_up_everything_but_where_it_stands() -> None:
    scenario = two_doors(start={"poses": [[1.5, 6.5, 0.0]]}, reach=0.2, targets=[[9.5, 6.5], [4.5, 4.5]])
    cage = (
        edit(Kind.WALL, ((1.0, 4.0), (4.0, 5.0))),
        edit(Kind.WALL, ((3.0, 5.0), (4.0, 8.0))),
    )
    simulation = Simulation.of(scenario, 1, 1)
    for wall in cage:
        simulation.world.edit(wall)
    report = simulation.run(60.0)
    assert report["per_robot"]["r1"]["unreachable"] == [0, 1]
    assert report["reason"] == "not reached: r1 target 1 (no path), target 2 (no path)"
    assert report["per_robot"]["r1"]["reached"][2] is not None


# fmt: off
REFUSED = {  # corners, part of the sentence
    "on a robot":           (((2.0, 6.0), (3.0, 7.0)), "r1 stands there"),
    "at a robot's edge":    (((3.6, 6.0), (3.9, 7.0)), None),
    "outside the map":      (((20.0, 1.0), (21.0, 2.0)), "expected a rectangle on the map"),
    "left of the map":      (((-3.0, 1.0), (-2.0, 2.0)), "expected a rectangle on the map"),
    "over everything":      (((-9.0, -9.0), (99.0, 99.0)), "r1 stands there"),
}
# fmt: on


@pytest.mark.parametrize("name", REFUSED)
def test_an_edit_is_refused_whole_or_done(name: str) -> None:
    corners, part = REFUSED[name]
    world = Simulation.of(two_doors(), 1, 1).world
    before = world.bodies.floor
    if part is None:
        world.edit(edit(Kind.WALL, corners))
        assert world.bodies.edits == 1
        return
    with pytest.raises(ConfigError, match=part):
        world.edit(edit(Kind.WALL, corners))
    assert world.bodies.floor is before
    assert world.bodies.edits == 0


def test_walls_under_a_robot_can_only_be_taken_away() -> None:
    world = Simulation.of(two_doors(), 1, 1).world
    assert not world.edit(edit(Kind.FREE, ((2.0, 6.0), (3.0, 7.0)))), "the floor is free there"
    assert world.bodies.edits == 0


def test_an_edit_that_changes_nothing_is_none() -> None:
    """No robot makes a new plan for it."""
    world = Simulation.of(two_doors(), 1, 1).world
    wall = edit(Kind.WALL, ((8.0, 1.0), (9.0, 2.0)))
    assert [world.edit(wall) for _ in range(3)] == [True, False, False]
    assert world.bodies.edits == 1
    (sense,) = world.senses(lockstep=True).values()
    assert sense.edits == [wall]


@given(st.tuples(*[st.floats(-2.0, 14.0)] * 4))
def test_an_edit_fills_exactly_the_cells_that_its_rectangle_meets(corners: tuple[float, ...]) -> None:
    scenario = two_doors()
    x0, y0, x1, y1 = corners
    floor_, low, high = scenario.map.edit_rectangle(WALL, (x0, y0), (x1, y1))
    rows, columns = scenario.map.shape
    within = {
        (row, column)
        for row in range(rows)
        for column in range(columns)
        if min(x0, x1) < column + 1 - 1e-6 and max(x0, x1) > column + 1e-6
        if min(y0, y1) < row + 1 - 1e-6 and max(y0, y1) > row + 1e-6
    }
    changed = {(row, column) for row in range(low[0], high[0]) for column in range(low[1], high[1])}
    assert within <= changed
    assert all(
        floor(min(x0, x1)) - 1e-6 <= column <= max(ceil(max(x0, x1)), floor(min(x0, x1)) + 1) + 1e-6
        for _, column in changed
    )
    assert all(floor_.cells[cell] == WALL for cell in changed)


def test_a_line_along_the_border_of_two_cells_is_a_wall_one_cell_thick() -> None:
    scenario = two_doors()
    floor_, low, high = scenario.map.edit_rectangle(WALL, (3.0, 2.0), (3.0, 5.0))
    assert (low, high) == ((2, 3), (5, 4))
    assert (floor_.cells[2:5, 3] == WALL).all()


def test_edits_at_fixed_ticks_belong_to_the_run(paper: Scenario) -> None:
    """Equal edits give equal digests, others another one."""
    block = Edit(kind=Kind.WALL, low=(6.6, 8.0), high=(7.4, 8.6))
    digests = [run(paper, edits, 3, 4, limit=15.0)["digest"] for edits in ({60: (block,)}, {60: (block,)}, {})]
    assert digests[0] == digests[1]
    assert digests[0] != digests[2]


@pytest.mark.parametrize("scenario", ["paper"])
def test_the_papers_mission_completes_while_walls_come_and_go(paper: Scenario, scenario: str) -> None:
    edits = {
        100: (Edit(kind=Kind.WALL, low=(6.5, 9.0), high=(7.0, 11.0)),),  # the passage above the first wall, narrowed
        700: (Edit(kind=Kind.FREE, low=(6.5, 9.0), high=(7.0, 9.5)),),
        900: (Edit(kind=Kind.OBSTACLE, low=(15.0, 5.0), high=(16.0, 6.0)),),
        1500: (Edit(kind=Kind.FREE, low=(15.0, 5.0), high=(16.0, 6.0)),),
    }
    report = run(paper, edits, 1, 2, limit=600.0)
    assert report["complete"], report["reason"]
    assert report["contacts"] == {"robot": 0, "wall": 0, "obstacle": 0}
    assert report["clearance_min"] > 0.0


# --- one robot's word by word account ---


def brain_of(scenario: Scenario, edits: int = 0) -> Robot:
    return Robot("r1", 0, scenario, Pose(2.5, 6.5, 0.0), edits=edits)


def test_a_robot_that_comes_late_has_the_edits_and_takes_none_twice() -> None:
    world = World(two_doors(), [Pose(2.5, 6.5, 0.0)], 1)
    world.edit(edit(Kind.WALL, UPPER))
    world.edit(edit(Kind.FREE, UPPER))
    sense = world.senses(lockstep=True)["r1"]
    assert (sense.edits_before, len(sense.edits)) == (0, 2)
    late = brain_of(replace(two_doors(), map=world.bodies.floor), edits=2)
    assert not late.has_missed_edits(sense)
    world.edit(edit(Kind.WALL, UPPER))
    outputs = late.step(Inputs(world.senses(lockstep=True)["r1"], []))
    assert outputs.plan is not None
    assert keeps_clear(outputs.plan.points, 0.2, ((5.0, 6.0), (6.0, 7.0)))


def test_a_robot_that_missed_an_edit_for_good_knows_it_and_asks_for_the_map() -> None:
    scenario = two_doors()
    world = World(scenario, [Pose(2.5, 6.5, 0.0)], 1)
    robot = brain_of(scenario)
    robot.step(Inputs(world.senses(lockstep=True)["r1"], []))
    world.edit(edit(Kind.WALL, UPPER))
    for _ in range(round(scenario.settings.rate) + 2):  # the edit is told for a second
        world.step({})
    sense = world.senses(lockstep=True)["r1"]
    assert sense.edits == []
    assert robot.has_missed_edits(sense)
    robot.take_map(replace(scenario, map=world.bodies.floor), world.bodies.edits)
    assert not robot.has_missed_edits(sense)
    outputs = robot.step(Inputs(sense, []))
    assert outputs.plan is not None
    assert keeps_clear(outputs.plan.points, 0.2, ((5.0, 6.0), (6.0, 7.0)))


def test_freeing_a_cell_leaves_the_floor_free() -> None:
    world = World(two_doors(UPPER_CLOSED), [Pose(2.5, 6.5, 0.0)], 1)
    world.edit(edit(Kind.FREE, UPPER))
    assert world.bodies.floor.at(5.5, 6.5) == FREE
