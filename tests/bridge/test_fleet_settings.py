"""The settings of each robot of a fleet, by the kinds that its map tells."""

from collections.abc import Mapping
from typing import Any

import pytest
from msgspec import UNSET, UnsetType
from msgspec.structs import replace

from swarm.bridge.fleet_settings import FleetSettings
from swarm.bridge.fleet_view import FleetView
from swarm.messages import Map
from tests.shared import scenario_of

ONE: dict[str, Any] = {"robot": {"radius": 0.2, "track_width": 0.4, "speed_scale": 0.4}}
TWO = ONE | {
    "kinds": {
        "cart": {"radius": 0.3, "track_width": 0.5, "speed_scale": 0.15, "sensors": {"range": 2.0}},
        "scout": {},
    },
    "robots": {"cart": 1, "scout": 1},
}
KINDS = {"r1": "cart", "r2": "scout"}


@pytest.mark.parametrize(("fields", "kinds", "robot", "kind", "radius", "speed", "reach"), [
    (TWO, KINDS, "r1", "cart", 0.3, 0.6, 2.0),
    (TWO, KINDS, "r2", "scout", 0.2, 1.6, 1.6),
    (TWO, KINDS, "r9", "", 0.2, 1.6, 1.6),  # a map without it: it has just come
    (TWO, UNSET, "r1", "", 0.2, 1.6, 1.6),
    (TWO, {"r1": "tank"}, "r1", "", 0.2, 1.6, 1.6),  # another program's map
    (ONE, UNSET, "r1", "", 0.2, 1.6, 1.6),
    (ONE, {"r1": "cart"}, "r1", "", 0.2, 1.6, 1.6),
])  # fmt: skip
def test_a_robot_has_the_settings_of_its_kind(
    fields: dict[str, Any], kinds: Mapping[str, str] | UnsetType, robot: str, kind: str, radius: float, speed: float,
    reach: float,
) -> None:  # fmt: skip
    fleet = FleetSettings(scenario_of(**fields).settings, kinds)
    own = fleet.of_robot(robot)
    assert fleet.kind(robot) == kind
    assert (own.robot.radius, own.robot.top_speed) == pytest.approx((radius, speed))
    assert own.sensors.range == reach
    assert own is fleet.of_robot(robot), "who has made something of them sees that they are the same"
    assert own.rate == fleet.shared.rate


def test_a_fleet_without_kinds_has_the_scenarios_own_settings() -> None:
    settings = scenario_of(**ONE).settings
    assert FleetSettings(settings).of_robot("r1") is settings


def test_the_settings_are_those_of_the_newest_map() -> None:
    scenario, packed = scenario_of(**TWO).to_wire()
    fold = FleetView()
    assert fold.settings is None
    for kinds, expected in (({"r1": "scout"}, ("scout", "")), (KINDS, ("cart", "scout"))):
        fold.apply_message(Map(packed=packed, scenario=replace(scenario, kinds=kinds)))
        assert fold.settings is not None
        assert (fold.settings.kind("r1"), fold.settings.kind("r2")) == expected
