"""What a message of the fleet is in ROS. Pure: time comes in as ``at``, the ns of a stamp.

Frames are those of REP-105. Below a robot's namespace they have no prefix, ``map``, ``odom`` and ``base_footprint``,
as Nav2 has them for each of many robots. In the fleet's ``/tf``, r1 is ``r1/base_footprint``.
"""

from collections.abc import Iterator, Mapping, Sequence
from math import cos, inf, nan, sin
from typing import Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm.bridge.ros2 import topics
from swarm.bridge.ros2.beams import FIRST, STEP, beams
from swarm.bridge.ros2.topics import RosTopic
from swarm.bridge.ros2.types import Types
from swarm.geometry import Pose
from swarm.maps.occupancy import FREE, OBSTACLE, UNKNOWN, WALL
from swarm.maps.wire import unpack
from swarm.messages import Map, Message, PackedMap, Plan, Sense, Truth
from swarm.settings import Settings

IN_MAP, IN_ODOM, BASE = "map", "odom", "base_footprint"
SECOND: Final = 10**9  # ns
OCCUPANCY: Final = {FREE: 0, WALL: 100, OBSTACLE: 100, UNKNOWN: -1}  # %; -1: not known (nav_msgs/OccupancyGrid)
SURE: Final = (0.0,) * 36  # the covariance of a pose or a twist that is exact


class Said(NamedTuple):
    """A message for ROS, and where it goes."""

    robot: str  # in whose namespace; "": the fleet's
    topic: RosTopic
    message: Any


def converted(
    ros: Types, message: Message, robot: str, names: Mapping[str, str], settings: Settings, at: int
) -> Iterator[Said]:
    """Yield all that a message of the fleet is in ROS, stamped ``at`` [ns].

    ``robot`` is the one in the message's key, "" if there is none; ``names`` are the namespaces of all robots that ROS
    sees.

    Raises:
        PeerError: the map in the message is not valid.
    """
    if robot and robot not in names:
        return
    match message:
        case Map(packed=packed):
            yield Said("", topics.MAP, occupancy_grid(ros, packed, at))
        case Truth(bodies=bodies):
            poses = {body.robot: Pose(body.x, body.y, body.yaw) for body in bodies if body.robot in names}
            yield Said("", topics.CLOCK, ros.make(topics.CLOCK.type, clock=stamp(ros, at)))
            yield Said("", topics.TF, ros.make(topics.TF.type, transforms=[
                transform(ros, pose, IN_MAP, f"{names[name].strip('/')}/{BASE}", at) for name, pose in poses.items()
            ]))  # fmt: skip
            for name, pose in poses.items():
                posed = ros.make(
                    topics.POSE.type, header=header(ros, IN_MAP, at), pose=with_covariance(ros, pose)
                )  # fmt: skip
                yield Said(name, topics.POSE, posed)
        case Sense():
            pose = Pose(message.x, message.y, message.yaw)
            yield Said(robot, topics.TF, ros.make(topics.TF.type, transforms=[
                transform(ros, Pose(0.0, 0.0, 0.0), IN_MAP, IN_ODOM, at), transform(ros, pose, IN_ODOM, BASE, at),
            ]))  # fmt: skip
            yield Said(robot, topics.ODOMETRY, odometry(ros, message, at))
            yield Said(robot, topics.SCAN, scan(ros, message.rays, settings, at))
        case Plan(points=points):
            yield Said(robot, topics.PLAN, path(ros, points, at))


def occupancy_grid(ros: Types, packed: PackedMap, at: int) -> Any:  # noqa: ANN401
    """Return a map as ROS's: row 0 is the lowest in both, and the origin is the outer corner of cell 0.

    Raises:
        PeerError: the map is not valid.
    """
    floor = unpack(packed)
    rows, columns = floor.shape
    values = np.array([OCCUPANCY[kind] for kind in range(len(OCCUPANCY))], np.int8)
    info = ros.make(
        "nav_msgs/msg/MapMetaData", map_load_time=stamp(ros, at), resolution=floor.resolution, width=columns,
        height=rows, origin=posed(ros, floor.origin),
    )  # fmt: skip
    return ros.make(topics.MAP.type, header=header(ros, IN_MAP, at), info=info, data=values[floor.cells].reshape(-1))


