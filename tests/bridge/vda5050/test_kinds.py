"""Vehicles of several kinds: each has the factsheet and the speeds of its own; without kinds they are what they were."""

import json
from hashlib import sha256
from pathlib import Path
from typing import Any

import msgspec
import pytest
from msgspec.structs import replace

from swarm.bridge.fleet_settings import FleetSettings
from swarm.bridge.vda5050.factsheet import build_factsheet
from swarm.bridge.vda5050.vehicle import Vehicle
from swarm.bus import Endpoint
from swarm.messages import CLOCK, MAP, TRUTH, Map, Phase, Truth
from tests.bridge.vda5050.brokers import Broker
from tests.bridge.vda5050.masters import master_on
from tests.bridge.vda5050.shared import actions_of
from tests.conftest import MakeBus
from tests.launch.actors import Command
from tests.messages.made import clock, state, truth
from tests.shared import scenario_of

SETTINGS = scenario_of().settings
SCENARIO, PACKED = scenario_of(
    kinds={
        "cart": {"radius": 0.3, "track_width": 0.5, "wheel_acceleration": 1.0, "speed_scale": 0.15},
        "scout": {},
    },
    robots={"cart": 1, "scout": 1},
).to_wire()
KINDS = {"r1": "cart", "r2": "scout"}
FLEET = FleetSettings(SCENARIO.settings, KINDS)
HERE = truth(0).bodies[0]


def sheet_of(robot: str, fleet: FleetSettings = FLEET) -> dict[str, Any]:
    return build_factsheet(fleet.of_robot(robot), 1.0, None, fleet.kind(robot))


# robot, series, width [m], top speed [m/s], acceleration [m/s2], where its left wheel is [m]
SHEETS = (
    ("r1", "zenoh-swarm-cart", 0.6, 0.6, 1.0, 0.25),
    ("r2", "zenoh-swarm-scout", 0.4, 1.6, 2.0, 0.2),
)


@pytest.mark.parametrize(("robot", "series", "width", "speed", "acceleration", "wheel"), SHEETS)
def test_a_factsheet_is_that_of_the_robots_kind(
    robot: str, series: str, width: float, speed: float, acceleration: float, wheel: float
) -> None:
    sheet = sheet_of(robot)
    body = sheet["physicalParameters"]
    assert sheet["typeSpecification"]["seriesName"] == series
    assert (body["width"], body["length"], body["speedMax"]) == pytest.approx((width, width, speed))
    assert (body["accelerationMax"], body["decelerationMax"]) == (acceleration, acceleration)
    left, right = sheet["agvGeometry"]["wheelDefinitions"]
    assert (left["position"]["y"], right["position"]["y"], left["diameter"]) == pytest.approx(
        (wheel, -wheel, width / 2)
    )


@pytest.mark.parametrize(("shown_every", "digest"), [(None, "34948c2b60dde1a1"), (0.5, "c778e826436c4cb2")])
def test_without_kinds_a_factsheet_has_the_bytes_that_it_had(shown_every: float | None, digest: str) -> None:
    fleet = FleetSettings(SETTINGS)
    sheet = build_factsheet(fleet.of_robot("a"), 1.0, shown_every, fleet.kind("a"))
    assert sha256(json.dumps(sheet).encode()).hexdigest()[:16] == digest


def placed(settings: Any) -> Vehicle:  # noqa: ANN401
    """Return a vehicle whose wheels turn at 0.1 and 0.3 m/s."""
    vehicle = Vehicle("a", "map", settings)
    vehicle.take_clock(clock(run=1))
    vehicle.apply_message(state(0))
    vehicle.apply_message(replace(HERE, left_v=0.1, right_v=0.3))
    return vehicle


@pytest.mark.parametrize(("robot", "omega"), [("r1", 0.4), ("r2", 0.5)])
def test_a_vehicle_turns_by_the_track_width_of_its_kind(robot: str, omega: float) -> None:
    shown = placed(FLEET.of_robot(robot)).visualization_message()
    assert shown is not None
    assert shown.velocity is not None
    assert shown.velocity.omega == omega


def test_without_kinds_a_visualization_has_the_bytes_that_it_had() -> None:
    shown = msgspec.json.encode(placed(FleetSettings(SETTINGS).of_robot("a")).visualization_message())
    assert sha256(shown).hexdigest()[:16] == "9766ec4a0cc781e6"


def test_a_vehicle_whose_kind_is_told_later_owes_another_factsheet() -> None:
    vehicle = placed(FLEET.of_robot("r9"))
    vehicle.owes.clear()
    vehicle.take_settings(FLEET.of_robot("r2"))
    assert vehicle.owes == set(), "it is as it was taken to be"
    vehicle.take_settings(FLEET.of_robot("r1"))
    assert vehicle.owes == {"factsheet"}
    vehicle.apply_message(replace(HERE, left_v=0.1, right_v=0.3))
    shown = vehicle.visualization_message()
    assert shown is not None
    assert shown.velocity is not None
    assert shown.velocity.omega == 0.4


@pytest.mark.processes
def test_masters_get_the_factsheets_of_the_kinds_also_of_one_that_is_told_later(
    tmp_runtime: Path, endpoint: Endpoint, make_bus: MakeBus, broker: Broker
) -> None:
    world = make_bus(fleet="kinds")
    early, told = (Map(packed=PACKED, scenario=replace(SCENARIO, kinds=kinds)) for kinds in ({"r1": "cart"}, KINDS))
    world.announce("world", "world")
    world.keep(MAP, lambda: {MAP.key: early})
    world.keep(CLOCK, lambda: {CLOCK.key: clock(robots=("r1", "r2"))})
    world.keep(TRUTH, lambda: {TRUTH.key: Truth(run=1, tick=0, time=0.0, bodies=[HERE])})
    command = ("bridge", "vda5050", "--connect", str(endpoint), "--fleet", "kinds", "--broker", broker.place)
    with Command(*command, runtime=tmp_runtime) as bridge, master_on(broker.port) as master:
        series = {robot: master.until(robot, "factsheet")["typeSpecification"]["seriesName"] for robot in KINDS}
        assert series == {"r1": "zenoh-swarm-cart", "r2": "zenoh-swarm"}
        world.keep(MAP, lambda: {MAP.key: told})
        world.send(MAP, told)
        master.say("r2", "instantActions", actions_of("factsheetRequest", robot="r2"))
        master.until("r2", "factsheet", lambda one: one["typeSpecification"]["seriesName"] == "zenoh-swarm-scout")
        world.send(CLOCK, clock(robots=("r1", "r2"), phase=Phase.OVER))
        assert bridge.end() == 0
