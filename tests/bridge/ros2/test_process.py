"""A real fleet, the bridge as a process, and a program with plain zenoh and rosbags on a router of its own: as ROS has."""

import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from math import dist
from pathlib import Path
from queue import SimpleQueue
from typing import Any, Final, TypeVar

import pytest
import zenoh
import zenoh.ext
from rosbags.typesys import Stores, get_typestore

from swarm.bridge.ros2.goals import GOAL_LIMIT
from swarm.bus import Endpoint
from swarm.cli import main
from swarm.messages import CLOCK, MAP, PLAN, TRUTH, Map, Phase, Plan
from tests.conftest import MakeBus
from tests.launch.actors import PATIENCE, Command, Fleet
from tests.messages.made import clock, truth
from tests.secure.shared import fleet_keys
from tests.shared import scenario_of

pytestmark = pytest.mark.processes
T = TypeVar("T")

STORE: Final = get_typestore(Stores.ROS2_JAZZY)
# fmt: off
KEYS: Final = {  # of domain 7, as rmw_zenoh writes them: topic, type, hash
    "map":          "nav_msgs::msg::dds_::OccupancyGrid_/RIHS01_8d348150c12913a31ee0ec170fbf25089e4745d17035792a1ba94d6f0bc0cfc7",
    "clock":        "rosgraph_msgs::msg::dds_::Clock_/RIHS01_692f7a66e93a3c83e71765d033b60349ba68023a8c689a79e48078bcb5c58564",
    "tf":           "tf2_msgs::msg::dds_::TFMessage_/RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087",
    "r1/odom":      "nav_msgs::msg::dds_::Odometry_/RIHS01_3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0",
    "r1/plan":      "nav_msgs::msg::dds_::Path_/RIHS01_1957a5bb3cee5da65c4e52e52b65a93df227efce4c20f8458b36e73066ca334b",
    "r1/goal_pose": "geometry_msgs::msg::dds_::PoseStamped_/RIHS01_10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8",
}
# fmt: on
OFFERED: Final = {"%map", "%clock", "%tf"}
OF_ROBOT: Final = {"odom", "scan", "plan", "amcl_pose", "tf", "goal_pose"}


class Ros:
    """A session that knows rmw_zenoh's keys and nothing of this project."""

    def __init__(self, session: zenoh.Session, domain: int) -> None:
        self._session, self._domain = session, domain
        self._declared: list[Any] = []  # a subscription ends when nobody holds it

    def key(self, topic: str) -> str:
        return f"{self._domain}/{topic}/{KEYS[topic]}"

    def hear(self, topic: str) -> "SimpleQueue[zenoh.Sample]":
        """Subscribe as rmw_zenoh does for a topic that keeps its last messages: who comes late asks for them."""
        heard: SimpleQueue[zenoh.Sample] = SimpleQueue()
        late = zenoh.ext.HistoryConfig(detect_late_publishers=True)
        self._declared.append(
            zenoh.ext.declare_advanced_subscriber(self._session, self.key(topic), heard.put, history=late)
        )
        return heard

    def tokens(self) -> "SimpleQueue[zenoh.Sample]":
        heard: SimpleQueue[zenoh.Sample] = SimpleQueue()
        key = f"@ros2_lv/{self._domain}/**"
        self._declared.append(self._session.liveliness().declare_subscriber(key, heard.put, history=True))
        return heard

    def put(self, topic: str, payload: bytes) -> None:
        attached = struct.pack("<qqB16s", 1, 1, 16, bytes(16))
        self._session.put(self.key(topic), payload, attachment=attached)


@contextmanager
def ros(router: Endpoint, domain: int) -> Iterator[Ros]:
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", f'["{router}"]')
    with zenoh.open(config) as session:
        yield Ros(session, domain)


def read(sample: zenoh.Sample) -> Any:  # noqa: ANN401
    """Return the message of a sample, by the type in its key."""
    package, kind, _, name = str(sample.key_expr).split("/")[-2].split("::")
    return STORE.deserialize_cdr(sample.payload.to_bytes(), f"{package}/{kind}/{name.removesuffix('_')}")


def until(heard: "SimpleQueue[zenoh.Sample]", fits: Callable[[zenoh.Sample], bool]) -> zenoh.Sample:
    while True:
        sample = heard.get(timeout=PATIENCE)
        if fits(sample):
            return sample


def endpoints(heard: "SimpleQueue[zenoh.Sample]", names: set[str], kind: zenoh.SampleKind) -> set[str]:
    """Wait until tokens of all these publishers and subscribers have come, or gone; return those of nodes with them."""
    nodes, missing = set(), set(names)
    while missing:
        token = until(heard, lambda sample: sample.kind == kind)
        parts = str(token.key_expr).split("/")
        if parts[5] == "NN":
            nodes.add(parts[7])
        else:
            missing.discard(parts[9])
    return nodes


