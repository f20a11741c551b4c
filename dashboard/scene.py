"""What stands still in a run, as the world tells it."""

from dataclasses import dataclass, field

import msgspec

from swarm.errors import PeerError
from swarm.maps.occupancy import OccupancyMap, Point
from swarm.messages import Floor
from swarm.scenario import Scenario, Settings


@dataclass(frozen=True, eq=False)
class Scene:
    """The map and the scenario's settings; ``starts`` where the world tells them."""

    settings: Settings
    map: OccupancyMap
    starts: dict[str, tuple[float, float, float]] = field(default_factory=dict)

    def targets(self, robot: int) -> list[Point]:
        """List the targets of robot number ``robot``, home not among them."""
        own = self.settings.own_targets
        return list(own[robot] if robot < len(own) else self.settings.targets)


def scene_of(floor: Floor) -> Scene:
    """Read a ``Floor``.

    Raises:
        SwarmError: it does not hold a scenario and a map.
    """
    scenario = Scenario.from_wire(floor.scenario, floor.packed)
    try:
        starts = msgspec.convert(floor.scenario.get("starts", {}), dict[str, tuple[float, float, float]])
    except msgspec.ValidationError as fault:
        raise PeerError(f"floor: starts: {fault}") from None
    return Scene(scenario.settings, scenario.map, starts)
