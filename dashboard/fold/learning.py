"""The floor as robots learn it, where they are not given it: what they have told each other to be solid."""

from math import ceil
from typing import Annotated, Final

from msgspec import Struct

from dashboard.fold.scene import Scene
from swarm.messages import Broadcast
from swarm.messages.fields import says
from swarm.scenario.prepare import RESOLUTION

KEPT: Final = 30.0  # s of the run for which a cell stays that nobody tells again; each robot tells all of its in turn


class Learned(Struct, frozen=True, kw_only=True):
    """The floor as the robots have learned and told it, where they were not given it."""

    rows: Annotated[int, says("of the learned grid, which has the floor's extent and origin")]
    columns: Annotated[int, says("of the learned grid")]
    resolution: Annotated[float, says("m; side of a cell")]
    cells: Annotated[list[int], says("solid ones: row * columns + column")]


class Learning:
    """What the robots of one run have told of one floor."""

    def __init__(self, scene: Scene) -> None:
        self._floor = scene.map
        self._kept = KEPT * scene.settings.rate  # ticks
        self._told: dict[int, int] = {}  # cell that is learned to be solid -> tick at which it was told last

    def hear(self, message: Broadcast) -> None:
        """Take in which cells a robot has told to be solid."""
        self._told.update(dict.fromkeys(message.walls, message.tick))

    def at(self, tick: int) -> Learned:
        """Return the floor as it is known at a tick."""
        floor = self._floor
        factor = ceil(floor.resolution / RESOLUTION - 1e-9)
        self._told = {cell: told for cell, told in self._told.items() if told >= tick - self._kept}
        return Learned(
            rows=floor.shape[0] * factor,
            columns=floor.shape[1] * factor,
            resolution=floor.resolution / factor,
            cells=sorted(self._told),
        )
