"""A fleet one of whose robots is a robot of ROS: over real processes, with ROS's router apart from the fleet's."""

import signal
from importlib.util import find_spec
from pathlib import Path
from typing import Final

import pytest
import yaml
from msgspec import structs

from swarm.bus import Endpoint
from swarm.cli import main
from swarm.kinds import settings_of
from swarm.messages import EVENT, MAP, Map
from tests.bridge.body.robots import ForeignRobot, floor_of, foreign_robot
from tests.conftest import MakeBus
from tests.launch.actors import SMALL, Command, Fleet, await_event
from tests.secure.shared import fleet_keys
from tests.shared import PAPER, scenario_of

pytestmark = pytest.mark.processes
# what a busy machine delays puts the body into cells of nobody or of somebody, or lets it drive on for longer than it
# was told; a robot that is suddenly elsewhere is there too
LATE: Final = ("no hold without a claim", "takes only what is free", "room to brake", "no body outside")


@pytest.mark.long("the paper's mission in real time")
@pytest.mark.parametrize("like", [
    {},
    pytest.param(
        {"sim": "irsim", "step": 0.05, "odom_every": 1, "pose_every": 4, "scan_every": 2, "beams": 240},
        marks=pytest.mark.skipif(find_spec("irsim") is None, reason="ir-sim is not installed: pip install ir-sim"),
    ),
], ids=["own", "ir-sim"])  # fmt: skip
def test_one_of_four_robots_is_outside_and_the_papers_mission_is_complete(
    like: dict[str, object], tmp_runtime: Path, endpoint: Endpoint
) -> None:
    with (
        Fleet(PAPER, "--pace", "1", "--body", "r2", runtime=tmp_runtime, robots=4, breaks=LATE) as fleet,
        fleet.bus() as bus,
        foreign_robot(endpoint, **floor_of(fleet, bus, "r2"), **like) as robot,
    ):
        words = ("--body", "r2", "--pose", "/r2/amcl_pose", "--scan", "/r2/scan")
        with Command("bridge", "ros2", "--ros", str(endpoint), *words, runtime=tmp_runtime, breaks=LATE) as body:
            body.await_line("r2 goes on")
            assert fleet.end() == 0, fleet.text
            assert body.end() == 0
        collisions, path = robot.end()
    summary = fleet.report()
    assert summary["complete"]
    assert sum(summary["contacts"].values()) == 0
    assert collisions == 0
    assert path > 30.0


# what is done to the robot, what is said then, what the world tells, how it is undone
STANDING: Final = (
    ("off odom", "nothing usable has come on /r2/odom for 0.25 s", "body_silent", "on odom"),
    ('set odom_frame "base_link"', "nothing usable has come on /r2/odom for 0.25 s", "body_silent", 'set odom_frame "odom"'),
    ("jump 1.4 0 0", "its localisation jumped 1.", "body_jumped", "jump 0 0 0"),
    ("jump 0 1.4 0", "its localisation jumped 1.", "body_jumped", "jump 0 0 0"),
    ("jump 0 0 0.8", "its localisation turned 0.", None, "jump 0 0 0"),
    ("reset", "its odometry ", None, "on nothing"),
    ("off scan", "nothing usable has come on /r2/scan for 0.5 s", None, "on scan"),
    ("set half true", "the scan on /r2/scan has no beam in the direction of ray 5 (-25 degrees)", None, "set half false"),
    ("estop on", "an emergency stop is pressed, by /r2/estop", None, "estop off"),
)  # fmt: skip
GARBAGE: Final = (
    ("odom", "/r2/odom: expected CDR of nav_msgs/msg/Odometry"),
    ("amcl_pose", "/r2/amcl_pose: expected CDR of geometry_msgs/msg/PoseWithCovarianceStamped"),
    ("scan", "/r2/scan: expected CDR of sensor_msgs/msg/LaserScan"),
    ("estop", "/r2/estop: expected CDR of std_msgs/msg/Bool"),
)
DRIVING: Final = (
    ("set slow 0.4", "and was told"),
    ("set slow 0.0", "does not turn though it was told"),
)
WORDS: Final = ("--body", "r2", "--pose", "/r2/amcl_pose", "--scan", "/r2/scan", "--estop", "/r2/estop")


TRIES: Final = 5
AT_ONCE: Final = 30.0  # s that a line may take
LATER: Final = 100  # answers of the robot, until what it was told is heard by all


def said(body: Command, part: str) -> str:
    """Wait for a new line that holds a part; on a busy machine the robot may stand in between for want of odometry."""
    body.lines.clear()
    return body.await_line(part)


def provoke(robot: ForeignRobot, body: Command, breaks: str, why: str, undo: str) -> None:
    """Break a robot until its body says why it stands: who hears no odometry for long does not see a jump."""
    for left in reversed(range(TRIES)):
        body.lines.clear()
        robot.tell(breaks)
        try:
            body.await_line(why, within=AT_ONCE)
        except AssertionError:
            if not left:
                raise
            robot.tell(undo)
            for _ in range(LATER):
                robot.where()
        else:
            return