def odometry(ros: Types, sense: Sense, at: int) -> Any:  # noqa: ANN401
    """Return where a robot is in ``odom``, which does not drift, and its twist [m/s, rad/s] in its own frame."""
    twist = ros.make(
        "geometry_msgs/msg/Twist", linear=vector(ros, sense.linear, 0.0), angular=vector(ros, 0.0, 0.0, sense.angular)
    )
    return ros.make(
        topics.ODOMETRY.type, header=header(ros, IN_ODOM, at), child_frame_id=BASE,
        pose=with_covariance(ros, Pose(sense.x, sense.y, sense.yaw)),
        twist=ros.make("geometry_msgs/msg/TwistWithCovariance", twist=twist, covariance=np.array(SURE)),
    )  # fmt: skip


def scan(ros: Types, rays: Sequence[float], settings: Settings, at: int) -> Any:  # noqa: ANN401
    """Return a robot's rays as a scan: ranges [m] from its centre, +inf where a ray met nothing (REP-117).

    A scan of ROS has evenly spaced beams and our rays have gaps: a beam without a ray is NaN, which REP-117 has for
    what is no measurement. Of two rays on one beam, the shorter counts.
    """
    edge, reach = settings.robot.radius, settings.sensors.range
    numbers = beams(settings.sensors)
    first, last = min(numbers), max(numbers)
    ranges: NDArray[np.float32] = np.full(last - first + 1, nan, np.float32)
    for number, free in zip(numbers, rays, strict=False):
        ranges[number - first] = np.fmin(ranges[number - first], edge + free if free < reach else inf)
    return ros.make(
        topics.SCAN.type, header=header(ros, BASE, at), angle_min=FIRST + first * STEP, angle_max=FIRST + last * STEP,
        angle_increment=STEP, time_increment=0.0, scan_time=1 / settings.rate, range_min=edge, range_max=edge + reach,
        ranges=ranges, intensities=np.zeros(0, np.float32),
    )  # fmt: skip


def path(ros: Types, points: Sequence[tuple[float, float]], at: int) -> Any:  # noqa: ANN401
    """Return a plan's points [m] as a path in ``map``; its poses have no direction of their own, so their yaw is 0."""
    place = "geometry_msgs/msg/PoseStamped"
    poses = [
        ros.make(place, header=header(ros, IN_MAP, at), pose=posed(ros, Pose(x, y, 0.0))) for x, y in points
    ]  # fmt: skip
    return ros.make(topics.PLAN.type, header=header(ros, IN_MAP, at), poses=poses)


def stamp(ros: Types, at: int) -> Any:  # noqa: ANN401
    """Return a time [ns] as ROS's."""
    seconds, rest = divmod(at, SECOND)
    return ros.make("builtin_interfaces/msg/Time", sec=seconds, nanosec=rest)


def header(ros: Types, frame: str, at: int) -> Any:  # noqa: ANN401
    """Return a header of a frame and a time [ns]."""
    return ros.make("std_msgs/msg/Header", stamp=stamp(ros, at), frame_id=frame)


def vector(ros: Types, x: float, y: float, z: float = 0.0) -> Any:  # noqa: ANN401
    """Return a vector."""
    return ros.make("geometry_msgs/msg/Vector3", x=x, y=y, z=z)


def turned(ros: Types, yaw: float) -> Any:  # noqa: ANN401
    """Return a turn to the left [rad] as a quaternion."""
    return ros.make("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=sin(yaw / 2), w=cos(yaw / 2))


def posed(ros: Types, pose: Pose) -> Any:  # noqa: ANN401
    """Return a pose on the floor."""
    position = ros.make("geometry_msgs/msg/Point", x=pose.x, y=pose.y, z=0.0)
    return ros.make("geometry_msgs/msg/Pose", position=position, orientation=turned(ros, pose.yaw))


def with_covariance(ros: Types, pose: Pose) -> Any:  # noqa: ANN401
    """Return a pose that is exact."""
    return ros.make("geometry_msgs/msg/PoseWithCovariance", pose=posed(ros, pose), covariance=np.array(SURE))


def transform(ros: Types, pose: Pose, frame: str, child: str, at: int) -> Any:  # noqa: ANN401
    """Return where a child frame is in a frame, at a time [ns]."""
    moved = ros.make(
        "geometry_msgs/msg/Transform", translation=vector(ros, pose.x, pose.y), rotation=turned(ros, pose.yaw)
    )
    return ros.make(
        "geometry_msgs/msg/TransformStamped", header=header(ros, frame, at), child_frame_id=child, transform=moved
    )
