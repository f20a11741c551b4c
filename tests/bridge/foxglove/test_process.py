"""A real fleet, the bridge as a process, and a viewer that is not ours."""

import signal
from collections import Counter
from contextlib import suppress
from math import dist
from pathlib import Path
from typing import Any

import pytest

from swarm.cli import main
from swarm.messages import CLOCK, MAP, TRUTH, Map
from tests.bridge.foxglove.read import Viewer, is_closed, lines, lines_of_both, pose, viewer
from tests.conftest import MakeBus
from tests.launch.actors import Command, Fleet
from tests.messages.made import clock, truth
from tests.shared import scenario_of

pytestmark = pytest.mark.processes

BEHIND = 5.0  # s that a viewer is waited for
MISSES = 10  # messages that it may miss
OF_FLEET = {"/map", "/clock", "/tf", "/tf_static", "/markers", "/diagnostics"}


def topics(*robots: str) -> set[str]:
    of_robot = ("odom", "scan", "plan", "amcl_pose", "battery_state")
    return OF_FLEET | {f"/{robot}/{topic}" for robot in robots for topic in of_robot}


def url_of(bridge: Command) -> str:
    return bridge.await_line(" for Foxglove").split()[4]


@pytest.mark.costs("a robot drives to a goal in real time")
def test_a_viewer_sees_the_fleet_and_sends_a_robot_and_the_bag_has_all(small: Path, tmp_runtime: Path) -> None:
    record = tmp_runtime / "run.mcap"
    with Fleet(small, "--serve", "--pace", "3", runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        fleet.await_all(bus)
        with Command("bridge", "foxglove", "--port", "0", "--record", str(record), runtime=tmp_runtime) as bridge:
            with viewer(url := url_of(bridge)) as late:
                assert late.until("/r1/odom").header.frame_id == "r1/odom"
                with viewer(url, "/map", "/r1/odom", "/r1/scan", "/tf_static") as one:
                    grid = one.until("/map")
                    assert (grid.info.width * grid.info.resolution, grid.info.height * grid.info.resolution) == (12, 8)
                    assert one.channels.keys() == topics("r1", "r2")
                    assert one.until("/r1/scan").header.frame_id == "r1/base_scan"

                    one.publish("/r9/goal_pose", "json", pose(9.5, 4.0))
                    said = one.until_told("/r9/goal_pose")
                    assert said == "/r9/goal_pose: expected one of /r1/goal_pose, /r2/goal_pose"
                    one.publish("/r1/goal_pose", "json", b"garbage")
                    one.until_told("/r1/goal_pose: expected geometry_msgs/msg/PoseStamped as JSON, got 7 bytes")
                    one.publish("/r1/goal_pose", "json", pose(5.5, 3.5))
                    said = one.until_told("order of r1")
                    assert said.startswith("order of r1: target 1 at (5.5, 3.5): expected free floor, got a wall")
                    one.publish("/r1/goal_pose", "json", pose(9.5, 4.0))
                    assert one.until_told("r1: order").endswith("is number 1: 1 target")
                    bridge.await_line("is number 1: 1 target")
                    while dist((9.5, 4.0), at(one.until("/r1/odom"))) > 0.4:
                        pass

                    before = solid(grid)
                    assert main(["edit", "wall", "6,6", "7,7"]) == 0
                    while solid(one.until("/map")) <= before:
                        pass

                    assert main(["add-robots", "1"]) == 0
                    while "/r3/odom" not in one.channels:
                        one.until("/r1/odom")
            assert main(["stop"]) == 0
            bridge.await_line("the run is over")
            assert bridge.end() == 0
            fleet.end()
    found = lines_of_both(record)
    assert {line.topic for line in found} | {"/r3/plan"} == topics("r1", "r2", "r3"), "r3 has come to wait"
    count = Counter(line.topic for line in found)
    assert 2 <= count["/map"] <= 5, "not with every tick: at the beginning, when it changes and when robots come"
    assert count["/r1/odom"] > 20
    assert [line.at for line in found] == sorted(line.at for line in found)
    assert is_closed(record)


def solid(grid: Any) -> int:  # noqa: ANN401
    return sum(value == 100 for value in grid.data)


def at(odometry: object) -> tuple[float, float]:
    place = odometry.pose.pose.position  # type: ignore[attr-defined]
    return place.x, place.y


def hears(one: Viewer, topic: str) -> bool:
    """Return True once a message of a topic has come; False: none in time. A viewer that is behind misses some."""
    with suppress(TimeoutError):
        while all(name != topic for name, _ in one.next(BEHIND)):
            pass
        return True
    return False


@pytest.mark.long("a fleet with a bridge for each way to end")
@pytest.mark.parametrize(("number", "closed"), [(signal.SIGTERM, True), (signal.SIGINT, True), (signal.SIGKILL, False)])
def test_a_bag_is_readable_whatever_ended_the_bridge(
    tmp_runtime: Path, make_bus: MakeBus, endpoint: object, number: signal.Signals, closed: bool
) -> None:
    """The test is the world. A chunk is written every few seconds, so who is killed loses no more."""
    record = tmp_runtime / "run.mcap"
    settings, packed = scenario_of().to_wire()
    with make_bus(fleet="ends") as world:
        world.announce("world", "world")
        world.keep(MAP, lambda: {MAP.key: Map(packed=packed, scenario=settings)})
        world.keep(CLOCK, lambda: {CLOCK.key: clock(robots=("r1",))})
        command = ("bridge", "foxglove", "--port", "0", "--connect", str(endpoint), "--fleet", "ends")
        with (
            Command(*command, "--record", str(record), runtime=tmp_runtime) as bridge,
            viewer(url_of(bridge), "/clock", "/map") as one,
        ):
            one.until("/map")
            told, missed, chunks = 0, 0, set[int]()
            after = 100  # messages behind the last chunk that is written
            while len(chunks) < 3 or after:  # the empty one, and two with messages
                told, after = told + 1, after - (len(chunks) > 2)
                world.send(TRUTH, truth(told))
                missed += not hears(one, "/clock")
                assert missed < MISSES
                chunks.add(record.stat().st_size)
            bridge.process.send_signal(number)
            assert bridge.end() == (-signal.SIGKILL if number is signal.SIGKILL else 0)
    assert is_closed(record) == closed
    seconds = [line.at for line in (lines if closed else lines_of_both)(record) if line.topic == "/clock"]
    assert len(seconds) > told / 3
    assert closed == (len(seconds) == told)


def test_a_port_in_use_and_a_file_that_cannot_be_written_are_errors(
    tmp_runtime: Path, endpoint: object, make_bus: MakeBus
) -> None:
    with make_bus(fleet="ends") as world:
        world.announce("world", "world")
        common = ("bridge", "foxglove", "--connect", str(endpoint), "--fleet", "ends")
        port = str(endpoint).rsplit(":", 1)[1]
        with Command(*common, "--port", port, runtime=tmp_runtime) as bridge:
            assert bridge.end() == 2
            bridge.await_line(f"port {port} on 127.0.0.1: expected a free port, got Address already in use")
        with Command(*common, "--port", "0", "--record", str(tmp_runtime), runtime=tmp_runtime) as bridge:
            assert bridge.end() == 2
            bridge.await_line(f"--record {tmp_runtime}: expected to write it, got: Is a directory; name another file")
