"""The sensors' noise: zero mean, the requested deviation, and independent from ray to ray."""

from collections.abc import Iterator
from itertools import islice
from math import pi, radians
from statistics import fmean, pstdev

import numpy as np
import pytest

from swarm.geometry import Pose
from swarm.scenario.load import Scenario
from tests.shared import scenario_of, with_settings
from world.bodies.physics import Physics
from world.bodies.roster import Roster
from world.bodies.sensors import FreeDistances, Sensing

NOISE, BEARING_NOISE = 0.05, 4.0  # m, degrees
QUIET = scenario_of()
NOISY = with_settings(QUIET, sensors={"noise": NOISE, "bearing_noise_deg": BEARING_NOISE})
AT = Pose(5.0, 2.0, 0.0)  # the wall on the right is 1 m off, the target in sight
TARGETS = [(8.0, 4.0)]
MANY = 2000
RAYS = QUIET.settings.sensors.rays


def physics_of(scenario: Scenario = QUIET, pose: Pose = AT) -> Physics:
    return Physics(scenario.map, [scenario.settings.robot.radius], [pose], [1.6], 0.05)


def sensing_of(scenario: Scenario, targets: list[int]) -> Sensing:
    return Sensing(Roster(scenario, ["r1"]), targets, 7)


def rays(scenario_noise: bool, count: int) -> list[list[float]]:
    sensing = sensing_of(NOISY if scenario_noise else QUIET, [0])
    return [row.rays for row in islice(readings(sensing, physics_of()), count)]


def readings(sensing: Sensing, physics: Physics) -> Iterator[FreeDistances]:
    """Yield what the first robot measures, tick by tick."""
    while True:
        yield sensing.all_distances(physics)[0]
        sensing.draw([0])


def test_a_ray_errs_to_both_sides_alike_and_as_far_as_asked_for() -> None:
    truth = rays(False, 1)[0]
    read = rays(True, MANY)
    judged = [ray for ray, distance in enumerate(truth) if 5 * NOISE < distance < 1.6 - 5 * NOISE]
    assert len(judged) >= 3
    for ray in judged:
        errors = [row[ray] - truth[ray] for row in read]
        assert fmean(errors) == pytest.approx(0.0, abs=4 * NOISE / MANY**0.5)
        assert pstdev(errors) == pytest.approx(NOISE, rel=0.1)
        assert 0.45 < sum(error > 0.0 for error in errors) / MANY < 0.55
    a, b = judged[:2]
    together = fmean((row[a] - truth[a]) * (row[b] - truth[b]) for row in read)
    assert abs(together) < 0.1 * NOISE**2, "each ray errs by itself"


def test_a_reading_stays_between_nought_and_the_range() -> None:
    scenario = with_settings(QUIET, sensors={"noise": 1.0})
    settings, sensing = scenario.settings, sensing_of(scenario, [0])
    read = [ray for row in islice(readings(sensing, physics_of()), 200) for ray in row.rays]
    assert min(read) == 0.0
    assert max(read) == settings.sensors.range
    assert 0.2 < sum(0.0 < ray < settings.sensors.range for ray in read) / len(read) < 0.8


def test_a_sector_reads_the_nearest_of_its_own_rays() -> None:
    for yaw in (0.0, 0.5, 1.0, 2.0, -1.2):
        physics = physics_of(pose=Pose(1.7, 1.6, yaw))  # in a corner
        left, front, right, every = sensing_of(QUIET, [0]).all_distances(physics)[0]
        assert len(every) == 3 * RAYS
        assert (left, front, right) == (min(every[:RAYS]), min(every[RAYS : 2 * RAYS]), min(every[2 * RAYS :]))


def test_a_bearing_errs_to_both_sides_alike_and_as_far_as_asked_for() -> None:
    physics = physics_of()
    (truth,) = sensing_of(QUIET, [1]).bearings(physics, 0, AT, np.array(TARGETS))
    assert truth is not None
    assert truth == pytest.approx(0.588, abs=1e-3)  # atan(2 / 3)
    sensing, errors = sensing_of(NOISY, [1]), list[float]()
    for _ in range(MANY):
        errors += [seen - truth for seen in sensing.bearings(physics, 0, AT, np.array(TARGETS)) if seen is not None]
        sensing.draw([1])
    noise = radians(BEARING_NOISE)
    assert len(errors) == MANY
    assert fmean(errors) == pytest.approx(0.0, abs=4 * noise / MANY**0.5)
    assert pstdev(errors) == pytest.approx(noise, rel=0.1)


def test_whether_a_target_is_in_sight_changes_nobodys_luck() -> None:
    """The same number of draws each tick: a wall between does not shift the noise of what is read after."""
    walled = scenario_of("##########\n#........#\n#.####.###\n#........#\n#........#\n##########\n")
    here, there = Pose(5.0, 1.6, 0.0), np.array([(4.0, 4.5), (8.0, 1.6)])
    drawn = [
        sensing_of(NOISY, [2]).bearings(physics_of(scenario, here), 0, here, there) for scenario in (QUIET, walled)
    ]
    assert drawn[0][0] is not None
    assert drawn[1][0] is None
    assert drawn[0][1] == drawn[1][1]


def test_who_stands_sees_a_target_until_a_wall_is_put_up_before_it() -> None:
    """Neither the pose nor the targets change, only the floor; then only the targets, then only the pose."""
    physics, sensing = physics_of(), sensing_of(QUIET, [0])
    targets = np.array([(8.0, 2.0)])
    assert [sensing.bearings(physics, 0, AT, targets) for _ in range(2)] == [[pytest.approx(0.0)]] * 2
    physics.set_floor(scenario_of("##########\n#........#\n#........#\n#.....#..#\n#.....#..#\n##########\n").map)
    assert sensing.bearings(physics, 0, AT, targets) == [None]
    assert sensing.bearings(physics, 0, AT, np.array([(5.0, 4.0)])) == [pytest.approx(pi / 2)]
    assert sensing.bearings(physics, 0, Pose(7.5, 4.0, 0.0), targets) == [pytest.approx(-1.326, abs=1e-3)]


def test_readings_are_the_same_until_the_next_draw_and_more_targets_have_their_own_noise() -> None:
    """A robot that is given more targets after a draw has the bearings that it would have had with them before."""
    physics, targets = physics_of(), np.array([(8.0, 4.0), (8.0, 2.0), (5.0, 4.0)])
    few, many = (sensing_of(NOISY, [count]) for count in (1, 3))
    first = few.bearings(physics, 0, AT, targets[:1])
    few.draw_bearings(0, 3)
    assert few.all_distances(physics) == few.all_distances(physics) == many.all_distances(physics)
    assert few.bearings(physics, 0, AT, targets) == many.bearings(physics, 0, AT, targets)
    assert many.bearings(physics, 0, AT, targets)[:1] == first
    many.draw([3])
    assert many.bearings(physics, 0, AT, targets)[:1] != first
