"""The parts of a run that stand still, as the world sends them."""

from dataclasses import dataclass
from math import degrees

import msgspec
from msgspec import UNSET

from swarm.fuzzy import Controller, Explanation, Profile
from swarm.maps.occupancy import OccupancyMap, Point
from swarm.maps.wire import unpack
from swarm.messages import Body, Map
from swarm.settings import Settings


@dataclass(frozen=True, eq=False)
class Scene:
    """The map, the scenario's settings and its controller; ``starts`` is empty if the world does not send them."""

    settings: Settings
    map: OccupancyMap
    controller: Controller
    starts: dict[str, tuple[float, float, float]]

    def targets(self, robot: int) -> list[Point]:
        """Return the targets [m] of robot number ``robot``, without home."""
        own = self.settings.own_targets
        return list(own[robot] if robot < len(own) else self.settings.targets)

    def explain_wheels(self, body: Body) -> Explanation:
        """Return why the fuzzy controller gives a robot its wheel speeds now.

        Raises:
            ControlInputError: one of the body's numbers is none that the controller takes.
        """
        scale = self.settings.robot.distance_scale * body.scale
        heading_deg = -degrees(body.heading)  # the paper's sign: positive is to the right
        return self.controller.explain(body.left / scale, body.front / scale, body.right / scale, heading_deg)


def scene_of(floor: Map) -> Scene:
    """Return the scene of a ``Map``.

    Raises:
        SwarmError: its packed map or its profile is not valid.
    """
    told = floor.scenario
    controller = Controller(Profile.from_builtins(msgspec.to_builtins(told.profile)))
    return Scene(told.settings, unpack(floor.packed), controller, {} if told.starts is UNSET else told.starts)
