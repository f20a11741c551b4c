"""The parts of a run that stand still, as the world sends them."""

from dataclasses import dataclass, field

import msgspec
from msgspec import UNSET

from swarm.maps.occupancy import OccupancyMap, Point
from swarm.maps.wire import unpack
from swarm.messages import Map
from swarm.settings import Settings


@dataclass(frozen=True, eq=False)
class Scene:
    """The map and the scenario's settings; ``starts`` is empty if the world does not send them."""

    settings: Settings
    map: OccupancyMap
    starts: dict[str, tuple[float, float, float]] = field(default_factory=dict)
    profile: object = None  # the fuzzy profile as plain values, None if the world does not send it

    def targets(self, robot: int) -> list[Point]:
        """Return the targets [m] of robot number ``robot``, without home."""
        own = self.settings.own_targets
        return list(own[robot] if robot < len(own) else self.settings.targets)


def scene_of(floor: Map) -> Scene:
    """Return the scene of a ``Map``.

    Raises:
        PeerError: its packed map is not valid.
    """
    told = floor.scenario
    starts = {} if told.starts is UNSET else told.starts
    return Scene(told.settings, unpack(floor.packed), starts, msgspec.to_builtins(told.profile))
