from math import cos, pi, radians, sin

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dashboard.fold import palette
from dashboard.rerun import shapes
from swarm.geometry import Pose, from_frame
from swarm.maps.occupancy import OccupancyMap
from swarm.settings import SensorSettings

SENSORS = SensorSettings()
RADIUS = 0.2
lengths = st.floats(0.0, 1.6)


def row(x: float, y: float, yaw: float, left: float, front: float, right: float) -> shapes.Floats:
    return np.array([[[x, y, yaw, left, front, right, 0.0, 0.0, 0.0]]], dtype=np.float32)


def radii(*metres: float) -> shapes.Floats:
    return np.array([metres], dtype=np.float32)


@given(st.floats(-5, 5), st.floats(-5, 5), st.floats(-pi, pi), lengths, lengths, lengths)
def test_sector_arcs_lie_where_the_ray_ended(
    x: float, y: float, yaw: float, left: float, front: float, right: float
) -> None:
    strips = shapes.sectors(row(x, y, yaw, left, front, right), radii(RADIUS), [SENSORS])
    middles = (radians(SENSORS.side_deg), 0.0, -radians(SENSORS.side_deg))
    for strip, measured, middle in zip(strips, (left, front, right), middles, strict=True):
        arc = strip[1:-1] - (x, y)
        np.testing.assert_allclose(np.hypot(*arc.T), measured + RADIUS, atol=1e-4)
        centre = arc[len(arc) // 2] / (measured + RADIUS)
        np.testing.assert_allclose(centre, (cos(yaw + middle), sin(yaw + middle)), atol=1e-4)


def test_sectors_brighten_as_things_come_near() -> None:
    free, seen, near = shapes.sector_colours(row(0, 0, 0, 1.6, 1.2, 0.5), [SENSORS])
    assert free[3] < seen[3] < near[3]
    assert tuple(near[:3]) == palette.BLOCKED


def test_robots_with_other_sensors_and_radii_have_fans_of_their_own() -> None:
    """Two frames of three robots: one with narrow sensors, one that is wide, one like the first."""
    narrow = SensorSettings(range=1.0, side_deg=90.0, side_half_width_deg=5.0, front_half_width_deg=10.0)
    sensors, widths = [narrow, SENSORS, narrow], radii(0.2, 0.5, 0.3)
    frames = np.concatenate([np.tile(row(x, 0.0, 0.3, 1.0, 0.9, 0.4), (1, 3, 1)) for x in (0.0, 2.0)])
    strips = shapes.sectors(frames, np.tile(widths, (2, 1)), sensors).reshape(2, 3, 3, shapes.ARC + 2, 2)
    colours = shapes.sector_colours(frames, sensors).reshape(2, 3, 3, 4)
    for robot, one in enumerate(sensors):
        alone = frames[:, [robot]]
        np.testing.assert_array_equal(
            strips[:, robot].reshape(-1, shapes.ARC + 2, 2),
            shapes.sectors(alone, np.tile(widths[:, [robot]], (2, 1)), [one]),
        )
        np.testing.assert_array_equal(colours[:, robot].reshape(-1, 4), shapes.sector_colours(alone, [one]))
    assert [bool(alpha < 110) for alpha in colours[0, :, 0, 3]] == [True, False, True], "1.0 m: nothing is in range"


def test_a_robots_radius_is_its_own_or_that_with_its_load() -> None:
    frames = np.concatenate([row(0, 0, 0, 1, 1, 1), row(1, 0, 0, 1, 1, 1)], axis=1)
    frames[0, 1, 8] = 0.45
    unseen = np.full_like(frames, np.nan)
    np.testing.assert_allclose(
        shapes.radii_now(np.concatenate([frames, unseen]), [0.2, 0.35]), [[0.2, 0.45], [0.2, 0.35]]
    )


def test_circles_and_squares_are_of_one_size_or_each_of_its_own() -> None:
    spots = [(0.0, 0.0), (3.0, 1.0)]
    for make, extent in ((shapes.circle_strips, 2.0), (shapes.square_strips, 2.0)):
        for sizes, expected in ((0.5, [0.5, 0.5]), ([0.5, 0.2], [0.5, 0.2])):
            spans = np.ptp(make(spots, sizes), axis=1)
            np.testing.assert_allclose(spans, extent * np.array(expected)[:, None] * np.ones(2), rtol=1e-5)
    assert shapes.circle_strips([], 0.5).shape == (0, 33, 2)


@given(st.floats(-3, 3), st.floats(-3, 3), st.floats(-pi, pi), st.floats(0.05, 2))
def test_the_map_is_placed_by_its_origin(x: float, y: float, yaw: float, cell: float) -> None:
    origin = Pose(x, y, yaw)
    matrix = np.array(shapes.frame_matrix(yaw, cell))
    column, up = 3, 2
    placed = matrix @ (column, up, 1.0)
    np.testing.assert_allclose(placed[:2] + np.array([x, y]), from_frame(origin, column * cell, up * cell), atol=1e-9)


def test_bounds_hold_a_turned_map() -> None:
    floor = OccupancyMap(np.zeros((2, 4), dtype=np.uint8), 1.0, Pose(0.0, 0.0, pi / 2))
    assert shapes.bounds(floor, 0.5) == pytest.approx((-2.5, 0.5, -0.5, 4.5))


def test_trails_are_bounded_and_skip_what_stands() -> None:
    trails = shapes.Trails(2)
    for step in range(1000):
        trails.add(np.array([[step * 0.1, 0.0], [np.nan, np.nan]], dtype=np.float32))
    moving, unseen = trails.strips()
    assert len(moving) == shapes.TRAIL_LENGTH
    assert moving[-1][0] == pytest.approx(99.8)
    assert unseen.shape == (0, 2)
    for _ in range(10):
        trails.add(np.array([[99.9, 0.0], [1.0, 1.0]], dtype=np.float32))
    assert [len(strip) for strip in trails.strips()] == [shapes.TRAIL_LENGTH, 1]


def test_colours_are_told_apart() -> None:
    assert len({palette.robot(number) for number in range(32)}) == 32
    brightness = [sum(palette.stop(stop, 5)) for stop in range(5)]
    assert brightness == sorted(brightness)
    assert palette.stop(0, 1) == palette.VIRIDIS[0]
