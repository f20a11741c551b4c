"""What the messages of the fleet are in ROS: tables, and laws about rays and poses."""

from math import atan2, degrees, inf, isnan, pi
from typing import Any, Final

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import structs

from swarm.bridge.ros2 import topics
from swarm.bridge.ros2.beams import FIRST, STEP, beams
from swarm.bridge.ros2.convert import Said, converted
from swarm.bridge.ros2.topics import RosTopic
from swarm.bridge.ros2.types import Types
from swarm.errors import PeerError
from swarm.geometry import Pose, wrap
from swarm.maps.occupancy import OccupancyMap
from swarm.maps.wire import pack
from swarm.messages import Activity, Body, Map, Message, Plan, Sense, Truth
from swarm.robot.sectors import sectors
from swarm.settings import SensorSettings
from tests.robot.shared import FITS
from tests.shared import scenario_of

ROS = Types("jazzy")
SCENARIO, PACKED = scenario_of().to_wire()
SETTINGS = SCENARIO.settings
AT = 3_250_000_000  # ns
NAMES: Final = {"r1": "/r1", "arm-2": "/arm_2"}


def body(robot: str, x: float, y: float, yaw: float) -> Body:
    return Body(
        robot=robot, x=x, y=y, yaw=yaw, left_v=0.0, right_v=0.0, left=1.0, front=1.0, right=1.0, heading=0.0,
        steering=None, activity=Activity.DRIVE,
    )  # fmt: skip


def said(message: Message, robot: str = "") -> list[Said]:
    """Return what a message is in ROS, after it has been bytes."""
    return [
        one._replace(message=ROS.deserialize(one.topic.type, ROS.serialize(one.topic.type, one.message)))
        for one in converted(ROS, message, robot, NAMES, SETTINGS, AT)
    ]


def only(found: list[Said], topic: RosTopic) -> Any:  # noqa: ANN401
    (one,) = [one for one in found if one.topic is topic]
    return one.message


def pose_in(message: Any) -> Pose:  # noqa: ANN401
    """Return the pose that a pose or a transform of ROS has."""
    at = message.position if hasattr(message, "position") else message.translation
    turn = message.orientation if hasattr(message, "orientation") else message.rotation
    assert (at.z, turn.x, turn.y) == (0.0, 0.0, 0.0), "on the floor"
    return Pose(at.x, at.y, 2 * atan2(turn.z, turn.w))


def assert_stamped(message: Any, frame: str) -> None:  # noqa: ANN401
    stamp = message.header.stamp
    assert (message.header.frame_id, stamp.sec, stamp.nanosec) == (frame, 3, 250_000_000)


def sensed(**changed: Any) -> Sense:  # noqa: ANN401
    return structs.replace(FITS, **changed)


def test_a_map_is_an_occupancy_grid() -> None:
    cells = np.array([[0, 1, 2], [3, 0, 0]], np.uint8)
    packed = pack(OccupancyMap(cells, 0.25, Pose(-1.0, 2.0, 0.5)))
    (one,) = said(Map(packed=packed, scenario=SCENARIO))
    assert (one.robot, one.topic) == ("", topics.MAP)
    grid = one.message
    assert_stamped(grid, "map")
    assert grid.data.tolist() == [0, 100, 100, -1, 0, 0], "rows from the lowest y up, in both"
    assert (grid.info.width, grid.info.height, grid.info.resolution) == (3, 2, 0.25)
    assert pose_in(grid.info.origin) == pytest.approx((-1.0, 2.0, 0.5))


def test_a_map_that_is_broken_is_refused() -> None:
    with pytest.raises(PeerError, match="map: cells: expected zlib bytes"):
        said(Map(packed=structs.replace(PACKED, cells=b"none"), scenario=SCENARIO))


def test_the_truth_is_the_clock_the_frames_of_all_and_the_pose_of_each() -> None:
    found = said(Truth(run=0, tick=65, time=3.25, bodies=[
        body("r1", 1.0, 2.0, 0.5), body("arm-2", -3.0, 4.0, -3.0), body("unknown", 0.0, 0.0, 0.0)
    ]))  # fmt: skip
    assert [(one.robot, one.topic) for one in found] == [
        ("", topics.CLOCK), ("", topics.TF), ("r1", topics.POSE), ("arm-2", topics.POSE)
    ]  # fmt: skip
    clock = only(found, topics.CLOCK).clock
    assert (clock.sec, clock.nanosec) == (3, 250_000_000)
    r1, arm = only(found, topics.TF).transforms
    assert (r1.child_frame_id, arm.child_frame_id) == ("r1/base_footprint", "arm_2/base_footprint")
    assert_stamped(r1, "map")
    assert pose_in(r1.transform) == pytest.approx((1.0, 2.0, 0.5))
    assert pose_in(arm.transform) == pytest.approx((-3.0, 4.0, -3.0))
    posed = found[2].message
    assert_stamped(posed, "map")
    assert pose_in(posed.pose.pose) == pytest.approx((1.0, 2.0, 0.5))
    assert not posed.pose.covariance.any()