def pose(frame: str, x: float, y: float) -> bytes:
    make = STORE.types
    stamp = make["builtin_interfaces/msg/Time"](sec=0, nanosec=0)
    message = make["geometry_msgs/msg/PoseStamped"](
        header=make["std_msgs/msg/Header"](stamp=stamp, frame_id=frame),
        pose=make["geometry_msgs/msg/Pose"](
            position=make["geometry_msgs/msg/Point"](x=x, y=y, z=0.0),
            orientation=make["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0),
        ),
    )
    return bytes(STORE.serialize_cdr(message, "geometry_msgs/msg/PoseStamped"))


def of_robot(name: str) -> set[str]:
    return {f"%{name}%{topic}" for topic in OF_ROBOT}


@pytest.mark.long("two routers and a fleet")
def test_ros_on_its_own_router_sees_the_fleet_and_sends_a_robot(
    small: Path, tmp_runtime: Path, endpoint: Endpoint
) -> None:
    with Fleet(small, "--serve", "--pace", "3", runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        fleet.await_all(bus)
        command = ("bridge", "ros2", "--ros", str(endpoint), "--domain", "7")
        with Command(*command, runtime=tmp_runtime) as bridge, ros(endpoint, 7) as session:
            assert bridge.await_line("fleet ") == f"fleet {fleet.name} is in ROS domain 7 (jazzy) on {endpoint}"

            tokens = session.tokens()
            nodes = endpoints(tokens, OFFERED | of_robot("r1") | of_robot("r2"), zenoh.SampleKind.PUT)
            assert nodes == {"%", "%r1", "%r2"}

            odometry = session.hear("r1/odom")
            first, second = read_with_number(odometry), read_with_number(odometry)
            assert first[1].header.frame_id == "odom"
            assert second[0] == first[0] + 1
            assert stamp(second[1]) > stamp(first[1])

            floor, clock = session.hear("map"), session.hear("clock")
            grid = read(floor.get(timeout=PATIENCE))
            assert (grid.info.width * grid.info.resolution, grid.info.height * grid.info.resolution) == (12.0, 8.0)
            assert {0, 100} == set(grid.data.tolist())
            for _ in range(5):
                clock.get(timeout=PATIENCE)
            assert floor.empty(), "it came late, and has the map once"

            transform = session.hear("tf")
            frames = {one.child_frame_id for one in read(transform.get(timeout=PATIENCE)).transforms}
            assert frames == {"r1/base_footprint", "r2/base_footprint"}

            session.put("r1/goal_pose", b"garbage")
            said = bridge.await_line("dropped 1 bad message")
            assert "/r1/goal_pose: expected CDR of geometry_msgs/msg/PoseStamped, which begins with 00 01 00 00" in said
            session.put("r1/goal_pose", pose("map", 5.5, 3.5))
            assert bridge.await_line("(5.5, 3.5)").startswith(
                "order of r1: target 1 at (5.5, 3.5): expected free floor, got a wall or obstacle"
            )
            session.put("r1/goal_pose", pose("map", 9.5, 4.0))
            assert bridge.await_line("r1: order").endswith("is number 1: 1 target")
            until(odometry, lambda sample: distance_to((9.5, 4.0), sample) < 0.4)

            assert main(["add-robots", "1"]) == 0
            assert "%r3" in endpoints(tokens, of_robot("r3"), zenoh.SampleKind.PUT)

            assert main(["stop"]) == 0
            bridge.await_line("the run is over")
            assert bridge.end() == 0
            gone = endpoints(tokens, OFFERED | of_robot("r1") | of_robot("r3"), zenoh.SampleKind.DELETE)
            assert gone <= {"%", "%r1", "%r2", "%r3"}
            fleet.end()


def read_with_number(heard: "SimpleQueue[zenoh.Sample]") -> tuple[int, Any]:
    """Return the number and the message of the next sample, whose attachment is as rmw_zenoh wants it."""
    sample = heard.get(timeout=PATIENCE)
    assert sample.attachment is not None
    number, sent, size, gid = struct.unpack("<qqB16s", sample.attachment.to_bytes())
    assert (size, sent > 0, any(gid)) == (16, True, True)
    return number, read(sample)


def stamp(message: Any) -> float:  # noqa: ANN401
    return float(message.header.stamp.sec + message.header.stamp.nanosec / 1e9)


def distance_to(goal: tuple[float, float], sample: zenoh.Sample) -> float:
    at = read(sample).pose.pose.position
    return dist((at.x, at.y), goal)


def test_on_the_fleets_router_with_the_time_of_the_machine(small: Path, tmp_runtime: Path) -> None:
    with Fleet(small, "--serve", runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        fleet.await_all(bus)
        command = ("bridge", "ros2", "--clock", "wall", "--distro", "kilted")
        with Command(*command, runtime=tmp_runtime) as bridge, ros(fleet.endpoint, 0) as session:
            bridge.await_line("is in ROS domain 0 (kilted)")
            tokens = session.tokens()
            endpoints(tokens, {"%map", "%tf", *of_robot("r1"), *of_robot("r2")}, zenoh.SampleKind.PUT)
            assert stamp(read(session.hear("r1/odom").get(timeout=PATIENCE))) > 1e9, "s since 1970"
            session.put("r1/goal_pose", bytes(GOAL_LIMIT + 1))
            assert f"expected at most {GOAL_LIMIT} bytes, got {GOAL_LIMIT + 1}" in bridge.await_line("dropped 1 bad")
            assert main(["stop"]) == 0
            assert bridge.end() == 0
            fleet.end()
            while not tokens.empty():
                assert "%clock" not in str(tokens.get().key_expr)


@pytest.mark.long("a fleet of its own, with keys")
def test_a_fleet_with_keys_is_seen_on_another_router(small: Path, tmp_runtime: Path, endpoint: Endpoint) -> None:
    fleet_keys(keys := tmp_runtime / "keys")
    with Fleet(small, "--serve", runtime=tmp_runtime, keys=keys) as fleet, fleet.bus() as bus:
        fleet.await_all(bus)
        command = ("bridge", "ros2", "--secure", str(keys), "--ros", str(endpoint), "--domain", "9")
        with Command(*command, runtime=tmp_runtime) as bridge, ros(endpoint, 9) as session:
            odometry = session.hear("r1/odom")
            assert read(odometry.get(timeout=PATIENCE)).header.frame_id == "odom"
            session.put("r1/goal_pose", pose("map", 9.5, 4.0))
            assert bridge.await_line("r1: order").endswith("is number 1: 1 target")
            assert main(["stop", "--secure", str(keys)]) == 0
            assert bridge.end() == 0
            fleet.end()


def test_robots_of_which_the_run_knows_no_more_are_withdrawn_and_namesakes_are_told(
    tmp_runtime: Path, endpoint: Endpoint, make_bus: MakeBus
) -> None:
    """The test is the world: one that was killed and started with fewer robots says so by its clock only."""
    settings, packed = scenario_of().to_wire()
    with make_bus(fleet="names") as world:
        world.announce("world", "world")
        told = clock(robots=("r1", "arm-2", "arm.2", "real"))
        path = Plan(robot="r1", run=told.run, tick=20, points=[(0.0, 0.0), (1.5, 2.0)])
        world.keep(MAP, lambda: {MAP.key: Map(packed=packed, scenario=settings)})
        world.keep(CLOCK, lambda: {CLOCK.key: told})
        world.keep(TRUTH, lambda: {TRUTH.key: truth(0)})
        world.keep(PLAN, lambda: {PLAN.key.format(robot="r1"): path})
        command = (
            "bridge",
            "ros2",
            "--connect",
            str(endpoint),
            "--fleet",
            "names",
            "--domain",
            "11",
            "--without",
            "real",
        )
        with ros(endpoint, 11) as session, Command(*command, runtime=tmp_runtime) as bridge:
            tokens = session.tokens()
            assert endpoints(tokens, of_robot("r1") | of_robot("arm_2"), zenoh.SampleKind.PUT) >= {"%r1", "%arm_2"}
            said = bridge.await_line("arm.2 is not in ROS")
            assert said == "arm.2 is not in ROS: its name there would be that of arm-2; rename one of them"

            late = session.hear("r1/plan")
            points = read(late.get(timeout=PATIENCE)).poses
            assert [(one.pose.position.x, one.pose.position.y) for one in points] == path.points

            world.send(CLOCK, clock(robots=("r1",)))
            assert endpoints(tokens, of_robot("arm_2"), zenoh.SampleKind.DELETE) <= {"%arm_2"}
            world.send(CLOCK, clock(phase=Phase.OVER, robots=("r1",)))
            assert bridge.end() == 0
            gone = endpoints(tokens, {"%map"}, zenoh.SampleKind.DELETE)
            assert "%real" not in gone, "it was left out, since ROS has it already"


@pytest.mark.long("a whole mission")
def test_the_launcher_starts_the_bridge_and_starts_it_again(small: Path, tmp_runtime: Path) -> None:
    with Fleet(small, "--serve", "--bridge", "ros2", runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        fleet.await_all(bus)
        with ros(fleet.endpoint, 0) as session:
            tokens = session.tokens()
            endpoints(tokens, OFFERED | of_robot("r1") | of_robot("r2"), zenoh.SampleKind.PUT)
            fleet.await_member("ros2").kill()
            fleet.await_line("ros2 was ended by signal 9; started again")
            endpoints(tokens, OFFERED, zenoh.SampleKind.DELETE)
            endpoints(tokens, OFFERED | of_robot("r1") | of_robot("r2"), zenoh.SampleKind.PUT)
            assert main(["stop"]) == 0
            fleet.end()
    assert "has left" not in fleet.text
    fleet.assert_nobody_is_left()
