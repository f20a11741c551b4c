"""What lies over the floor at a moment: the rules that fire in one robot, the cells held, and who waits for whom."""

from math import degrees
from typing import Protocol

from dashboard.scene import Scene
from swarm.errors import SwarmError
from swarm.messages import Body, Truth
from swarm.robot.fuzzy import Controller, Profile
from swarm.traffic.cells_of import cells_of

Box = tuple[float, float, float, float]  # m: x and y of the lower corner, width, height
Arrow = tuple[tuple[float, float], tuple[float, float]]


class Layers(Protocol):
    """What of a view is drawn on."""

    def show_rules(self, time: float, text: str) -> None:
        """Show which rules fire, as markdown."""

    def show_held(self, time: float, held: dict[str, list[Box]]) -> None:
        """Show the cells that robots hold."""

    def show_waits(self, time: float, arrows: list[Arrow]) -> None:
        """Show who waits for whom."""


class Overlays:
    """Made for one scene; ``selected`` is the robot whose rules are shown, None for the first."""

    def __init__(self, scene: Scene, selected: str | None = None) -> None:
        self._scene = scene
        self._selected = selected
        self._controller = Controller(Profile.from_builtins(scene.profile)) if scene.profile is not None else None
        holds = scene.settings.traffic.rule == "holds"
        self._cells = cells_of(scene.map, scene.settings) if holds else None

    def draw(self, view: Layers, truth: Truth) -> None:
        """Draw them as they are at a moment."""
        bodies = {body.robot: body for body in truth.bodies}
        if not bodies:
            return
        if self._controller is not None:
            selected = bodies.get(self._selected or "", truth.bodies[0])
            view.show_rules(truth.time, self.rules(self._controller, selected))
        if self._cells is not None:
            view.show_held(truth.time, {name: self.boxes(body) for name, body in bodies.items()})
            view.show_waits(truth.time, waits(bodies))

    def rules(self, controller: Controller, body: Body) -> str:
        """Explain what a robot's tables make of what it senses, as markdown."""
        scale = self._scene.settings.robot.distance_scale
        heading_deg = -degrees(body.heading)  # the paper's sign: positive is to the right
        try:
            told = controller.explain(body.left / scale, body.front / scale, body.right / scale, heading_deg)
        except SwarmError as fault:
            return f"{body.robot}: {fault}"
        joint = f", in a joint plan with {', '.join(body.members)}" if body.members else ""
        return (
            f"**{body.robot}** {body.activity.value}, driven by {body.steering.value}{joint}\n\n```\n{told.text()}\n```"
        )

    def boxes(self, body: Body) -> list[Box]:
        """Give the cells a robot holds."""
        if self._cells is None:
            return []
        side = self._cells.side
        middles = (self._cells.centre(cell) for cell in body.held if cell < len(self._cells))
        return [(x - side / 2, y - side / 2, side, side) for x, y in middles]


def waits(bodies: dict[str, Body]) -> list[Arrow]:
    """Draw an arrow from each robot to each that it waits for."""
    return [
        ((body.x, body.y), (bodies[other].x, bodies[other].y))
        for body in bodies.values()
        for other in body.waits
        if other in bodies
    ]
