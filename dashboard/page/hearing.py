"""What the box hears of the radio: as little as browsers look at, since relayed records are most of a fleet's bytes.

Where robots learn the floor, it hears all robots; else only the members of the joint plan of a robot that is selected.
"""

from math import ceil
from typing import Final

from dashboard.overlays import Overlays
from dashboard.page.telling import Joint, Learned, Turn
from dashboard.scene import Scene
from swarm.bus import Bus
from swarm.messages import RADIO, Broadcast, Truth
from swarm.scenario.prepare import RESOLUTION

ALL: Final = "*"  # as in a key: any robot
KEPT: Final = 30.0  # s of the run for which a cell stays that nobody tells again; each robot tells all of its in turn


def wanted(scene: Scene | None, truth: Truth | None, selected: frozenset[str]) -> frozenset[str]:
    """Return the robots whose broadcasts are needed; ``ALL`` for those of all."""
    if scene is None or truth is None:
        return frozenset()
    if not scene.settings.map.known:
        return frozenset({ALL})
    return frozenset(member for body in truth.bodies if body.robot in selected for member in body.members)


class Hearing:
    """The radio of one scene, as far as somebody looks at it."""

    def __init__(self, bus: Bus) -> None:
        self._bus = bus
        self._heard: frozenset[str] = frozenset()
        self._scene: Scene | None = None
        self._overlays: Overlays | None = None
        self._run = -1
        self._told: dict[int, int] = {}  # cell that is learned to be solid -> tick at which it was told last

    def turn_to(self, robots: frozenset[str]) -> None:
        """Listen to these robots, and to no others any more."""
        for name in self._heard - robots:
            self._bus.unlisten(RADIO, robot=name)
        for name in robots - self._heard:
            self._bus.listen(RADIO, robot=name)
        self._heard = robots

    def take(self, scene: Scene) -> None:
        """Take in another floor."""
        self._scene, self._overlays = scene, None

    def hear(self, message: Broadcast) -> None:
        """Take in a broadcast of the run that goes on."""
        if message.run != self._run:
            self._run, self._told, self._overlays = message.run, {}, None
        if self._scene is None:
            return
        if not self._scene.settings.map.known:
            self._told.update(dict.fromkeys(message.walls, message.tick))
            return
        if self._overlays is None:
            self._overlays = Overlays(self._scene)
        self._overlays.hear(message)

    def learned(self, truth: Truth) -> Learned | None:
        """Return the floor as the robots have learned it; None: they have been given it."""
        if self._scene is None or self._scene.settings.map.known:
            return None
        floor = self._scene.map
        factor = ceil(floor.resolution / RESOLUTION - 1e-9)
        oldest = truth.tick - KEPT * self._scene.settings.rate
        self._told = {cell: tick for cell, tick in self._told.items() if tick >= oldest}
        return Learned(
            rows=floor.shape[0] * factor,
            columns=floor.shape[1] * factor,
            resolution=floor.resolution / factor,
            cells=sorted(self._told) if self._run == truth.run else [],
        )

    def joint(self, truth: Truth, selected: frozenset[str]) -> list[Joint]:
        """Return the joint plans of the robots that are selected."""
        if self._overlays is None or self._run != truth.run:
            return []
        return [
            Joint(leader=plan.leader, ways=plan.lines, turns=[Turn(at=at, robots=text) for at, text in plan.orders])
            for plan in self._overlays.at(truth).plans
            if selected & plan.lines.keys()
        ]
