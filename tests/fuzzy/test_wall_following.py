"""The wall-following profile drives a robot round a room and round a block, the wall on its right all the way."""

from math import degrees, pi

import numpy as np
import pytest

from swarm.fuzzy import Controller, load_profile
from swarm.geometry import Pose, bearing, integrate
from swarm.motion.drive import DifferentialDrive

RADIUS, SPEED_SCALE, DT = 0.2, 0.4, 0.05  # m, 1, s
DRIVE = DifferentialDrive(track_width=0.4)
SECTOR = np.radians(np.arange(-30, 31, 7.5))  # rad, rays of a sector about its middle

Corners = list[tuple[float, float]]
ROOM: Corners = [(0, 0), (12, 0), (12, 8), (0, 8)]
BLOCK: Corners = [(0, 0), (3, 0), (3, 3), (0, 3)]


def ranges(pose: Pose, bearings: np.ndarray, corners: Corners) -> np.ndarray:
    """Free distance along each ray [m] to the outline through these corners; 10 where there is none."""
    start = np.array(corners)
    along = np.roll(start, -1, axis=0) - start
    ray = np.stack([np.cos(pose.yaw + bearings), np.sin(pose.yaw + bearings)], axis=1)[:, None, :]
    to = start - (pose.x, pose.y)
    cross = ray[..., 0] * along[:, 1] - ray[..., 1] * along[:, 0]
    cross = np.where(cross == 0, 1e-12, cross)
    distance = (to[:, 0] * along[:, 1] - to[:, 1] * along[:, 0]) / cross
    share = (to[:, 0] * ray[..., 1] - to[:, 1] * ray[..., 0]) / cross
    hit = np.where((distance > 0) & (share >= 0) & (share <= 1), distance, 10.0)
    return np.asarray(hit.min(axis=1))


@pytest.mark.parametrize(
    ("corners", "start"),
    [(ROOM, Pose(2, 1.5, 0)), (ROOM, Pose(6, 4, 2)), (BLOCK, Pose(2, -1.2, pi))],
    ids=["along a wall", "from the middle", "round a block"],
)
def test_a_wall_stays_on_the_right(corners: Corners, start: Pose) -> None:
    controller, pose = Controller(load_profile("wall_following")), start
    clearances, turned = [], 0.0
    for tick in range(int(100 / DT)):
        left, front, right = (
            max(0.0, float(ranges(pose, SECTOR + middle, corners).min()) - RADIUS) for middle in (pi / 3, 0.0, -pi / 3)
        )
        # The target lies far beyond the room; round the block it is never ahead, so that the robot does not leave.
        target = -degrees(bearing(pose, (100.0, 4.0))) if corners is ROOM else 120.0
        left_v, right_v = controller.wheel_speeds(left, front, right, target)
        twist = DRIVE.twist(left_v * SPEED_SCALE, right_v * SPEED_SCALE)
        pose = integrate(pose, twist, DT)
        if tick * DT > 30:  # by then it has found a wall
            clearances.append(float(ranges(pose, np.linspace(-pi, pi, 180), corners).min()) - RADIUS)
            turned += twist.angular * DT
    assert min(clearances) > 0.4
    assert max(clearances) < 1.5
    assert turned > 1.5 * pi if corners is ROOM else turned < -1.5 * pi  # within to the left, round it to the right