@pytest.mark.long("every fault of a robot, in real time")
def test_on_every_fault_the_robot_stands_says_why_and_goes_on_when_it_is_mended(
    tmp_path: Path, tmp_runtime: Path, endpoint: Endpoint
) -> None:
    (idle := tmp_path / "idle.yaml").write_text(SMALL.replace("targets: [[9.5, 2.0], [9.5, 6.0]]", "serve: true"))
    with (
        Fleet(idle, "--pace", "1", "--body", "r2", runtime=tmp_runtime, breaks=LATE) as fleet,
        fleet.bus() as bus,
        foreign_robot(endpoint, **floor_of(fleet, bus, "r2"), estop=True, turn_noise=0.0, drift=0.0) as robot,
    ):
        with Command("bridge", "ros2", "--ros", str(endpoint), *WORDS, runtime=tmp_runtime, breaks=LATE) as body:
            body.await_line("r2 goes on")
            bus.listen(EVENT)
            for breaks, why, told, undo in STANDING:
                provoke(robot, body, breaks, f"r2 stands: {why}", undo)
                if told is not None:
                    await_event(bus, lambda event, told=told: event.kind == told and event.robot == "r2")  # type: ignore[misc]
                robot.tell(undo)
                said(body, "r2 goes on")
            for topic, why in GARBAGE:
                robot.tell("garbage", topic)
                assert why in said(body, "dropped 1 bad message")

            for breaks, why in DRIVING:
                assert main(["order", "r2", "9.5,4.5", "2.5,4.0", "9.5,4.5"]) == 0
                robot.drives()
                provoke(robot, body, breaks, why, "set slow 1.0")
                robot.stands()
                robot.tell("set slow 1.0")
                said(body, "r2 goes on")
            robot.drives()
            robot.tell("estop on")
            said(body, "r2 stands: an emergency stop is pressed")
            robot.stands()
            robot.tell("estop off")
            said(body, "r2 goes on")

            robot.drives()
            body.process.send_signal(signal.SIGTERM)
            assert body.end() == 0
            robot.stands()
            await_event(bus, lambda event: event.kind == "body_silent" and event.robot == "r2")
        with Command("bridge", "ros2", "--ros", str(endpoint), *WORDS, runtime=tmp_runtime, breaks=LATE) as body:
            body.await_line("r2 goes on")
            await_event(bus, lambda event: event.kind == "body_back" and event.robot == "r2")
            robot.drives()
            robot.process.kill()
            said(body, "r2 stands: nothing usable has come on /r2/odom for 0.25 s")
            await_event(bus, lambda event: event.kind == "body_silent" and event.robot == "r2")
            assert main(["stop", "r2"]) == 0  # the others go round it, and do not wait for what its brain promises
            assert main(["order", "r1", "2.5,6.0"]) == 0
            await_event(bus, lambda event: event.kind == "reached" and event.robot == "r1")
            assert main(["stop"]) == 0
            assert body.end() == 0
        fleet.end()
    summary = fleet.report()
    assert sum(summary["contacts"].values()) == 0


@pytest.mark.long("a robot drives a square in real time")
def test_a_square_without_a_fleet_prints_what_the_robot_is_like(tmp_runtime: Path, endpoint: Endpoint) -> None:
    like = {
        "late": 0.1,
        "acceleration": 0.5,
        "turn_acceleration": 2.5,
        "turning": 0.9,
        "pose_noise": 0.0,
        "turn_noise": 0.0,
    }
    out = tmp_runtime / "burger.yaml"
    words = (
        "--pose", "/r2/amcl_pose", "--track-width", "0.4", "--square", "0.6", "--speed", "0.3", "--stamped",
        "--kind", "burger", "--radius", "0.105", "--out", str(out),
    )  # fmt: skip
    with (
        foreign_robot(endpoint, pose=[3.0, 1.0, 0.5], stamped=True, drift=0.0, **like) as robot,
        Command("bridge", "ros2", "--body", "r2", "--ros", str(endpoint), *words, runtime=tmp_runtime) as square,
    ):
        assert square.end() == 0, square.text
        robot.stands()
        collisions, path = robot.end()
    assert collisions == 0
    beyond = 0.3 * 0.1 + 0.3**2 / (2 * 0.5)  # m, of each side: driven while the stop is under way, and while braking
    assert path == pytest.approx(4 * (0.6 + beyond), abs=0.5)
    entry = yaml.safe_load(out.read_text(encoding="utf-8"))
    own = settings_of(scenario_of(**entry, robots={"burger": 1}).settings, "burger").robot
    assert own.radius == 0.105
    assert own.track_width == pytest.approx(0.4 / 0.9, rel=0.05)
    assert own.wheel_acceleration == pytest.approx(0.5, rel=0.25)
    assert own.top_speed == pytest.approx(0.3, rel=0.05)


