"""What the messages of the fleet are in ROS: tables, and laws about rays and poses."""

from collections.abc import Iterable, Mapping
from math import atan2, degrees, inf, isnan, pi
from typing import Any, Final, NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import UNSET, UnsetType, structs

from dashboard.fold import palette, phrases
from swarm.bridge.cdr import health
from swarm.bridge.fleet_settings import FleetSettings
from swarm.bridge.ros2 import topics
from swarm.bridge.ros2.beams import FIRST, STEP, build_beam_layout
from swarm.bridge.ros2.convert import Converter, RosMessage
from swarm.bridge.ros2.topics import RosTopic
from swarm.bridge.ros2.types import Types
from swarm.errors import PeerError
from swarm.geometry import Pose, wrap
from swarm.maps.occupancy import OccupancyMap
from swarm.maps.wire import pack, unpack
from swarm.messages import Activity, Body, Event, Liveness, Map, Message, Plan, Sense, State, Truth
from swarm.messages.world import Seen
from swarm.robot.sectors import sectors
from swarm.settings import SensorSettings, Settings
from swarm.traffic.lattice.placement import cells_of
from tests.messages.made import broadcast, clock, truth
from tests.robot.shared import FITS
from tests.shared import ROOT, scenario_of

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


class Read(NamedTuple):
    """A message as ROS reads it."""

    robot: str
    topic: RosTopic
    message: Any


def converter(*, joined: bool = False, unwanted: frozenset[RosTopic] = frozenset()) -> Converter:
    made = Converter(joined=joined, wants=lambda robot, topic: topic not in unwanted)
    made.set_namespaces(NAMES)
    return made


def read(found: Iterable[RosMessage]) -> list[Read]:
    """Return messages as ROS reads them; rosbags writes the same bytes."""
    messages = [Read(one.robot, one.topic, ROS.deserialize(one.topic.type, one.payload)) for one in found]
    assert [ROS.serialize(one.topic.type, one.message) for one in messages] == [one.payload for one in found]
    return messages


def said(
    message: Message, robot: str = "", *before: Message, settings: Settings = SETTINGS, joined: bool = False,
    kinds: Mapping[str, str] | UnsetType = UNSET,
) -> list[Read]:  # fmt: skip
    """Return what a message is in ROS, to who has been told others before."""
    made, fleet = converter(joined=joined), FleetSettings(settings, kinds)
    for one in before:
        list(made.convert_message(one, "", fleet, AT))
    return read(list(made.convert_message(message, robot, fleet, AT)))


def only(found: list[Read], topic: RosTopic) -> Any:  # noqa: ANN401
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
    (*_, one) = said(sensed(rays=rays), "r1", settings=settings)
    scan = one.message
    assert_stamped(scan, "base_scan")
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
    (*_, one) = said(sensed(rays=[1.0, 0.5, 9.0] * 3), "r1", settings=settings)
    assert [value for value in one.message.ranges if not isnan(value)] == pytest.approx([0.7] * 3)


def test_rays_that_are_not_there_are_no_measurement() -> None:
    (*_, one) = said(sensed(rays=[1.0]), "r1")
    assert [value for value in one.message.ranges if not isnan(value)] == pytest.approx([1.2])


@given(
    rays=st.integers(1, 99), side=st.floats(1, 179), wide=st.floats(0, 90), front=st.floats(0, 90)
)  # fmt: skip
def test_a_ray_is_within_a_quarter_of_a_degree_of_its_beam(rays: int, side: float, wide: float, front: float) -> None:
    sensors = SensorSettings(rays=rays, side_deg=side, side_half_width_deg=wide, front_half_width_deg=front)
    angles = [angle for sector in sectors(sensors) for angle in sector]
    fan = build_beam_layout(sensors)
    assert (fan.places.min(), fan.places.max()) == (0, fan.width - 1)
    for angle, number in zip(angles, fan.places.tolist(), strict=True):
        assert abs(wrap(angle - (FIRST + (fan.first + number) * STEP))) <= pi / 720 + 1e-9


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


FLOOR: Final = Map(packed=PACKED, scenario=SCENARIO)


