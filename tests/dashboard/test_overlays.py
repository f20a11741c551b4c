from typing import Any

import msgspec

from dashboard.overlays import Overlays, waits
from dashboard.scene import scene_of
from swarm.messages import Activity, Body, Floor, Steering, Truth
from swarm.scenario.load import Scenario
from swarm.traffic.cells_of import cells_of


class Drawn:
    """Keeps what was drawn on it."""

    def __init__(self) -> None:
        self.rules = ""
        self.held: dict[str, Any] = {}
        self.waits: list[Any] = []

    def show_rules(self, time: float, text: str) -> None:
        self.rules = text

    def show_held(self, time: float, held: dict[str, Any]) -> None:
        self.held = held

    def show_waits(self, time: float, arrows: list[Any]) -> None:
        self.waits = arrows


def body(robot: str, **changes: Any) -> Body:  # noqa: ANN401
    still = Body(
        robot=robot, x=3.0, y=3.0, yaw=0.0, left_v=0.0, right_v=0.0, left=0.3, front=1.6, right=1.6,
        heading=0.0, steering=Steering.FUZZY, activity=Activity.DRIVE,
    )  # fmt: skip
    return msgspec.structs.replace(still, **changes)


def floor_of(scenario: Scenario) -> Floor:
    settings, packed = scenario.to_wire()
    return Floor(packed=packed, scenario=settings)


def held_rule(scenario: Scenario) -> Scenario:
    traffic = msgspec.structs.replace(scenario.settings.traffic, rule="holds")
    return Scenario(msgspec.structs.replace(scenario.settings, traffic=traffic), scenario.map, scenario.profile)


def test_the_selected_robots_rules_are_told(paper: Scenario) -> None:
    drawn = Drawn()
    truth = Truth(run=0, tick=1, time=0.05, bodies=[body("r1", left=1.6), body("r2")])
    Overlays(scene_of(floor_of(paper)), "r2").draw(drawn, truth)
    assert "**r2** drive, driven by fuzzy" in drawn.rules
    assert "IF left_obs is near AND right_obs is far AND front_obs is far THEN" in drawn.rules


def test_without_a_choice_the_first_robots_rules_are_told(paper: Scenario) -> None:
    drawn = Drawn()
    Overlays(scene_of(floor_of(paper))).draw(drawn, Truth(run=0, tick=1, time=0.05, bodies=[body("r1"), body("r2")]))
    assert drawn.rules.startswith("**r1**")


def test_held_cells_lie_where_the_robots_hold_them(paper: Scenario) -> None:
    scenario, drawn = held_rule(paper), Drawn()
    cells = cells_of(scenario.map, scenario.settings)
    cell = cells.cell_of(3.0, 3.0)
    bodies = [body("r1", held=[cell], waits=["r2", "gone"]), body("r2", x=9.0)]
    Overlays(scene_of(floor_of(scenario))).draw(drawn, Truth(run=0, tick=1, time=0.05, bodies=bodies))
    ((x, y, width, height),) = drawn.held["r1"]
    assert x <= 3.0 <= x + width
    assert y <= 3.0 <= y + height
    assert drawn.held["r2"] == []
    assert drawn.waits == [((3.0, 3.0), (9.0, 3.0))]


def test_nobody_waits_for_a_robot_that_is_not_there() -> None:
    assert waits({"r1": body("r1", waits=["r9"])}) == []