@pytest.mark.long("a mission at the pace of a real robot")
def test_a_mission_by_odometry_alone_in_lockstep(small: Path, tmp_runtime: Path, endpoint: Endpoint) -> None:
    like: dict[str, object] = {"odom_every": 1, "mounted": [-0.1, 0.05, 3.1], "beams": 500, "zero": True}
    words = ("--scan", "/r2/scan", "--scan-at=-0.1,0.05,3.1", "--scan-zero-is-far")
    with (
        Fleet(small, "--pace", "max", "--body", "r2", runtime=tmp_runtime, breaks=LATE) as fleet,
        fleet.bus() as bus,
        foreign_robot(endpoint, **floor_of(fleet, bus, "r2"), drift=0.002, **like) as robot,
    ):
        with Command(
            "bridge", "ros2", "--body", "r2", "--ros", str(endpoint), *words, runtime=tmp_runtime, breaks=LATE
        ) as body:
            assert fleet.end() == 0, fleet.text
            assert body.end() == 0
        assert robot.end()[0] == 0
    summary = fleet.report()
    assert sum(summary["contacts"].values()) == 0
    # on a busy machine the robot falls silent now and then: the world says so, and goes on without it
    silent = "r2 has reported no body" in fleet.text
    assert silent or summary["sim_time"] <= summary["wall_time"] + 5.0, "in lockstep the clock waits for the robot"


@pytest.mark.long("a fleet of its own, with keys")
def test_in_a_fleet_with_keys_a_body_has_the_keys_of_its_robot(
    small: Path, tmp_runtime: Path, endpoint: Endpoint
) -> None:
    fleet_keys(keys := tmp_runtime / "keys")
    with (
        Fleet(small, "--pace", "1", "--body", "r2", runtime=tmp_runtime, keys=keys, breaks=LATE) as fleet,
        fleet.bus() as bus,
        foreign_robot(endpoint, **floor_of(fleet, bus, "r2")) as robot,
    ):
        words = ("--body", "r2", "--ros", str(endpoint), "--secure", str(keys))
        with Command("bridge", "ros2", *words, runtime=tmp_runtime, breaks=LATE) as body:
            bus.listen(EVENT)
            await_event(bus, lambda event: event.kind == "reached" and event.robot == "r2")
            assert main(["stop", "--secure", str(keys)]) == 0
            assert body.end() == 0
        assert robot.end()[0] == 0
        fleet.end()


def test_a_robot_that_the_fleet_does_not_have_is_refused(
    tmp_runtime: Path, endpoint: Endpoint, make_bus: MakeBus
) -> None:
    settings, packed = scenario_of().to_wire()
    floor = Map(
        packed=packed, scenario=structs.replace(settings, starts={"r1": (0.0, 0.0, 0.0), "r2": (1.0, 0.0, 0.0)})
    )
    with make_bus(fleet="names") as world:
        world.announce("world", "world")
        world.keep(MAP, lambda: {MAP.key: floor})
        command = ("bridge", "ros2", "--body", "r9", "--connect", str(endpoint), "--fleet", "names")
        with Command(*command, runtime=tmp_runtime) as body:
            assert body.end() == 2
            assert "--body r9: expected one of r1, r2, got 'r9'" in body.text


# the kinds that the map tells, and what the body of r2 says
@pytest.mark.parametrize(("kinds", "code", "said"), [
    ({"r1": "scout", "r2": "cart"}, 0, "the fleet plans with r2 as its kind says: radius 0.3 m, track width 0.5 m, at most 1.60 m/s"),
    ({"r1": "scout", "r2": "scout"}, 0, "the fleet plans with r2 as its kind says: radius 0.2 m, track width 0.4 m, at most 1.60 m/s"),
    ({"r1": "scout", "r2": "tank"}, 2, "kind: expected cart, scout, got 'tank'"),
])  # fmt: skip
def test_a_body_has_the_settings_of_its_robots_kind(
    kinds: dict[str, str], code: int, said: str, tmp_runtime: Path, endpoint: Endpoint, make_bus: MakeBus
) -> None:
    mixed = scenario_of(
        kinds={"cart": {"radius": 0.3, "track_width": 0.5}, "scout": {}}, robots={"cart": 1, "scout": 1}
    )
    settings, packed = mixed.to_wire()
    starts = dict.fromkeys(kinds, (0.0, 0.0, 0.0))
    floor = Map(packed=packed, scenario=structs.replace(settings, starts=starts, kinds=kinds))
    with make_bus(fleet="kinds") as world:
        world.announce("world", "world")
        world.keep(MAP, lambda: {MAP.key: floor})
        command = ("bridge", "ros2", "--body", "r2", "--connect", str(endpoint), "--fleet", "kinds")
        with Command(*command, runtime=tmp_runtime) as body:
            body.await_line(said)
            if code == 0:
                body.process.send_signal(signal.SIGTERM)
            assert body.end() == code
