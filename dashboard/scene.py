"""The parts of a run that stand still, as the world sends them."""

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
    """Return the scene of a ``Map``; its ``scenario`` has ``settings``, and may have ``profile`` and ``starts``.

    Raises:
        PeerError: the message does not hold settings and a map.
    """
    settings = _converted(floor.scenario.get("settings"), Settings)
    starts = _converted(floor.scenario.get("starts", {}), dict[str, tuple[float, float, float]])
    return Scene(settings, unpack(floor.packed), starts, floor.scenario.get("profile"))


def _converted(raw: object, kind: type[T]) -> T:
    try:
        return msgspec.convert(raw, kind)
    except msgspec.ValidationError as fault:
        raise PeerError(f"floor: {fault}") from None
