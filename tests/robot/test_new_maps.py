"""A robot whose map changes: by edits, by a whole new map, by what others tell, and by a new run."""

from itertools import pairwise

import msgspec
import pytest

from swarm.geometry import distance
from swarm.messages import Broadcast, Edit, Kind, Sense
from swarm.robot.brain import Robot
from swarm.robot.ground import DEAF
from swarm.scenario.load import Scenario
from tests.robot.shared import AT, STOPS, step
from tests.robot.test_brain import said
from tests.shared import scenario_of

OPEN = "##########\n" + "#........#\n" * 4 + "##########\n"
SHUT = "##########\n" + "#.....#..#\n" * 4 + "##########\n"  # the first two stops cannot be reached
AROUND = "##########\n#........#\n" + "#.....#..#\n" * 3 + "##########\n"
OPENING = Edit(kind=Kind.FREE, low=(6.1, 1.1), high=(6.9, 4.9))
SHUTTING = Edit(kind=Kind.WALL, low=(6.1, 1.1), high=(6.9, 4.9))


def scenario(text: str, **of_map: object) -> Scenario:
    return scenario_of(text, map={"text": text, "cell": 1.0} | of_map, targets=STOPS)


def robot(text: str, **of_map: object) -> Robot:
    return Robot("r2", 1, scenario(text, **of_map), AT)


def length(points: list[tuple[float, float]]) -> float:
    return sum(distance(a, b) for a, b in pairwise(points))


@pytest.mark.parametrize("whole", [True, False], ids=["a whole map", "an edit"])
def test_a_map_that_opens_a_way_makes_stops_reachable(whole: bool) -> None:
    one = robot(SHUT)
    assert step(robot(SHUT), 0).command.unreachable == [0, 1]
    if whole:
        one.take_map(scenario(OPEN), 1)
    outputs = step(one, 0, edits_before=int(whole), edits=[] if whole else [OPENING])
    assert outputs.command.unreachable == []
    assert outputs.plan is not None
    assert length(outputs.plan.points) == pytest.approx(5.0)


@pytest.mark.parametrize("whole", [True, False], ids=["a whole map", "an edit"])
def test_a_map_that_opens_a_shorter_way_makes_a_new_path(whole: bool) -> None:
    one = robot(AROUND)
    first = step(one, 0).plan
    assert first is not None
    assert length(first.points) > 5.1
    assert step(one, 1).plan is None, "a path is told once"
    if whole:
        one.take_map(scenario(OPEN), 1)
    plan = step(one, 2, edits_before=int(whole), edits=[] if whole else [OPENING]).plan
    assert plan is not None
    assert length(plan.points) == pytest.approx(5.0)


@pytest.mark.parametrize("whole", [True, False], ids=["a whole map", "an edit"])
def test_a_map_that_shuts_the_way_makes_stops_unreachable(whole: bool) -> None:
    one = robot(OPEN)
    assert step(one, 0).command.unreachable == []
    if whole:
        one.take_map(scenario(SHUT), 1)
    command = step(one, 1, edits_before=int(whole), edits=[] if whole else [SHUTTING]).command
    assert command.unreachable == [0, 1]


def test_edits_stay_over_a_new_run_and_missed_ones_are_noticed() -> None:
    one = robot(SHUT)
    step(one, 0, edits=[OPENING])
    assert step(one, 0, run=1, edits_before=1).command.unreachable == []
    sense = Sense(
        world="local",
        run=1, tick=1, time=0.05, lockstep=True, x=AT.x, y=AT.y, yaw=0.0, linear=0.0, angular=0.0, left=1.6, front=1.6,
        right=1.6, bearings=[None] * 4, hears=[], rays=[1.6] * 15,
    )  # fmt: skip
    missed = [one.has_missed_edits(msgspec.structs.replace(sense, edits_before=before)) for before in (0, 1, 2)]
    assert missed == [False, False, True]


def tells(tick: int, rows: range) -> Broadcast:
    """Return what another robot says that has learned of a wall at x = 6.2 m, in rows of 0.1 m."""
    return msgspec.structs.replace(said(tick), walls=[100 * row + 62 for row in rows])


@pytest.mark.parametrize("shared", [True, False])
def test_walls_that_others_tell_count_on_a_shared_map_alone_and_for_one_run(shared: bool) -> None:
    one = robot(OPEN, known=False, shared=shared)
    for run, around in ((0, shared), (1, False)):
        plan = step(one, 0, *[tells(0, range(15, 45))] * (run == 0), run=run).plan
        assert plan is not None
        assert (length(plan.points) > 5.1) is around


@pytest.mark.parametrize("reached", [0, 1])
def test_before_any_stop_is_given_up_the_learned_map_is_forgotten(reached: int) -> None:
    """A robot that has forgotten its map ignores the walls of others for a while, and looks for itself."""
    one = robot(OPEN, known=False, shared=True)
    pose = AT if reached == 0 else AT._replace(x=STOPS[0][0], y=STOPS[0][1])
    assert step(one, 0, pose=pose).plan is not None
    whole = range(60)
    for tick, given_up in ((1, False), (round(DEAF / 0.05), False), (round(DEAF / 0.05) + 2, True)):
        outputs = step(one, tick, tells(tick, whole), pose=AT)
        assert (reached in outputs.command.unreachable) is given_up


def test_the_last_stop_is_the_place_of_its_start() -> None:
    assert robot(OPEN).mission.stops == (*map(tuple, STOPS), (2.5, 3.5))
