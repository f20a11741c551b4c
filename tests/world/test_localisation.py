"""Robots that only nearly know where they are: what they are told, what they keep, and what the world says of it."""

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from math import hypot
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace as changed

from swarm.geometry import Pose
from swarm.messages import BodyReport, Counted
from swarm.robot.driving.pose_limiter import PoseLimiter
from swarm.robot.mission import Mission
from swarm.robot.pose_estimate import BOUND, YAW_BOUND, Estimate
from swarm.scenario.load import Scenario
from swarm.settings import JumpSettings, LocalisationSettings
from world.bodies.localisers import Localisers
from world.simulate import Simulation

HERE = Pose(3.0, 4.0, 1.0)
DT = 0.05
ERROR = LocalisationSettings(error=0.05, yaw_error_deg=2.0)
JUMPS = JumpSettings(every=4.0, distance=0.3, lasts=2.0, robots=["r1"])


def localisers(settings: LocalisationSettings, seed: int = 1) -> Localisers:
    return Localisers(settings, ("r1", "r2"), seed, DT)


def errors(one: Localisers, ticks: int, robot: int = 0) -> list[tuple[float, float]]:
    """How far off the place [m] and the yaw [rad] are that a robot is told, tick by tick."""
    found = []
    for tick in range(ticks):
        one.draw(tick)
        told = one.told_pose(robot, HERE, None)
        found.append((hypot(told.pose.x - HERE.x, told.pose.y - HERE.y), told.pose.yaw - HERE.yaw))
    return found


# ---- what a robot is told


@given(seed=st.integers(0, 2**32), lasts=st.sampled_from([0.0, 0.5, 2.0]))
def test_no_error_is_larger_than_what_robots_reckon_with(seed: int, lasts: float) -> None:
    one = localisers(changed(ERROR, lasts=lasts), seed)
    _, pose_error, yaw_error = one.told_pose(0, HERE, None)
    for away, turned in errors(one, 200):
        assert away <= BOUND * pose_error + 1e-9
        assert abs(turned) <= YAW_BOUND * yaw_error + 1e-9


def test_errors_are_as_large_as_set_and_last_as_long_as_set() -> None:
    away = [one for one, _ in errors(localisers(ERROR), 40_000)]
    assert (sum(one * one for one in away) / len(away) / 2) ** 0.5 == pytest.approx(0.05, rel=0.1)
    told = localisers(ERROR).told_pose(0, HERE, None).pose_error
    assert sum(one <= told for one in away) / len(away) == pytest.approx(0.95, abs=0.02)


def test_each_robot_has_errors_of_its_own_and_a_seed_has_the_same_ones_again() -> None:
    assert errors(localisers(ERROR), 50) == errors(localisers(ERROR), 50)
    assert errors(localisers(ERROR), 50) != errors(localisers(ERROR), 50, robot=1)
    assert errors(localisers(ERROR), 50) != errors(localisers(ERROR, seed=2), 50)


def test_exact_poses_draw_nothing() -> None:
    one = localisers(LocalisationSettings())
    before = [noise.bit_generator.state for noise in one.state.noise]
    assert errors(one, 20) == [(0.0, 0.0)] * 20
    assert [noise.bit_generator.state for noise in one.state.noise] == before


def test_a_jump_leads_as_far_as_set_and_ends_and_only_the_named_jump() -> None:
    settings = LocalisationSettings(jumps=JUMPS)
    away = [round(one, 3) for one, _ in errors(localisers(settings), 600)]
    assert set(away) == {0.0, 0.3}
    assert away.count(0.3) % 40 == 0, "each lasts for two seconds"
    assert set(errors(localisers(settings), 600, robot=1)) == {(0.0, 0.0)}


def test_a_body_outside_tells_itself_how_good_its_pose_is() -> None:
    report = BodyReport(run=0, tick=1, x=3.0, y=4.0, yaw=1.0, left=0.0, right=0.0, pose_error=0.1, yaw_error=0.2)
    assert localisers(LocalisationSettings()).told_pose(0, HERE, report) == (HERE, 0.1, 0.2)


# ---- when a stop counts


