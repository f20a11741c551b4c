"""Robots of several kinds in ROS: each has its own footprint and scan; a fleet without kinds is what it was."""

from hashlib import sha256
from math import isnan
from typing import Any

import pytest
from msgspec.structs import replace

from swarm.bridge.fleet_settings import FleetSettings
from swarm.bridge.ros2 import topics
from swarm.bridge.ros2.convert import Converter, RosMessage
from swarm.messages import Map, Message, Sense, Truth
from tests.bridge.ros2.test_convert import AT, FLOOR, NAMES, SETTINGS, body, only, read, sensed
from tests.shared import scenario_of

SCENARIO, PACKED = scenario_of(
    kinds={
        "cart": {"radius": 0.3, "sensors": {"range": 2.5, "rays": 3}},
        "scout": {"radius": 0.15},
    },
    robots={"cart": 1, "scout": 1},
).to_wire()
KINDS = {"r1": "cart", "arm-2": "scout"}
FLEET = FleetSettings(SCENARIO.settings, KINDS)
POSES = body("r1", 1.0, 2.0, 0.5), body("arm-2", -3.0, 4.0, -3.0)
TRUTH = Truth(run=0, tick=65, time=3.25, bodies=list(POSES))
RAYS = [0.1 * number for number in range(15)]


def converted(*told: tuple[Message, str], fleet: FleetSettings, joined: bool = False) -> list[RosMessage]:
    """Return all that messages, each with its robot, are in ROS."""
    made = Converter(joined=joined)
    made.set_namespaces(NAMES)
    return [one for message, robot in told for one in made.convert_message(message, robot, fleet, AT)]


def widths(*told: tuple[Message, str], fleet: FleetSettings = FLEET) -> dict[str, float]:
    """Return the diameter [m] of each footprint that is drawn, by its frame."""
    markers = only(read(converted(*told, fleet=fleet)), topics.MARKERS).markers
    return {one.header.frame_id: one.scale.x for one in markers if one.ns == "footprints"}


def scan_of(robot: str, rays: list[float], *before: tuple[Message, str], fleet: FleetSettings = FLEET) -> Any:  # noqa: ANN401
    told = [one for one in read(converted(*before, (sensed(rays=rays), robot), fleet=fleet)) if one.robot == robot]
    return only(told, topics.SCAN)


def test_each_footprint_is_as_wide_as_its_robots_kind() -> None:
    floor = Map(packed=PACKED, scenario=replace(SCENARIO, kinds=KINDS))
    assert widths((floor, ""), (TRUTH, "")) == {"r1/base_footprint": 0.6, "arm_2/base_footprint": 0.3}


@pytest.mark.parametrize("fleet", [FLEET, FleetSettings(SETTINGS)], ids=["kinds", "none"])
def test_a_robot_with_a_load_is_as_wide_as_its_load(fleet: FleetSettings) -> None:
    loaded = replace(TRUTH, bodies=[replace(POSES[0], radius=0.45), POSES[1]])
    own = 2 * fleet.of_robot("arm-2").robot.radius
    expected = {"r1/base_footprint": 0.9, "arm_2/base_footprint": own}
    assert widths((FLOOR, ""), (loaded, ""), fleet=fleet) == pytest.approx(expected)
    scan = scan_of("r1", [1.0] * 15, (loaded, ""), fleet=fleet)
    assert scan.range_min == pytest.approx(0.45)
    assert measured(scan) == pytest.approx([1.45] * len(measured(scan)))
    assert scan_of("r1", [1.0] * 15, (loaded, ""), (TRUTH, ""), fleet=fleet).range_min == pytest.approx(
        fleet.of_robot("r1").robot.radius
    ), "it has put it down"


def measured(scan: Any) -> list[float]:  # noqa: ANN401
    return [value for value in scan.ranges if not isnan(value)]


# robot, its rays [m], and the scan: what it can measure, and what it has
SCANS = (
    ("r1", [1.0] * 9, (0.3, 2.8), [1.3] * 9),
    ("arm-2", [1.0] * 15, (0.15, 1.75), [1.15] * 15),
)


@pytest.mark.parametrize(("robot", "rays", "limits", "ranges"), SCANS)
def test_each_scan_has_the_beams_of_its_robots_kind(
    robot: str, rays: list[float], limits: tuple[float, float], ranges: list[float]
) -> None:
    scan = scan_of(robot, rays)
    assert (scan.range_min, scan.range_max) == pytest.approx(limits)
    assert measured(scan) == pytest.approx(ranges)


def test_the_scans_of_two_kinds_in_turn_are_each_as_alone() -> None:
    told: list[tuple[Sense, str]] = [(sensed(rays=rays), robot) for robot, rays, _, _ in SCANS * 2]
    found = [one.payload for one in converted(*told, fleet=FLEET) if one.topic is topics.SCAN]
    alone = [one.payload for each in told for one in converted(each, fleet=FLEET) if one.topic is topics.SCAN]
    assert found == alone


# of what follows, in one tree and not: as it was when all robots of a fleet were of one kind
ONE_KIND = ((False, "e0ce48f5dda76b93"), (True, "1c716aaacb0000f7"))


@pytest.mark.parametrize(("joined", "digest"), ONE_KIND)
def test_a_fleet_without_kinds_gives_the_bytes_that_it_gave(joined: bool, digest: str) -> None:
    told = ((FLOOR, ""), (TRUTH, ""), (sensed(rays=RAYS), "r1"), (sensed(rays=[0.7] * 15), "arm-2"))
    found = b"".join(one.payload for one in converted(*told, fleet=FleetSettings(SETTINGS), joined=joined))
    assert sha256(found).hexdigest()[:16] == digest


@pytest.mark.parametrize("joined", [False, True])
def test_a_kind_that_is_as_the_scenario_says_gives_the_same_bytes(joined: bool) -> None:
    scenario, packed = scenario_of(kinds={"any": {}}, robots={"any": 4}).to_wire()
    kinds = dict.fromkeys(NAMES, "any")
    told = ((TRUTH, ""), (sensed(rays=RAYS), "r1"), (sensed(rays=[0.7] * 15), "arm-2"))
    mixed = Map(packed=packed, scenario=replace(scenario, kinds=kinds))
    fleet = FleetSettings(scenario.settings, kinds)
    found, expected = (
        [one.payload for one in converted((floor, ""), *told, fleet=its, joined=joined)]
        for floor, its in ((mixed, fleet), (FLOOR, FleetSettings(SETTINGS)))
    )
    assert found == expected
