"""The files for RViz and Foxglove show topics that the bridges offer, as what they are."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import pytest
import yaml

from dashboard.fold import palette
from swarm.bridge.ros2.topics import GOAL, HEARD, OF_FLEET, OF_ROBOT, Qos, RosTopic
from tests.shared import ROOT

RVIZ: Final = sorted((ROOT / "deploy" / "ros2").glob("*.rviz"))
LAYOUT: Final = ROOT / "deploy" / "foxglove" / "layout.json"
# what each display of rviz_default_plugins subscribes to
TYPES: Final = {
    "Map": "nav_msgs/msg/OccupancyGrid",
    "MarkerArray": "visualization_msgs/msg/MarkerArray",
    "Path": "nav_msgs/msg/Path",
    "PoseWithCovariance": "geometry_msgs/msg/PoseWithCovarianceStamped",
    "LaserScan": "sensor_msgs/msg/LaserScan",
    "Odometry": "nav_msgs/msg/Odometry",
    "SetGoal": "geometry_msgs/msg/PoseStamped",
}
OTHERS: Final = {"Grid", "TF", "MoveCamera", "Select", "Measure"}  # without a topic of their own in the file


def offered(name: str) -> RosTopic:
    """Return the topic of a name such as ``/r1/odom``."""
    _, *space, last = name.split("/")
    assert len(space) <= 1
    (found,) = {topic for topic in ((*OF_ROBOT, *HEARD) if space else OF_FLEET) if topic.name == last}
    return found


def displays(file: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    manager = file["Visualization Manager"]
    for one in (*manager["Displays"], *manager["Tools"]):
        kind = one["Class"].removeprefix("rviz_default_plugins/")
        if kind not in OTHERS:
            yield kind, one["Topic"]


@pytest.mark.parametrize("path", RVIZ, ids=lambda path: path.name)
def test_rviz_shows_what_is_offered_with_qualities_that_fit(path: Path) -> None:
    file = yaml.safe_load(path.read_text(encoding="utf-8"))
    assert file["Visualization Manager"]["Global Options"]["Fixed Frame"] == "map"
    for kind, told in displays(file):
        topic = offered(told["Value"])
        assert topic.type == TYPES[kind]
        assert (told["Durability Policy"] == "Transient Local") == topic.qos.is_latched
        assert (told["Reliability Policy"] == "Best Effort") == (topic.qos is Qos.SENSOR)


def test_between_them_the_files_for_rviz_show_all_that_rviz_can() -> None:
    files = [yaml.safe_load(path.read_text(encoding="utf-8")) for path in RVIZ]
    shown = {offered(told["Value"]) for file in files for _, told in displays(file)}
    assert shown == {topic for topic in (*OF_FLEET, *OF_ROBOT, GOAL) if topic.type in TYPES.values()}


def test_the_layout_for_foxglove_shows_what_is_offered() -> None:
    layout = json.loads(LAYOUT.read_text(encoding="utf-8"))
    panels = layout["configById"]

    def leaves(node: object) -> Iterator[str]:
        if isinstance(node, str):
            yield node
        elif isinstance(node, dict):
            yield from (*leaves(node["first"]), *leaves(node["second"]))

    assert set(leaves(layout["layout"])) == panels.keys()
    scene = panels["3D!fleet"]
    assert {offered(name).name for name in scene["topics"]} == {"map", "markers", "scan", "plan", "amcl_pose", "odom"}
    assert offered(scene["publish"]["poseTopic"]) is GOAL
    assert offered(panels["DiagnosticSummary!health"]["topicToRender"]).type == "diagnostic_msgs/msg/DiagnosticArray"
    for number, path in enumerate(panels["Plot!speed"]["paths"]):
        name, field = path["value"].split(".", 1)
        assert (offered(name).name, field) == ("odom", "twist.twist.linear.x")
        assert path["color"] == palette.hexadecimal(palette.robot(number)), "a robot has one colour everywhere"
