"""Programs of others, as they are, in an environment of their own: what they see of a fleet."""

import os
import subprocess
import venv
from pathlib import Path
from typing import Final

import pytest

from swarm.bus import Endpoint
from tests.bridge.ros2.foreign import Client, client_session, router_of_ros
from tests.launch.actors import Command, Fleet

pytestmark = pytest.mark.processes
INSTALLS: Final = 300.0  # s
NODE_SERVICES: Final = {
    "describe_parameters": "rcl_interfaces/srv/DescribeParameters",
    "get_parameter_types": "rcl_interfaces/srv/GetParameterTypes",
    "get_parameters": "rcl_interfaces/srv/GetParameters",
    "list_parameters": "rcl_interfaces/srv/ListParameters",
    "set_parameters": "rcl_interfaces/srv/SetParameters",
    "set_parameters_atomically": "rcl_interfaces/srv/SetParametersAtomically",
}
ACTIONS: Final = {"navigate_to_pose": "NavigateToPose", "navigate_through_poses": "NavigateThroughPoses"}
# a peer of another version: the map that is kept, once, and odometry as it comes
PEER: Final = """
import os, sys, threading, zenoh, zenoh.ext
config = zenoh.Config()
config.insert_json5("mode", '"peer"')
config.insert_json5("connect/endpoints", f'["{sys.argv[1]}"]')
config.insert_json5("scouting/multicast/enabled", "false")
session = zenoh.open(config)
late = zenoh.ext.HistoryConfig(detect_late_publishers=True)
maps, odometry, tokens, there = [], [], [], threading.Event()
def into(found):
    def take(one):
        found.append(one)
        if maps and len(odometry) >= 40 and len(tokens) >= 40:
            there.set()
    return take
held = [
    zenoh.ext.declare_advanced_subscriber(session, "0/map/**", into(maps), history=late),
    session.declare_subscriber("0/r1/odom/**", into(odometry)),
    session.liveliness().declare_subscriber("@ros2_lv/0/**", into(tokens), history=True),
]
there.wait(60)
print(len(maps), len(odometry) >= 40, len(tokens) >= 40, {len(one.attachment) for one in maps + odometry}, flush=True)
os._exit(0)  # some versions hang when a session with callbacks is closed
"""


def environment(folder: Path, *packages: str) -> Path:
    """Make an environment with packages; return its programs' folder, or skip the test without network."""
    venv.create(folder, with_pip=True)
    programs = folder / "bin"
    command: list[str | Path] = [programs / "pip", "install", "--quiet", "--disable-pip-version-check", *packages]
    done = subprocess.run(command, capture_output=True, text=True, timeout=INSTALLS, check=False)
    if done.returncode:
        pytest.skip(f"{' '.join(packages)}: cannot be installed here: {done.stderr.strip().splitlines()[-1]}")
    return programs


def said(command: list[str | Path], router: Endpoint) -> str:
    """Return what a program prints; a session of rmw_zenoh's takes its settings from a variable."""
    settings = f'mode="client";connect/endpoints=["{router}"]'
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=INSTALLS, check=True,
        env=os.environ | {"ZENOH_CONFIG_OVERRIDE": settings},
    )  # fmt: skip
    return done.stdout


@pytest.mark.long("installs packages")
def test_zenoh_ros2_sdk_lists_topics_services_and_types(small: Path, tmp_runtime: Path) -> None:
    programs = environment(tmp_runtime / "sdk", "zenoh-ros2-sdk==0.1.8")
    place = Endpoint("127.0.0.1", 0).claim()
    with router_of_ros(place), Fleet(small, "--serve", runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        fleet.await_all(bus)
        with Command("bridge", "ros2", "--ros", str(place), runtime=tmp_runtime), client_session(place) as session:
            for robot in ("r1", "r2"):
                with Client(session, 0, robot, "navigate_through_poses"):
                    pass  # they are announced in this order: until then not all is there
            topics = said([programs / "zenoh-ros2", "--no-daemon", "topic", "list", "-t"], place)
            for topic in (
                "/map [nav_msgs/msg/OccupancyGrid]", "/r1/odom [nav_msgs/msg/Odometry]",
                "/r2/goal_pose [geometry_msgs/msg/PoseStamped]",
            ):  # fmt: skip
                assert topic in topics
            services = said([programs / "zenoh-ros2", "--no-daemon", "service", "list", "-t"], place)
            for robot in ("", "/r1", "/r2"):
                for name, kind in NODE_SERVICES.items():
                    assert f"{robot}/swarm_bridge/{name} [{kind}]" in services
            for robot in ("/r1", "/r2"):
                for name, kind in ACTIONS.items():
                    assert f"{robot}/{name}/_action/send_goal [nav2_msgs/action/{kind}_SendGoal]" in services
                    assert f"{robot}/{name}/_action/get_result [nav2_msgs/action/{kind}_GetResult]" in services
                    assert f"{robot}/{name}/_action/cancel_goal [action_msgs/srv/CancelGoal]" in services
                assert f"{robot}/bt_navigator/get_state [lifecycle_msgs/srv/GetState]" in services


@pytest.mark.long("installs packages")
@pytest.mark.parametrize("version", ["1.5.0", "1.6.2", "1.9.0"])
def test_peers_of_other_versions_of_zenoh_see_the_same(version: str, small: Path, tmp_runtime: Path) -> None:
    programs = environment(tmp_runtime / "peer", f"eclipse-zenoh=={version}")
    place = Endpoint("127.0.0.1", 0).claim()
    with router_of_ros(place), Fleet(small, "--serve", runtime=tmp_runtime) as fleet, fleet.bus() as bus:
        fleet.await_all(bus)
        with Command("bridge", "ros2", "--ros", str(place), runtime=tmp_runtime) as bridge:
            bridge.await_line("fleet ")
            assert said([programs / "python", "-c", PEER, str(place)], place) == "1 True True {33}\n"