def test_the_frames_that_do_not_move_hang_on_those_that_do() -> None:
    frames = {
        (one.robot, tf.header.frame_id, tf.child_frame_id)
        for one in read(list(converter().make_static_frames(AT)))
        for tf in one.message.transforms
    }
    of_fleet = {("map", f"{name}/odom") for name in ("r1", "arm_2")} | {
        (f"{name}/{frame}", f"{name}/{child}") for name in ("r1", "arm_2")
        for frame, child in (("base_footprint", "base_link"), ("base_link", "base_scan"))
    }  # fmt: skip
    own = {("base_footprint", "base_link"), ("base_link", "base_scan")}
    assert frames == {("", *pair) for pair in of_fleet} | {(robot, *pair) for robot in NAMES for pair in own}
    (one,) = converter(joined=True).make_static_frames(AT)
    assert one.robot == "", "who shows all robots at once has one tree"


def test_in_one_tree_the_frames_of_a_robot_have_its_name() -> None:
    found = said(sensed(), "arm-2", joined=True)
    assert [one.topic for one in found] == [topics.ODOMETRY, topics.SCAN]
    assert_stamped(only(found, topics.ODOMETRY), "arm_2/odom")
    assert only(found, topics.ODOMETRY).child_frame_id == "arm_2/base_footprint"
    assert_stamped(only(found, topics.SCAN), "arm_2/base_scan")


def test_what_nobody_wants_is_not_made_but_what_is_kept_is() -> None:
    made = converter(unwanted=frozenset({*topics.OF_FLEET, *topics.OF_ROBOT}))
    plan = Plan(robot="r1", run=0, tick=9, points=[(1.0, 2.0)])
    told = [FLOOR, truth(20), clock(robots=("r1",)), sensed(), plan]
    found = {
        one.topic
        for message in told
        for one in made.convert_message(message, "r1" if message in told[3:] else "", FleetSettings(SETTINGS), AT)
    }
    assert found <= {topics.MAP, topics.POSE, topics.PLAN}
    assert {topics.MAP, topics.PLAN} <= found


def test_markers_are_the_cells_held_and_the_joint_plans() -> None:
    r1 = structs.replace(body("r1", 1.0, 2.0, 0.5), held=[0, 1, 10**9], members=["r1", "arm-2"])
    arm = structs.replace(body("arm-2", 3.0, 2.0, 0.0), held=[2], members=["r1", "arm-2"])
    found = said(Truth(run=0, tick=65, time=3.25, bodies=[r1, arm]), "", FLOOR)
    held, joint, *_ = only(found, topics.MARKERS).markers
    cells = cells_of(unpack(PACKED), SETTINGS)
    assert_stamped(held, "map")
    assert (held.ns, held.type, held.action) == ("held", held.CUBE_LIST, held.ADD)
    assert [(at.x, at.y) for at in held.points] == [pytest.approx(cells.centre(cell)) for cell in (0, 1, 2)]
    first, second, third = ([round(255 * part) for part in (one.r, one.g, one.b)] for one in held.colors)
    assert (first, second, third) == ([*palette.robot(0)], [*palette.robot(0)], [*palette.robot(1)])
    assert (joint.ns, joint.type) == ("joint plans", joint.LINE_LIST)
    assert [(at.x, at.y) for at in joint.points] == [(3.0, 2.0), (1.0, 2.0)], "arm-2 comes before r1"


def test_a_list_of_no_points_takes_the_last_one_away() -> None:
    found = said(Truth(run=0, tick=65, time=3.25, bodies=[body("r1", 1.0, 2.0, 0.5)]), "", FLOOR)
    held, joint, *_ = only(found, topics.MARKERS).markers
    assert [(one.ns, one.action) for one in (held, joint)] == [("held", 2), ("joint plans", 2)]


