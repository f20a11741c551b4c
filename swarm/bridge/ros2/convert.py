"""What a message of the fleet is in ROS. Pure: time comes in as ``at``, the ns of a stamp.

Frames are those of REP-105. Below a robot's namespace they have no prefix, ``map``, ``odom`` and ``base_footprint``,
as Nav2 has them for each of many robots. In the fleet's ``/tf``, r1 is ``r1/base_footprint``.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from math import cos, sin
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm.bridge.cdr import health, layouts, markers
from swarm.bridge.cdr.layouts import SECOND
from swarm.bridge.cdr.writer import CdrWriter
from swarm.bridge.fleet_settings import FleetSettings
from swarm.bridge.ros2 import topics
from swarm.bridge.ros2.beams import Scanner
from swarm.bridge.ros2.topics import RosTopic
from swarm.bridge.ros2.types import Types
from swarm.geometry import Pose
from swarm.maps.occupancy import FREE, OBSTACLE, UNKNOWN, WALL, OccupancyMap
from swarm.maps.wire import unpack
from swarm.messages import Broadcast, Clock, Event, Map, Message, Plan, Sense, State, Truth

if TYPE_CHECKING:
    from swarm.bridge.learned_floor import LearnedFloor

IN_MAP, IN_ODOM, BASE, LINK, LASER = "map", "odom", "base_footprint", "base_link", "base_scan"
OCCUPANCY: Final = {FREE: 0, WALL: 100, OBSTACLE: 100, UNKNOWN: -1}  # %; -1: not known (nav_msgs/OccupancyGrid)
HERE: Final = Pose(0.0, 0.0, 0.0)


class RosMessage(NamedTuple):
    """A message for ROS, and where it goes."""

    robot: str  # in whose namespace; "": the fleet's
    topic: RosTopic
    payload: bytes  # CDR


class Converter:
    """Turns messages of a fleet into those of ROS, for robots that ``show`` gives a namespace such as ``/r1``.

    If ``joined``, the frames of all robots are in one tree and a robot's messages are in ``r1/odom`` and the like: for
    viewers that show many robots at once, and know no namespaces. Then robots have no ``tf`` of their own. ``wants``
    says whether anybody wants a topic of a robot ("": of the fleet): what nobody wants is not made. What is kept for
    those who come late is always made.
    """

    def __init__(
        self, *, joined: bool = False, wants: Callable[[str, RosTopic], bool] = lambda robot, topic: True
    ) -> None:
        self._joined, self._wants = joined, wants
        self._cells: markers.CellLattice | None = None
        self._drawn = -SECOND  # ns, when footprints and names were drawn last
        self._scanners: dict[str, Scanner] = {}  # by robot
        self._loads: dict[str, float] = {}  # m, the radius of each robot that carries a load
        self._learned: LearnedFloor | None = None  # None: robots are given the floor
        self.set_namespaces({})

    def set_namespaces(self, names: Mapping[str, str]) -> None:
        """Take other names for the robots, and no robots but those."""
        self.names = names
        self._own = {robot: f"{space.strip('/')}/" for robot, space in names.items()}
        self._scanners = {robot: one for robot, one in self._scanners.items() if robot in names}

    def make_static_frames(self, at: int) -> Iterator[RosMessage]:
        """Yield the frames that do not move: say them again when robots come or go."""
        found = [(IN_MAP, self._fleet_frame(robot, IN_ODOM), HERE) for robot in self.names]
        for robot in self.names:
            found += self._body_frames(self._fleet_frame(robot, ""))
            if not self._joined:
                yield RosMessage(robot, topics.TF_STATIC, layouts.write_transforms(at, self._body_frames("")))
        yield RosMessage("", topics.TF_STATIC, layouts.write_transforms(at, found))

    def convert_message(self, message: Message, robot: str, settings: FleetSettings, at: int) -> Iterator[RosMessage]:
        """Yield all that a message of the fleet is in ROS, stamped ``at`` [ns].

        ``robot`` is the one in the message's key, "" if there is none. Footprints and scans are by each robot's kind.

        Raises:
            PeerError: the map in the message is not valid.
        """
        if robot and robot not in self.names:
            return
        match message:
            case Map(packed=packed):
                floor = unpack(packed)
                self._cells = markers.build_cell_lattice(floor, settings.shared)
                self._learned = None
                if settings.shared.map.known:
                    yield RosMessage("", topics.MAP, write_occupancy_grid(floor, at))
                else:
                    self._learned = _make_learned_floor(message)
            case Broadcast() if self._learned is not None:
                self._learned.add_broadcast(message)
            case Truth():
                yield from self._convert_truth(message, settings, at)
            case Sense():
                yield from self._convert_sense(message, robot, settings, at)
            case Plan(points=points):
                yield RosMessage(robot, topics.PLAN, write_path(points, at))
            case Clock():
                yield from self._convert_clock(message, at)
            case State() if self._wants("", topics.DIAGNOSTICS):
                yield RosMessage("", topics.DIAGNOSTICS, health.write_diagnostics(at, [health.driving_status(message)]))
            case Event() if self._wants("", topics.DIAGNOSTICS):
                yield RosMessage("", topics.DIAGNOSTICS, health.write_diagnostics(at, [health.event_status(message)]))

    def _convert_truth(self, truth: Truth, settings: FleetSettings, at: int) -> Iterator[RosMessage]:
        if self._learned is not None:
            self._learned.set_truth(truth)
        bodies = [body for body in truth.bodies if body.robot in self.names]
        poses = {body.robot: Pose(body.x, body.y, body.yaw) for body in bodies}
        self._loads = {body.robot: body.radius for body in bodies if body.radius}
        if self._wants("", topics.CLOCK):
            yield RosMessage("", topics.CLOCK, layouts.write_clock(at))
        if self._wants("", topics.TF):
            yield RosMessage("", topics.TF, layouts.write_transforms(at, [
                (IN_MAP, self._fleet_frame(robot, BASE), pose) for robot, pose in poses.items()
            ]))  # fmt: skip
        if self._cells is not None and self._wants("", topics.MARKERS):
            numbers = {body.robot: number for number, body in enumerate(truth.bodies)}
            drawn = [
                markers.make_held_cells_marker(IN_MAP, bodies, numbers, self._cells),
                markers.make_joint_plan_marker(IN_MAP, bodies),
            ]
            if abs(at - self._drawn) >= SECOND:  # of the run: viewers measure by its clock how long a marker lasts
                self._drawn = at
                frames = {robot: self._fleet_frame(robot, BASE) for robot in poses}
                radii = {robot: self._radius_of(robot, settings) for robot in poses}
                drawn += markers.make_robot_markers(frames, numbers, radii)
            yield RosMessage("", topics.MARKERS, markers.write_marker_array(at, drawn))
        for robot, pose in poses.items():
            yield RosMessage(robot, topics.POSE, layouts.write_pose_with_covariance(at, IN_MAP, pose))

    def _convert_sense(self, sense: Sense, robot: str, settings: FleetSettings, at: int) -> Iterator[RosMessage]:
        pose = Pose(sense.x, sense.y, sense.yaw)
        own = self._own[robot] if self._joined else ""
        if not self._joined and self._wants(robot, topics.TF):
            yield RosMessage(
                robot, topics.TF, layouts.write_transforms(at, [(IN_MAP, IN_ODOM, HERE), (IN_ODOM, BASE, pose)])
            )
        if self._wants(robot, topics.ODOMETRY):
            frames = own + IN_ODOM, own + BASE
            yield RosMessage(
                robot, topics.ODOMETRY, layouts.write_odometry(at, *frames, pose, sense.linear, sense.angular)
            )
        if self._wants(robot, topics.SCAN):
            scanner, like = self._scanners.get(robot), (settings.of_robot(robot), self._radius_of(robot, settings))
            if scanner is None or scanner.settings is not like[0] or scanner.edge != like[1]:
                scanner = self._scanners[robot] = Scanner(*like)
            yield RosMessage(robot, topics.SCAN, scanner.write_scan(at, own + LASER, sense.rays))

    def _convert_clock(self, clock: Clock, at: int) -> Iterator[RosMessage]:
        if self._learned is not None and (learned := self._learned.take_new_floor()) is not None:
            values: NDArray[np.int8] = np.full(learned.rows * learned.columns, OCCUPANCY[UNKNOWN], np.int8)
            values[learned.cells] = OCCUPANCY[WALL]
            shape = learned.rows, learned.columns
            yield RosMessage("", topics.MAP, write_grid(self._learned.origin, learned.resolution, shape, values, at))
        if self._wants("", topics.DIAGNOSTICS):
            yield RosMessage(
                "", topics.DIAGNOSTICS, health.write_diagnostics(at, health.process_statuses(clock, self.names))
            )
        for robot in self.names:
            if self._wants(robot, topics.BATTERY):
                frame = self._fleet_frame(robot, LINK) if self._joined else LINK
                yield RosMessage(robot, topics.BATTERY, health.write_battery(at, frame, robot))

    def _radius_of(self, robot: str, settings: FleetSettings) -> float:
        """Return the radius [m] of a robot, with the load that the last truth has told."""
        return self._loads.get(robot) or settings.of_robot(robot).robot.radius

    def _fleet_frame(self, robot: str, frame: str) -> str:
        """Return the name of a robot's frame in the tree of the fleet."""
        return self._own[robot] + frame

    def _body_frames(self, own: str) -> list[tuple[str, str, Pose]]:
        """Return where the frames of a body are; ours have all the same origin."""
        return [(own + BASE, own + LINK, HERE), (own + LINK, own + LASER, HERE)]


