"""A scan as rays: against rays that are cast from the robot's centre in a room, and the rules of REP-117."""

from math import asin, cos, hypot, inf, nan, pi, radians, remainder, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm.bridge.body.rays import NEAR, compute_rays
from swarm.bridge.body.readings import Beams
from swarm.geometry import Pose
from swarm.robot.sectors import sectors
from swarm.settings import MapSettings, SensorSettings, Settings, StartSettings

CENTRE = Pose(0.0, 0.0, 0.0)
SETTINGS = Settings(
    name="s", map=MapSettings(text=""), start=StartSettings(), sensors=SensorSettings(range=1.6, rays=5)
)
ANGLES = [angle for sector in sectors(SETTINGS.sensors) for angle in sector]
FRONT = 7  # the ray straight ahead
EDGE = SETTINGS.robot.radius


def wall(x: float, y: float, angle: float, half: float) -> float:
    """Return the way from a point in a square room of walls ``half`` m from its middle to the wall."""
    angle += 1e-9  # no way is divided by 0
    ways = [(half - x) / cos(angle), (-half - x) / cos(angle), (half - y) / sin(angle), (-half - y) / sin(angle)]
    return min(way for way in ways if way > 0)


def scan(
    mounted: Pose = CENTRE, count: int = 720, half: float = 1.0, first: float = -pi, turn: float = 2 * pi
) -> Beams:
    """Return what a scanner measures in such a room whose middle is the robot's."""
    step = turn / count
    angles = mounted.yaw + first + step * np.arange(count)
    ranges = [wall(mounted.x, mounted.y, float(angle), half) for angle in angles]
    return Beams(first, step, 0.05, 3.5, np.array(ranges, np.float32))


def with_front(*values: float, nearest: float = 0.05, farthest: float = 3.5) -> Beams:
    """Return a scan of 1.0 m all around but for the beam ahead and those beside it."""
    ranges = np.full(720, 1.0, np.float32)
    middle = 360 - len(values) // 2
    ranges[middle : middle + len(values)] = values
    return Beams(-pi, 2 * pi / 720, nearest, farthest, ranges)


@given(
    x=st.floats(-0.15, 0.15), y=st.floats(-0.15, 0.15), yaw=st.floats(-pi, pi), count=st.integers(200, 2000),
    first=st.floats(-pi, pi), left=st.booleans(),
)  # fmt: skip
def test_rays_are_those_of_the_robots_centre_wherever_the_scanner_is_and_however_it_counts(
    x: float, y: float, yaw: float, count: int, first: float, left: bool
) -> None:
    seen = scan(mounted := Pose(x, y, yaw), count, first=first, turn=2 * pi if left else -2 * pi)
    for free, angle in zip(compute_rays(seen, mounted, SETTINGS).free, ANGLES, strict=True):
        expected = [wall(0.0, 0.0, angle + off, 1.0) - EDGE for off in np.linspace(-NEAR, NEAR, 9)]
        assert min(expected) - 0.02 <= free <= max(expected) + 0.02


def with_disc(mounted: Pose, x: float, y: float, radius: float, count: int) -> Beams:
    """Return what a scanner measures in such a room in which a disc stands."""
    seen = scan(mounted, count)
    angles = mounted.yaw + seen.first + seen.step * np.arange(count)
    along = (x - mounted.x) * np.cos(angles) + (y - mounted.y) * np.sin(angles)
    beside = (y - mounted.y) * np.cos(angles) - (x - mounted.x) * np.sin(angles)
    hit = (np.abs(beside) < radius) & (along > 0.0)
    near = along - np.sqrt(np.maximum(radius**2 - beside**2, 0.0))
    return seen._replace(ranges=np.where(hit, near, seen.ranges).astype(np.float32))


@given(
    bearing=st.floats(-pi, pi), gap=st.floats(0.02, 0.5), wide=st.floats(0.03, 0.3), count=st.integers(360, 1000),
    yaw=st.floats(-pi, pi),
)  # fmt: skip
def test_a_scanner_beside_the_centre_tells_all_rays_past_the_edge_of_a_near_thing(
    bearing: float, gap: float, wide: float, count: int, yaw: float
) -> None:
    x, y = (EDGE + gap + wide) * cos(bearing), (EDGE + gap + wide) * sin(bearing)
    mounted = Pose(-0.1, 0.05, yaw)
    found = compute_rays(with_disc(mounted, x, y, wide, count), mounted, SETTINGS)
    assert not found.lacks
    for free, angle in zip(found.free, ANGLES, strict=True):
        expected = [wall(0.0, 0.0, angle + off, 1.0) - EDGE for off in np.linspace(-NEAR, NEAR, 9)]
        assert free <= max(expected) + 0.02
        if abs(remainder(angle - bearing, 2 * pi)) < asin(wide / hypot(x, y)) / 2:
            assert free <= hypot(x, y) - EDGE + 0.02, "the ray meets the middle of the disc"


@pytest.mark.parametrize(
    ("ahead", "free"),
    [
        ((0.7,), 0.5),
        ((inf,), 1.6),  # nothing in reach
        ((3.4,), 1.6),  # no ray is longer than the sensors' range
        ((-inf,), 0.0),  # too near to be measured
        ((0.1,), 0.0),  # nearer than the robot's edge
        ((nan,), 0.8),  # no measurement: the beam beside it
        ((0.04,), 0.8),  # below range_min: no measurement
        ((3.6,), 0.8),  # above range_max: no measurement
        ((0.6, nan, nan, nan, 0.9), 0.4),
    ],
)  # fmt: skip
def test_a_beam_is_read_by_rep_117(ahead: tuple[float, ...], free: float) -> None:
    assert compute_rays(with_front(*ahead), CENTRE, SETTINGS).free[FRONT] == pytest.approx(free)


def test_zero_is_far_only_for_a_scanner_that_means_it_so() -> None:
    seen = with_front(*[0.0] * 41)
    assert compute_rays(seen, CENTRE, SETTINGS, zero_is_far=True).free[FRONT] == 1.6
    assert compute_rays(seen, CENTRE, SETTINGS).free == []


def test_a_ray_without_a_measurement_leaves_all_untold_and_says_which() -> None:
    found = compute_rays(with_front(*[nan] * 41), CENTRE, SETTINGS)
    assert found.free == []
    assert found.lacks == "has measured nothing in the direction of ray 7 (0 degrees)"


@pytest.mark.parametrize(
    ("count", "turn", "lacks"),
    [
        (360, pi, "has no beam in the direction of ray 4 (85 degrees)"),  # ahead only, and not to the left edge
        (90, 2 * pi, ""),  # four degrees apart
        (36, 2 * pi, "has no beam in the direction of ray 0 (35 degrees)"),  # ten degrees apart
        (1, 1.0, "has no beam in the direction of ray 0 (35 degrees)"),
    ],
)
def test_another_number_of_beams_is_all_right_as_long_as_there_is_one_near_each_ray(
    count: int, turn: float, lacks: str
) -> None:
    found = compute_rays(scan(count=count, turn=turn, first=-radians(110) if turn < 6 else -pi), CENTRE, SETTINGS)
    assert (found.lacks, len(found.free)) == (lacks, 0 if lacks else 15)


def test_a_scanner_that_does_not_reach_as_far_as_rays_tells_nothing() -> None:
    short = scan()._replace(farthest=1.7)
    assert compute_rays(short, CENTRE, SETTINGS) == ([], "reaches 1.7 m, and sensors.range of the scenario wants 1.8 m")
