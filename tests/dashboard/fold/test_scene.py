"""What stands still of a run is told by the robot: of a fleet with kinds its radius, sensors, controller and targets."""

from typing import Final

import pytest
from msgspec.structs import replace

from dashboard.fold.overlays import Overlays
from dashboard.fold.scene import Scene, scene_of
from swarm.errors import ConfigError
from swarm.fuzzy import load_profile
from swarm.messages import Map
from swarm.scenario.load import Scenario
from swarm.settings import SensorSettings
from tests.dashboard.drawn import floor as plain_floor
from tests.dashboard.mixed import KINDS, NAMES, RADII, STARTED, floor, truth
from tests.dashboard.rehearsal import TARGETS, Rehearsal

FAR: Final = SensorSettings(range=3.0)


def careful_carts() -> Scenario:
    """Return the fleet with carts that have sensors, a controller and a scale of their own."""
    settings = STARTED.scenario.settings
    cart = replace(settings.kinds["cart"], sensors=FAR, controller="careful", distance_scale=0.9)
    scenario = STARTED.scenario.with_settings(replace(settings, kinds={**settings.kinds, "cart": cart}))
    return Scenario(scenario.settings, scenario.map, scenario.profile, {"cart": load_profile("careful")})


@pytest.fixture(scope="module")
def mixed() -> Scene:
    return scene_of(floor(careful_carts()))


def test_a_robot_has_the_radius_and_the_sensors_of_its_kind(mixed: Scene) -> None:
    assert {name: mixed.radius_of(name) for name in NAMES} == {name: RADII[kind] for name, kind in KINDS.items()}
    assert [mixed.sensors_of(name).range for name in ("r1", "r3")] == [3.0, 1.6]
    assert [mixed.kind_of(name) for name in ("r2", "r8", "r9")] == ["cart", "scout", ""]
    assert mixed.radius_of("r9") == mixed.settings.robot.radius, "whose kind is not told has the scenario's"


def test_a_robot_with_a_load_is_as_wide_as_with_it(mixed: Scene) -> None:
    bodies = truth(r1=0.5, r8=0.3).bodies
    assert [mixed.radius_now(body) for body in bodies] == [0.5, 0.35, 0.2, 0.2, 0.2, 0.2, 0.2, 0.3]


def test_a_robot_has_the_targets_of_its_kind(mixed: Scene) -> None:
    cart, scout = ([(18.4, 1.8), (18.4, 9.4)], [(13.2, 7.2), (7.4, 3.8), (17.4, 5.4)])
    assert [mixed.targets(number) for number in range(len(NAMES))] == [cart] * 2 + [scout] * 6


def test_the_wheels_of_a_robot_are_explained_by_the_controller_of_its_kind(mixed: Scene) -> None:
    cart, *_, scout = truth().bodies
    for body, controller, scale in ((cart, mixed.controllers["cart"], 0.9), (scout, mixed.controller, 0.6)):
        expected = controller.explain(body.left / scale, body.front / scale, body.right / scale, 0.0)
        assert mixed.explain_wheels(body) == expected
    assert mixed.controllers["cart"].profile != mixed.controller.profile


def test_the_words_on_a_robots_rules_name_its_kind(mixed: Scene) -> None:
    overlays = Overlays(mixed)
    assert [overlays.overlay_at(truth(), name).rules.split(",")[0] for name in ("r1", "r8")] == [
        "**r1** (cart) drive",
        "**r8** (scout) drive",
    ]


def test_a_fleet_without_kinds_is_as_its_scenario() -> None:
    rehearsal = Rehearsal(2)
    scene = scene_of(plain_floor(rehearsal))
    settings = rehearsal.scenario.settings
    for name in ("r1", "r2", "somebody"):
        assert (scene.kind_of(name), scene.settings_of(name)) == ("", settings)
        assert scene.controller_of(name) is scene.controller
    assert [scene.targets(number) for number in (0, 1, 5)] == [list(TARGETS)] * 3
    assert Overlays(scene).overlay_at(rehearsal.truth(0)).rules.startswith("**r1** ")


def test_a_kind_that_there_is_not_is_refused() -> None:
    told = floor()
    wrong = Map(packed=told.packed, scenario=replace(told.scenario, kinds={**KINDS, "r1": "crat"}))
    with pytest.raises(ConfigError, match=r"kind: expected cart, scout, got 'crat'; did you mean 'cart'\?"):
        scene_of(wrong)
