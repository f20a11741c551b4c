"""The parts of a run that stand still, as the world sends them."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from math import degrees

import msgspec
from msgspec import UNSET

from swarm.fuzzy import Controller, Explanation, Profile
from swarm.kinds import PLAIN, settings_of, targets_of
from swarm.maps.occupancy import OccupancyMap, Point
from swarm.maps.wire import unpack
from swarm.messages import Body, Map, ProfileOnWire
from swarm.settings import SensorSettings, Settings


@dataclass(frozen=True, eq=False)
class Scene:
    """The map, the scenario's settings and its controller; ``starts`` is empty if the world does not send them.

    ``kinds`` are those of the robots, by name, and ``controllers`` the controllers that kinds have of their own; both
    are empty in a fleet without kinds.
    """

    settings: Settings
    map: OccupancyMap
    controller: Controller
    starts: dict[str, tuple[float, float, float]]
    kinds: Mapping[str, str] = field(default_factory=dict)
    controllers: Mapping[str, Controller] = field(default_factory=dict)

    @cached_property
    def _settings_by_kind(self) -> dict[str, Settings]:
        kinds = {PLAIN, *self.kinds.values()}
        return {kind: settings_of(self.settings, kind) for kind in kinds}

    def kind_of(self, robot: str) -> str:
        """Return the kind of a robot; empty for one whose kind is not told, and in a fleet without kinds."""
        return self.kinds.get(robot, PLAIN)

    def settings_of(self, robot: str) -> Settings:
        """Return the settings as they are for a robot: ``robot``, ``sensors`` and ``controller`` are its own."""
        return self._settings_by_kind[self.kind_of(robot)]

    def sensors_of(self, robot: str) -> SensorSettings:
        """Return what a robot senses with."""
        return self.settings_of(robot).sensors

    def radius_of(self, robot: str) -> float:
        """Return the radius [m] of a robot that carries nothing."""
        return self.settings_of(robot).robot.radius

    def radius_now(self, body: Body) -> float:
        """Return the radius [m] of a robot's footprint as it is now: with its load, if it carries one."""
        return body.radius or self.radius_of(body.robot)

    def controller_of(self, robot: str) -> Controller:
        """Return the fuzzy controller of a robot."""
        return self.controllers.get(self.kind_of(robot), self.controller)

    def targets(self, robot: int) -> list[Point]:
        """Return the targets [m] of robot number ``robot``, without home."""
        return list(targets_of(self.settings, robot))

    def explain_wheels(self, body: Body) -> Explanation:
        """Return why the fuzzy controller gives a robot its wheel speeds now.

        Raises:
            ControlInputError: one of the body's numbers is none that the controller takes.
        """
        scale = self.settings_of(body.robot).robot.distance_scale * body.scale
        heading_deg = -degrees(body.heading)  # the paper's sign: positive is to the right
        controller = self.controller_of(body.robot)
        return controller.explain(body.left / scale, body.front / scale, body.right / scale, heading_deg)


def scene_of(floor: Map) -> Scene:
    """Return the scene of a ``Map``.

    Raises:
        SwarmError: its packed map or a profile is not valid, or a robot is of a kind that there is not.
    """
    told = floor.scenario
    own = {} if told.profiles is UNSET else told.profiles
    kinds = {} if told.kinds is UNSET else told.kinds
    for kind in set(kinds.values()):
        settings_of(told.settings, kind)
    return Scene(
        told.settings,
        unpack(floor.packed),
        _controller(told.profile),
        {} if told.starts is UNSET else told.starts,
        kinds,
        {kind: _controller(profile) for kind, profile in own.items()},
    )


def _controller(profile: ProfileOnWire) -> Controller:
    return Controller(Profile.from_builtins(msgspec.to_builtins(profile)))