@pytest.mark.parametrize(
    ("counted", "done"),
    [
        (Counted(assignment=0, laps=0, reached=[True, False]), True),
        (Counted(assignment=0, laps=0, reached=[False, True]), False),
        (Counted(assignment=1, laps=0, reached=[True, False]), False),
        (Counted(assignment=0, laps=1, reached=[False, False]), True),
        (Counted(assignment=0, laps=0, reached=[]), False),
    ],
)
def test_a_stop_is_done_when_the_world_has_counted_it_wherever_the_robot_is(counted: Counted, done: bool) -> None:
    mission = Mission([(1.0, 1.0), (5.0, 5.0)], returns=False, patrols=False)
    mission.begin()
    for pose in (Pose(1.0, 1.0, 0.0), Pose(9.0, 9.0, 0.0)):
        assert mission.has_done_stop(pose, 0.4, counted) is done
    assert mission.has_done_stop(Pose(1.0, 1.0, 0.0), 0.4, None)


# ---- a pose that is too bad


def test_a_robot_slows_down_stands_and_goes_on_and_says_each_once() -> None:
    limiter = PoseLimiter(room=0.4, top_speed=1.6)
    limits = [limiter.check(Estimate(HERE, error)) for error in (0.1, 0.26, 0.33, 0.33, 0.3, 0.27)]
    assert [limit.stands for limit in limits] == [False, False, True, True, True, False]
    assert limits[0].fastest > 100.0
    assert 0.0 < limits[1].fastest < 1.6
    assert [kind for limit in limits for kind, _ in limit.notes] == ["pose_lost", "pose_found"]
    assert limits[2].notes[0][1] == "stands: its pose is known to 0.33 m only"


def test_a_jump_is_said_once() -> None:
    limiter = PoseLimiter(room=0.4, top_speed=1.6)
    limits = [limiter.check(Estimate(HERE, 0.2, 0.0, jumped)) for jumped in (0.0, 0.3, 0.3, 0.0)]
    assert [kind for limit in limits for kind, _ in limit.notes] == ["pose_jumped", "pose_found"]
    assert [limit.stands for limit in limits] == [False, True, True, False]


# ---- whole runs


def drive(
    scenario: Scenario, localisation: LocalisationSettings, limit: float = 50.0
) -> tuple[dict[str, Any], Counter[str]]:
    settings = changed(scenario.settings, localisation=localisation)
    simulation, kinds = Simulation.of(replace(scenario, settings=settings), 4, 3), Counter[str]()
    while not simulation.world.is_finished and simulation.world.time < limit:
        kinds.update(event.kind for event in simulation.step().events)
    return simulation.report(0.0, limit), kinds


def test_with_errors_nobody_touches_no_cell_has_two_owners_and_no_body_is_outside(paper: Scenario) -> None:
    report, kinds = drive(paper, ERROR)
    assert sum(report["contacts"].values()) == report["traffic"]["overlaps"] == report["traffic"]["outside"] == 0
    assert kinds["reached"] >= 4
    assert kinds["false_claim"] == kinds["halted"] == kinds["pose_worse"] == 0


PLANTED: dict[str, tuple[LocalisationSettings, tuple[Any, str, Callable[..., Any]] | None, str]] = {
    "a robot keeps nothing for the error": (ERROR, (Estimate, "allowance", lambda self, way: -0.03), "outside"),
    "an error larger than told": (changed(ERROR, told=0.01), None, "pose_worse"),
    "a pose that jumps": (changed(ERROR, error=0.02, jumps=JUMPS), None, "pose_jumped"),
    "a robot ticks off by its own pose": (
        ERROR,
        (Mission, "has_done_stop", lambda self, pose, reach, counted: self.goal is not None and hypot(pose.x - self.goal[0], pose.y - self.goal[1]) < reach + 0.3),
        "false_claim",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", PLANTED)
def test_the_world_speaks_of_a_planted_fault(name: str, paper: Scenario, monkeypatch: pytest.MonkeyPatch) -> None:
    localisation, fault, said = PLANTED[name]
    if fault is not None:
        monkeypatch.setattr(*fault)
    report, kinds = drive(paper, localisation)
    assert report["traffic"].get(said, 0) or kinds[said]