def test_footprints_and_names_are_drawn_once_a_second_of_the_run() -> None:
    made = converter()
    list(made.convert_message(FLOOR, "", FleetSettings(SETTINGS), AT))
    bodies = [body("r1", 1.0, 2.0, 0.5), body("arm-2", 3.0, 2.0, 0.0)]
    told = Truth(run=0, tick=65, time=3.25, bodies=bodies)
    times = AT, AT + 10**9 - 1, AT + 10**9  # ns
    first, *others = (read(list(made.convert_message(told, "", FleetSettings(SETTINGS), at))) for at in times)
    kinds = [{one.ns for one in only(found, topics.MARKERS).markers} for found in (first, *others)]
    drawn_too = {"footprints", "names"}
    assert kinds == [{"held", "joint plans"} | more for more in (drawn_too, set(), drawn_too)]
    drawn = {(one.ns, one.id): one for one in only(first, topics.MARKERS).markers}
    assert drawn.keys() - {("held", 0), ("joint plans", 0)} == {
        (kind, number) for kind in ("footprints", "names") for number in (0, 1)
    }
    assert drawn["names", 1].text == "arm-2"
    foot = drawn["footprints", 0]
    assert (foot.header.frame_id, bool(foot.frame_locked), foot.scale.x) == ("r1/base_footprint", True, 0.4)


def test_the_clock_tells_batteries_and_who_is_there() -> None:
    told = structs.replace(clock(robots=("r1", "arm-2")), presence={"arm-2": Seen(Liveness.LOST, 2.0)})
    found = said(told)
    battery = next(one.message for one in found if (one.robot, one.topic) == ("r1", topics.BATTERY))
    assert (battery.percentage, bool(battery.present), battery.serial_number) == (1.0, True, "r1")
    assert isnan(battery.voltage)
    r1, arm = only(found, topics.DIAGNOSTICS).status
    assert (r1.level, r1.name, r1.hardware_id) == (0, "r1: process", "r1")
    assert (arm.level, arm.name) == (2, "arm-2: process")
    assert "lost" in arm.message


def test_events_and_states_are_diagnostics() -> None:
    event = Event(run=0, tick=9, time=0.45, robot="r1", kind="contact", text="touches wall")
    (status,) = only(said(event), topics.DIAGNOSTICS).status
    assert (status.level, status.name, status.message) == (2, "r1: events", "touches wall")
    assert {one.key: one.value for one in status.values} == {"kind": "contact", "time in the run [s]": "0.45"}
    state = State(
        robot="r1",
        run=0,
        tick=9,
        activity=Activity.BLOCKED,
        target=1,
        reached=[True, False],
        unreachable=[],
        distance=2.0,
        replans=3,
        waits=["r2"],
    )
    (status,) = only(said(state), topics.DIAGNOSTICS).status
    assert (status.level, status.name, status.message) == (1, "r1: driving", "blocked")
    assert {one.key: one.value for one in status.values} == {
        "targets reached": "1 of 2",
        "waits for": "r2",
        "replans": "3",
    }


def test_a_floor_that_robots_learn_is_what_they_have_told() -> None:
    unknown = structs.replace(SETTINGS, map=structs.replace(SETTINGS.map, known=False))
    floor = Map(packed=PACKED, scenario=structs.replace(SCENARIO, settings=unknown))
    made = converter()
    told = (
        floor, broadcast(20, "r1", walls=[0, 3]), truth(20), clock(20), truth(22), clock(22),
        broadcast(23, "r1", walls=[5]), truth(24), clock(24),
    )  # fmt: skip
    found = [read(list(made.convert_message(message, "", FleetSettings(unknown), AT))) for message in told]
    grids = [only(some, topics.MAP) for some in found if any(one.topic is topics.MAP for one in some)]
    assert [sorted({*grid.data.tolist()}) for grid in grids] == [[-1, 100]] * 2, "unknown, and what is solid"
    assert [np.flatnonzero(grid.data == 100).tolist() for grid in grids] == [[0, 3], [0, 3, 5]]
    width = unpack(PACKED).shape[1] * unpack(PACKED).resolution
    assert grids[0].info.width * grids[0].info.resolution == pytest.approx(width), "finer cells, the same floor"


def test_the_table_of_events_has_kinds_that_there_are() -> None:
    """Most kinds stand in the code as texts; the table is of no use for one that is misspelt."""
    code = " ".join(
        file.read_text(encoding="utf-8")
        for top in ("world", "swarm/traffic", "swarm/robot")
        for file in (ROOT / top).rglob("*.py")
    )
    assert {kind for kind in health.OF_EVENT if f'"{kind}"' not in code} == set()
    assert {kind for kind in phrases.TROUBLE if kind not in health.OF_EVENT} <= {"back", "body_back", "taken_up"}, (
        "what people are told"
    )