def _make_learned_floor(floor: Map) -> "LearnedFloor":
    """Return what is learned of a floor so far: nothing. Few fleets learn theirs, and what draws it takes 100 MB."""
    from swarm.bridge.learned_floor import LearnedFloor

    return LearnedFloor(floor)


def write_occupancy_grid(floor: OccupancyMap, at: int) -> bytes:
    """Return a map as ROS's: row 0 is the lowest in both, and the origin is the outer corner of cell 0."""
    values = np.array([OCCUPANCY[kind] for kind in range(len(OCCUPANCY))], np.int8)
    return write_grid(floor.origin, floor.resolution, floor.shape, values[floor.cells], at)


def write_grid(origin: Pose, side: float, shape: tuple[int, int], values: NDArray[np.int8], at: int) -> bytes:
    """Return values [%] of rows and columns of cells, with a side in m, as a nav_msgs/msg/OccupancyGrid."""
    rows, columns = shape
    out = CdrWriter()
    out.write_header(at, IN_MAP)
    out.write_stamp(at)
    out.write_numbers("f", side)
    out.write_numbers("I", columns, rows)
    out.write_pose(origin)
    out.write_sequence(values.size, 1, values.tobytes())
    return out.to_bytes()


def write_path(points: Sequence[tuple[float, float]], at: int) -> bytes:
    """Return a plan's points [m] as a path in ``map``; its poses have no direction of their own, so their yaw is 0."""
    out = CdrWriter()
    out.write_header(at, IN_MAP)
    out.write_numbers("I", len(points))
    for x, y in points:
        out.write_header(at, IN_MAP)
        out.write_pose(Pose(x, y, 0.0))
    return out.to_bytes()


def make_stamp(ros: Types, at: int) -> Any:  # noqa: ANN401
    """Return a time [ns] as ROS's."""
    seconds, rest = divmod(at, SECOND)
    return ros.make_message("builtin_interfaces/msg/Time", sec=seconds, nanosec=rest)


def make_header(ros: Types, frame: str, at: int) -> Any:  # noqa: ANN401
    """Return a header of a frame and a time [ns]."""
    return ros.make_message("std_msgs/msg/Header", stamp=make_stamp(ros, at), frame_id=frame)


def make_quaternion(ros: Types, yaw: float) -> Any:  # noqa: ANN401
    """Return a turn to the left [rad] as a quaternion."""
    return ros.make_message("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=sin(yaw / 2), w=cos(yaw / 2))


def make_pose_message(ros: Types, pose: Pose) -> Any:  # noqa: ANN401
    """Return a pose on the floor."""
    position = ros.make_message("geometry_msgs/msg/Point", x=pose.x, y=pose.y, z=0.0)
    return ros.make_message("geometry_msgs/msg/Pose", position=position, orientation=make_quaternion(ros, pose.yaw))
