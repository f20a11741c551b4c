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
from swarm.bridge.cdr.writing import Cdr
from swarm.bridge.ros2 import topics
from swarm.bridge.ros2.beams import Scanner
from swarm.bridge.ros2.topics import RosTopic
from swarm.bridge.ros2.types import Types
from swarm.geometry import Pose
from swarm.maps.occupancy import FREE, OBSTACLE, UNKNOWN, WALL, OccupancyMap
from swarm.maps.wire import unpack
from swarm.messages import Broadcast, Clock, Event, Map, Message, Plan, Sense, State, Truth
from swarm.settings import Settings

if TYPE_CHECKING:
    from swarm.bridge.learned import LearnedFloor

IN_MAP, IN_ODOM, BASE, LINK, LASER = "map", "odom", "base_footprint", "base_link", "base_scan"
OCCUPANCY: Final = {FREE: 0, WALL: 100, OBSTACLE: 100, UNKNOWN: -1}  # %; -1: not known (nav_msgs/OccupancyGrid)
HERE: Final = Pose(0.0, 0.0, 0.0)


class Said(NamedTuple):
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
        self._cells: markers.Lattice | None = None
        self._drawn = -SECOND  # ns, when footprints and names were drawn last
        self._scanner: Scanner | None = None
        self._learned: LearnedFloor | None = None  # None: robots are given the floor
        self.show({})

    def show(self, names: Mapping[str, str]) -> None:
        """Take other names for the robots, and no robots but those."""
        self.names = names
        self._own = {robot: f"{space.strip('/')}/" for robot, space in names.items()}

    def still(self, at: int) -> Iterator[Said]:
        """Yield the frames that do not move: say them again when robots come or go."""
        found = [(IN_MAP, self._joint(robot, IN_ODOM), HERE) for robot in self.names]
        for robot in self.names:
            found += self._on_body(self._joint(robot, ""))
            if not self._joined:
                yield Said(robot, topics.TF_STATIC, layouts.transforms(at, self._on_body("")))
        yield Said("", topics.TF_STATIC, layouts.transforms(at, found))

    def converted(self, message: Message, robot: str, settings: Settings, at: int) -> Iterator[Said]:
        """Yield all that a message of the fleet is in ROS, stamped ``at`` [ns].

        ``robot`` is the one in the message's key, "" if there is none.

        Raises:
            PeerError: the map in the message is not valid.
        """
        if robot and robot not in self.names:
            return
        match message:
            case Map(packed=packed):
                floor = unpack(packed)
                self._cells = markers.lattice_of(floor, settings)
                self._learned = None
                if settings.map.known:
                    yield Said("", topics.MAP, occupancy_grid(floor, at))
                else:
                    self._learned = _learning(message)
            case Broadcast() if self._learned is not None:
                self._learned.hear(message)
            case Truth():
                yield from self._of_truth(message, settings, at)
            case Sense():
                yield from self._of_sense(message, robot, settings, at)
            case Plan(points=points):
                yield Said(robot, topics.PLAN, path(points, at))
            case Clock():
                yield from self._of_clock(message, at)
            case State() if self._wants("", topics.DIAGNOSTICS):
                yield Said("", topics.DIAGNOSTICS, health.diagnostics(at, [health.of_state(message)]))
            case Event() if self._wants("", topics.DIAGNOSTICS):
                yield Said("", topics.DIAGNOSTICS, health.diagnostics(at, [health.of_event(message)]))

    def _of_truth(self, truth: Truth, settings: Settings, at: int) -> Iterator[Said]:
        if self._learned is not None:
            self._learned.see(truth)
        bodies = [body for body in truth.bodies if body.robot in self.names]
        poses = {body.robot: Pose(body.x, body.y, body.yaw) for body in bodies}
        if self._wants("", topics.CLOCK):
            yield Said("", topics.CLOCK, layouts.clock(at))
        if self._wants("", topics.TF):
            yield Said("", topics.TF, layouts.transforms(at, [
                (IN_MAP, self._joint(robot, BASE), pose) for robot, pose in poses.items()
            ]))  # fmt: skip
        if self._cells is not None and self._wants("", topics.MARKERS):
            numbers = {body.robot: number for number, body in enumerate(truth.bodies)}
            drawn = [markers.held(IN_MAP, bodies, numbers, self._cells), markers.joint(IN_MAP, bodies)]
            if abs(at - self._drawn) >= SECOND:  # of the run: viewers measure by its clock how long a marker lasts
                self._drawn = at
                frames = {robot: self._joint(robot, BASE) for robot in poses}
                drawn += markers.bodies_of(frames, numbers, settings.robot.radius)
            yield Said("", topics.MARKERS, markers.marker_array(at, drawn))
        for robot, pose in poses.items():
            yield Said(robot, topics.POSE, layouts.pose_with_covariance(at, IN_MAP, pose))

    def _of_sense(self, sense: Sense, robot: str, settings: Settings, at: int) -> Iterator[Said]:
        pose = Pose(sense.x, sense.y, sense.yaw)
        own = self._own[robot] if self._joined else ""
        if not self._joined and self._wants(robot, topics.TF):
            yield Said(robot, topics.TF, layouts.transforms(at, [(IN_MAP, IN_ODOM, HERE), (IN_ODOM, BASE, pose)]))
        if self._wants(robot, topics.ODOMETRY):
            frames = own + IN_ODOM, own + BASE
            yield Said(robot, topics.ODOMETRY, layouts.odometry(at, *frames, pose, sense.linear, sense.angular))
        if self._wants(robot, topics.SCAN):
            if self._scanner is None or self._scanner.settings is not settings:
                self._scanner = Scanner(settings)
            yield Said(robot, topics.SCAN, self._scanner.scan(at, own + LASER, sense.rays))

    def _of_clock(self, clock: Clock, at: int) -> Iterator[Said]:
        if self._learned is not None and (learned := self._learned.news()) is not None:
            values: NDArray[np.int8] = np.full(learned.rows * learned.columns, OCCUPANCY[UNKNOWN], np.int8)
            values[learned.cells] = OCCUPANCY[WALL]
            shape = learned.rows, learned.columns
            yield Said("", topics.MAP, grid(self._learned.origin, learned.resolution, shape, values, at))
        if self._wants("", topics.DIAGNOSTICS):
            yield Said("", topics.DIAGNOSTICS, health.diagnostics(at, health.of_clock(clock, self.names)))
        for robot in self.names:
            if self._wants(robot, topics.BATTERY):
                frame = self._joint(robot, LINK) if self._joined else LINK
                yield Said(robot, topics.BATTERY, health.battery(at, frame, robot))

    def _joint(self, robot: str, frame: str) -> str:
        """Return the name of a robot's frame in the tree of the fleet."""
        return self._own[robot] + frame

    def _on_body(self, own: str) -> list[tuple[str, str, Pose]]:
        """Return where the frames of a body are; ours have all the same origin."""
        return [(own + BASE, own + LINK, HERE), (own + LINK, own + LASER, HERE)]