def test_a_sense_is_the_frames_odometry_and_scan_of_a_robot() -> None:
    found = said(sensed(x=1.0, y=-2.0, yaw=3.0, linear=0.7, angular=-0.3), "r1")
    assert [(one.robot, one.topic) for one in found] == [
        ("r1", topics.TF), ("r1", topics.ODOMETRY), ("r1", topics.SCAN)
    ]  # fmt: skip
    to_odom, to_base = only(found, topics.TF).transforms
    assert_stamped(to_odom, "map")
    assert_stamped(to_base, "odom")
    assert (to_odom.child_frame_id, to_base.child_frame_id) == ("odom", "base_footprint")
    assert pose_in(to_odom.transform) == (0.0, 0.0, 0.0)
    assert pose_in(to_base.transform) == pytest.approx((1.0, -2.0, 3.0))
    odometry = only(found, topics.ODOMETRY)
    assert_stamped(odometry, "odom")
    assert odometry.child_frame_id == "base_footprint"
    assert pose_in(odometry.pose.pose) == pytest.approx((1.0, -2.0, 3.0))
    twist = odometry.twist.twist
    assert (twist.linear.x, twist.linear.y, twist.linear.z) == (0.7, 0.0, 0.0)
    assert (twist.angular.x, twist.angular.y, twist.angular.z) == (0.0, 0.0, -0.3)


def test_a_scan_has_each_ray_at_its_angle_from_the_centre() -> None:
    rays = [0.1 * number for number in range(15)]  # the last two are as far as the sensors reach, or farther
    settings = structs.replace(SETTINGS, sensors=structs.replace(SETTINGS.sensors, range=1.3))
    (*_, one) = converted(ROS, sensed(rays=rays), "r1", NAMES, settings, AT)
    scan = one.message
    assert_stamped(scan, "base_footprint")
    assert (scan.range_min, scan.range_max) == pytest.approx((0.2, 1.5)), "the robot's radius is 0.2 m"
    angles = scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges))
    assert angles[-1] == pytest.approx(scan.angle_max)
    seen = {
        round(degrees(angle), 3): value for angle, value in zip(angles, scan.ranges, strict=True) if not isnan(value)
    }
    # docs/integration.md, rules: left, front, right sector, each from right to left; 60 degrees to the sides, 25 wide
    where = (
        [60 + k for k in (-25, -12.5, 0, 12.5, 25)]
        + [-25, -12.5, 0, 12.5, 25]
        + [-60 + k for k in (-25, -12.5, 0, 12.5, 25)]
    )
    expected = {angle: 0.2 + ray if ray < 1.3 else inf for angle, ray in zip(where, rays, strict=True)}
    assert seen == pytest.approx(expected)
    assert list(seen.values()).count(inf) == 2


def test_of_two_rays_on_one_beam_the_shorter_counts() -> None:
    sensors = structs.replace(SETTINGS.sensors, rays=3, side_half_width_deg=0.0, front_half_width_deg=0.0)
    settings = structs.replace(SETTINGS, sensors=sensors)
    (*_, one) = converted(ROS, sensed(rays=[1.0, 0.5, 9.0] * 3), "r1", NAMES, settings, AT)
    assert [value for value in one.message.ranges if not isnan(value)] == pytest.approx([0.7] * 3)


def test_rays_that_are_not_there_are_no_measurement() -> None:
    (*_, one) = converted(ROS, sensed(rays=[1.0]), "r1", NAMES, SETTINGS, AT)
    assert [value for value in one.message.ranges if not isnan(value)] == pytest.approx([1.2])


@given(
    rays=st.integers(1, 99), side=st.floats(1, 179), wide=st.floats(0, 90), front=st.floats(0, 90)
)  # fmt: skip
def test_a_ray_is_within_a_quarter_of_a_degree_of_its_beam(rays: int, side: float, wide: float, front: float) -> None:
    sensors = SensorSettings(rays=rays, side_deg=side, side_half_width_deg=wide, front_half_width_deg=front)
    angles = [angle for sector in sectors(sensors) for angle in sector]
    for angle, number in zip(angles, beams(sensors), strict=True):
        assert abs(wrap(angle - (FIRST + number * STEP))) <= pi / 720 + 1e-9


def test_a_plan_is_a_path() -> None:
    (one,) = said(Plan(robot="arm-2", run=0, tick=9, points=[(1.0, 2.0), (3.0, -4.0)]), "arm-2")
    assert (one.robot, one.topic) == ("arm-2", topics.PLAN)
    assert_stamped(one.message, "map")
    assert [pose_in(pose.pose) for pose in one.message.poses] == [(1.0, 2.0, 0.0), (3.0, -4.0, 0.0)]


def test_a_robot_without_a_namespace_says_nothing() -> None:
    assert said(sensed(), "unknown") == []


@given(yaw=st.floats(-pi, pi), x=st.floats(-1e6, 1e6), y=st.floats(-1e6, 1e6))
def test_a_pose_comes_back_from_ros(yaw: float, x: float, y: float) -> None:
    found = pose_in(only(said(sensed(x=x, y=y, yaw=yaw), "r1"), topics.ODOMETRY).pose.pose)
    assert (found.x, found.y) == (x, y)
    assert wrap(found.yaw - yaw) == pytest.approx(0.0, abs=1e-9)
