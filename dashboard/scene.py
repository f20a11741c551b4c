"""What stands still in a run, as the world tells it."""

from dataclasses import dataclass, field
from typing import TypeVar

import msgspec

from swarm.errors import PeerError
from swarm.maps.occupancy import OccupancyMap, Point
from swarm.maps.wire import unpack
from swarm.messages import Map
from swarm.settings import Settings

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class Scene:
    """The map and the scenario's settings; ``starts`` where the world tells them."""

    settings: Settings
    map: OccupancyMap
    starts: dict[str, tuple[float, float, float]] = field(default_factory=dict)
    profile: object = None  # the fuzzy profile as plain values, None where the world does not tell it

    def targets(self, robot: int) -> list[Point]:
        """List the targets of robot number ``robot``, home not among them."""
        own = self.settings.own_targets
        return list(own[robot] if robot < len(own) else self.settings.targets)


def scene_of(floor: Map) -> Scene:
    """Read a ``Map``: of its ``scenario`` the ``settings`` and, if there, ``profile`` and ``starts`` ((x, y, yaw)s).

    Raises:
        PeerError: it does not hold settings and a map.
    """
    settings = _converted(floor.scenario.get("settings"), Settings)
    starts = _converted(floor.scenario.get("starts", {}), dict[str, tuple[float, float, float]])
    return Scene(settings, unpack(floor.packed), starts, floor.scenario.get("profile"))


def _converted(raw: object, kind: type[T]) -> T:
    try:
        return msgspec.convert(raw, kind)
    except msgspec.ValidationError as fault:
        raise PeerError(f"floor: {fault}") from None
