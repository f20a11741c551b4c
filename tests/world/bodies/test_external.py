"""Bodies outside the world: where they are placed, what counts as a jump or as silence, and what survives a snapshot."""

from copy import deepcopy
from typing import Any

import pytest

from swarm.errors import ConfigError
from swarm.geometry import Pose
from swarm.messages import BodyReport, Event
from tests.shared import scenario_of
from world.bodies.external import check_external
from world.world import World

STARTS = [Pose(2.5, 2.5, 0.0), Pose(2.5, 4.5, 0.0)]
STEP = 0.05  # s


def report(tick: int, x: float, y: float = 4.5, yaw: float = 0.0, **fields: Any) -> BodyReport:  # noqa: ANN401
    return BodyReport(run=0, tick=tick, x=x, y=y, yaw=yaw, **{"left": 0.5, "right": 0.5, **fields})


def world_of(**fields: object) -> World:
    return World(scenario_of(**fields), STARTS, 1, external=["r2"])  # type: ignore[arg-type]


def step(world: World, *told: BodyReport) -> list[tuple[str, str | None]]:
    """Run a tick with a report; return kind and robot of the events about bodies."""
    world.senses(lockstep=True)
    if told:
        world.bodies.external.told = {"r2": told[0]}
    return [(one.kind, one.robot) for one in world.step({}) if about_a_body(one)]


def about_a_body(event: Event) -> bool:
    return event.kind.startswith("body") or event.kind == "contact"


def test_a_body_is_where_it_reports_and_its_robot_senses_that() -> None:
    world = world_of()
    for tick in range(20):
        assert step(world, report(tick, 2.5 + 0.025 * (tick + 1), yaw=0.01 * tick)) == []
        assert tuple(world.poses()[1]) == pytest.approx((2.5 + 0.025 * (tick + 1), 4.5, 0.01 * tick))
    assert world.poses()[0] == STARTS[0]
    sense = world.senses(lockstep=True)["r2"]
    assert sense.x == pytest.approx(3.0)
    assert sense.linear == 0.5


@pytest.mark.parametrize(
    ("x", "ticks", "told"),
    [
        (2.5 + 1.6 * STEP, 1, []),
        (2.5 + 1.6 * STEP + 0.03, 1, [("body_jumped", "r2")]),
        (2.5 + 4 * 1.6 * STEP, 4, []),
        (7.5, 1, [("body_jumped", "r2")]),
        (99.0, 1, [("body_refused", "r2")]),
    ],
)
def test_a_body_moves_no_faster_than_its_top_speed_without_being_told(x: float, ticks: int, told: list[Any]) -> None:
    world = world_of()
    for _ in range(ticks - 1):
        assert step(world) == []
    assert step(world, report(ticks - 1, x)) == told
    assert world.poses()[1].x == pytest.approx(2.5 if x > 50 else x)


def test_a_body_without_reports_stands_where_it_was_and_that_is_told_once() -> None:
    world = world_of()
    step(world, report(0, 2.55))
    assert world.bodies.wheels[1] == (0.5, 0.5)
    told = [one for _ in range(10) for one in step(world)]
    assert told == [("body_silent", "r2")]
    assert world.poses()[1].x == pytest.approx(2.55)
    assert world.bodies.wheels[1] == (0.0, 0.0)
    assert step(world, report(world.tick, 2.6)) == [("body_back", "r2")]


def test_a_touch_is_counted_for_both_and_moves_neither_the_body_nor_its_report() -> None:
    world = world_of()
    y, told = 4.5, []
    for tick in range(40):
        y -= 0.05
        told += step(world, report(tick, 2.5, y))
    assert told == [("contact", "r1"), ("contact", "r2")]
    assert world.poses()[1].y == pytest.approx(y)


def test_rays_that_a_body_measures_replace_those_that_the_world_casts() -> None:
    world = world_of()
    told = [9.0, *(0.1 * n for n in range(1, 15))]
    step(world, report(0, 2.5, rays=told))
    sense = world.senses(lockstep=True)["r2"]
    assert sense.rays == [1.6, *told[1:]]
    assert (sense.left, sense.front, sense.right) == pytest.approx((0.1, 0.5, 1.0))
    step(world, report(1, 2.5, rays=told[:4]))
    assert world.senses(lockstep=True)["r2"].rays != told, "not all of them: the world casts"


def test_a_world_from_a_snapshot_goes_on_with_the_body_where_it_was() -> None:
    one, other = world_of(), world_of()
    for tick in range(5):
        step(one, report(tick, 2.5 + 0.05 * tick))
    other.restore(deepcopy(one.save()))
    for world in (one, other):
        assert step(world, report(5, 2.75)) == []
        assert [step(world) for _ in range(8)][5] == [("body_silent", "r2")]
    assert one.poses() == other.poses()


@pytest.mark.parametrize(("saved_with", "given"), [(["r2"], []), ([], ["r2"]), (["r2"], ["r1"])])
def test_a_snapshot_of_a_run_with_other_bodies_outside_is_refused(saved_with: list[str], given: list[str]) -> None:
    one, other = (World(scenario_of(), STARTS, 1, external=names) for names in (saved_with, given))
    with pytest.raises(ConfigError, match=r"--body: expected .*as in the run that was saved"):
        other.restore(one.save())


def test_a_body_of_no_robot_is_refused() -> None:
    assert check_external(["r2"], 2) == ("r2",)
    with pytest.raises(ConfigError, match="--body r3: expected one of r1, r2, got 'r3'"):
        check_external(["r3"], 2)
