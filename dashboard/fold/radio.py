"""Listen only to the broadcasts that are on screen: relayed records are most of a fleet's bytes.

Where robots learn the floor, all robots are heard; else only the members of the joint plans of those looked at.
"""

from collections.abc import Collection
from typing import Final

from dashboard.fold.scene import Scene
from swarm.bus import Bus
from swarm.messages import RADIO, Truth

ALL: Final = "*"  # as in a key: any robot


def wanted(scene: Scene | None, truth: Truth | None, selected: Collection[str]) -> frozenset[str]:
    """Return the robots whose broadcasts are needed; ``ALL`` for those of all."""
    if scene is None or truth is None:
        return frozenset()
    if not scene.settings.map.known:
        return frozenset({ALL})
    return frozenset(member for body in truth.bodies if body.robot in selected for member in body.members)


class HeardRadio:
    """The part of the radio that is listened to."""

    def __init__(self, bus: Bus) -> None:
        self._bus = bus
        self._heard: frozenset[str] = frozenset()

    def turn_to(self, robots: frozenset[str]) -> None:
        """Listen to these robots, and to no others any more."""
        for name in self._heard - robots:
            self._bus.unlisten(RADIO, robot=name)
        for name in robots - self._heard:
            self._bus.listen(RADIO, robot=name)
        self._heard = robots