def _learning(floor: Map) -> "LearnedFloor":
    """Return what is learned of a floor so far: nothing. Few fleets learn theirs, and what draws it takes 100 MB."""
    from swarm.bridge.learned import LearnedFloor

    return LearnedFloor(floor)


def occupancy_grid(floor: OccupancyMap, at: int) -> bytes:
    """Return a map as ROS's: row 0 is the lowest in both, and the origin is the outer corner of cell 0."""
    values = np.array([OCCUPANCY[kind] for kind in range(len(OCCUPANCY))], np.int8)
    return grid(floor.origin, floor.resolution, floor.shape, values[floor.cells], at)


def grid(origin: Pose, side: float, shape: tuple[int, int], values: NDArray[np.int8], at: int) -> bytes:
    """Return values [%] of rows and columns of cells, with a side in m, as a nav_msgs/msg/OccupancyGrid."""
    rows, columns = shape
    out = Cdr()
    out.head(at, IN_MAP)
    out.time(at)
    out.put("f", side)
    out.put("I", columns, rows)
    out.pose(origin)
    out.raw(values.size, 1, values.tobytes())
    return out.finish()


def path(points: Sequence[tuple[float, float]], at: int) -> bytes:
    """Return a plan's points [m] as a path in ``map``; its poses have no direction of their own, so their yaw is 0."""
    out = Cdr()
    out.head(at, IN_MAP)
    out.put("I", len(points))
    for x, y in points:
        out.head(at, IN_MAP)
        out.pose(Pose(x, y, 0.0))
    return out.finish()


def stamp(ros: Types, at: int) -> Any:  # noqa: ANN401
    """Return a time [ns] as ROS's."""
    seconds, rest = divmod(at, SECOND)
    return ros.make("builtin_interfaces/msg/Time", sec=seconds, nanosec=rest)


def header(ros: Types, frame: str, at: int) -> Any:  # noqa: ANN401
    """Return a header of a frame and a time [ns]."""
    return ros.make("std_msgs/msg/Header", stamp=stamp(ros, at), frame_id=frame)


def turned(ros: Types, yaw: float) -> Any:  # noqa: ANN401
    """Return a turn to the left [rad] as a quaternion."""
    return ros.make("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=sin(yaw / 2), w=cos(yaw / 2))


def posed(ros: Types, pose: Pose) -> Any:  # noqa: ANN401
    """Return a pose on the floor."""
    position = ros.make("geometry_msgs/msg/Point", x=pose.x, y=pose.y, z=0.0)
    return ros.make("geometry_msgs/msg/Pose", position=position, orientation=turned(ros, pose.yaw))
