"""What neither the map nor the radio explains: seen, stopped for, remembered, forgotten."""

import pytest

from swarm.geometry import Pose, distance
from swarm.maps.occupancy import Point
from swarm.messages import Sense
from swarm.planning.grid import Grid
from swarm.robot.ground import planning_grid
from swarm.robot.surprise import LINGERS, REMEMBERED, STAYS, Surprise
from swarm.scenario.load import Scenario
from tests.shared import scenario_of

ROOM = "#" * 14 + "\n" + ("#" + "." * 12 + "#\n") * 8 + "#" * 14 + "\n"
FAR = 1.6  # m, as far as the sensors see
HERE = Pose(5.0, 5.0, 0.0)
TICK = 0.05  # s


@pytest.fixture
def scenario() -> Scenario:
    return scenario_of(ROOM)


@pytest.fixture
def grid(scenario: Scenario) -> Grid:
    return planning_grid(scenario)


def sense(time: float, pose: Pose = HERE, left: float = FAR, front: float = FAR, right: float = FAR) -> Sense:
    return Sense(
        run=0, tick=round(time / TICK), time=time, lockstep=True, x=pose.x, y=pose.y, yaw=pose.yaw, linear=0.0,
        angular=0.0, left=left, front=front, right=right, bearings=[], hears=[], rays=[],
    )  # fmt: skip


def seen(watch: Surprise, grid: Grid, start: float, end: float, others: list[Point], **readings: float) -> list[bool]:
    """Show the same readings from tick to tick; give whether each one halts."""
    ticks = range(round(start / TICK), round(end / TICK))
    return [watch.watch(sense(tick * TICK, HERE, **readings), grid, others) for tick in ticks]


@pytest.mark.parametrize("sector", ["left", "front", "right"])
def test_something_unexplained_near_halts_after_a_moment(scenario: Scenario, grid: Grid, sector: str) -> None:
    halts = seen(Surprise(scenario.settings), grid, 0.0, 1.0, [], **{sector: 0.15})
    assert not halts[0], "a single reading is no thing"
    assert all(halts[3:])


def test_something_at_a_side_halts_only_when_it_is_close(scenario: Scenario, grid: Grid) -> None:
    watch = Surprise(scenario.settings)
    assert not any(seen(watch, grid, 0.0, 1.0, [], left=0.4))
    assert any(seen(watch, grid, 1.0, 2.0, [], front=0.4))


def test_a_single_wrong_reading_halts_nobody(scenario: Scenario, grid: Grid) -> None:
    watch = Surprise(scenario.settings)
    halts = []
    for tick in range(40):
        halts += seen(watch, grid, tick * TICK, (tick + 1) * TICK, [], front=0.3 if tick % 3 == 0 else FAR)
    assert not any(halts)


def test_a_wall_of_the_map_explains_itself(scenario: Scenario, grid: Grid) -> None:
    watch = Surprise(scenario.settings)
    at_the_wall = Pose(12.4, 5.0, 0.0)  # the wall begins at 13 m
    for tick in range(60):
        assert not watch.watch(sense(tick * TICK, front=0.4, pose=at_the_wall), grid, [])
    assert watch.obstacles == []


def test_a_robot_known_by_radio_explains_itself(scenario: Scenario, grid: Grid) -> None:
    watch = Surprise(scenario.settings)
    assert not any(seen(watch, grid, 0.0, 4.0, [(5.7, 5.0)], front=0.3))
    assert watch.obstacles == []
    assert any(seen(watch, grid, 4.0, 5.0, [(3.0, 5.0)], front=0.3)), "one behind explains nothing ahead"


def test_what_stays_is_an_obstacle_that_explains_itself_and_is_forgotten_in_time(
    scenario: Scenario, grid: Grid
) -> None:
    watch = Surprise(scenario.settings)
    halts = seen(watch, grid, 0.0, STAYS + 1.0, [], front=0.3)
    assert any(halts)
    assert not any(halts[-5:]), "from then on it is gone around"
    (place,) = watch.obstacles
    assert distance(place, (5.7, 5.0)) < 0.01
    seen(watch, grid, STAYS + 1.0, STAYS + REMEMBERED - 1.0, [])
    assert watch.obstacles == [place]
    seen(watch, grid, STAYS + REMEMBERED - 1.0, STAYS + REMEMBERED + 1.0, [])
    assert watch.obstacles == []


def test_what_nearly_touched_is_waited_for_when_the_sensors_have_turned_away(scenario: Scenario, grid: Grid) -> None:
    watch = Surprise(scenario.settings)
    assert any(seen(watch, grid, 0.0, 0.5, [], left=0.05))
    gone = seen(watch, grid, 0.5, 0.5 + 2 * LINGERS, [])
    assert gone[0]
    assert not gone[-1]
