"""Moving aside: a robot that has long stood beside a mute robot leaves its place to it for a while, and comes back.

No plan makes a mute robot move, and none says where it wants to be. It may be where this robot stands.
"""

from collections.abc import Collection
from typing import Final

from swarm.geometry import Pose, distance
from swarm.maps.occupancy import Point
from swarm.traffic.cells import CellMap
from swarm.traffic.interface import TrafficInputs
from swarm.traffic.mute import SAYS, Mutes

NEAR: Final = 1.5  # cell sides; a mute robot that is so near may want to be where this robot stands
CLEAR: Final = 2.0  # cell sides, from the mute robot to a place aside
FARTHEST: Final = 6  # cells, the longest way to a place aside
PLACES: Final = 4  # of the nearest places, tried in turn
LASTS: Final = 300  # ticks aside, with the way there
MOVED: Final = 0.3  # m; a robot that has got on so far does not stand


class Aside:
    """When and where one robot moves aside."""

    def __init__(self) -> None:
        self._at: Pose | None = None  # where it has stood
        self._since = 0  # tick
        self._to: Point | None = None  # m
        self._times = 0

    def look(
        self, inputs: TrafficInputs, mutes: Mutes, head: int, taken: Collection[int], cells: CellMap
    ) -> TrafficInputs:
        """Return the inputs, with another goal while the robot moves aside; cells ``taken`` are not driven through."""
        tick, pose = inputs.tick, inputs.pose
        if self._to is not None and tick < self._since + LASTS and not inputs.stands:
            return inputs._replace(goal=self._to, path=(), done=False)
        near = mutes.waiting(pose, NEAR * cells.side)
        moved = self._at is None or distance(self._at, pose) > MOVED
        if not near or moved or self._to is not None or inputs.stands:
            self._at, self._since, self._to = pose, tick, None
            return inputs
        if tick - self._since < SAYS:
            return inputs
        self._since = tick
        self._to = self._place(near, head, taken, cells)
        return inputs

    def _place(self, near: Collection[Pose], head: int, taken: Collection[int], cells: CellMap) -> Point | None:
        """Return one of the nearest places that are clear of mute robots ``near``: another one each time."""
        steps = cells.distances(head, frozenset(taken) - {head})
        reached = [cell for cell, far in enumerate(steps) if far <= FARTHEST and cells.stands[cell]]
        places = {cell: cells.centre(cell) for cell in reached}
        clear = sorted(
            [cell for cell, at in places.items() if all(distance(at, one) >= CLEAR * cells.side for one in near)],
            key=lambda cell: (steps[cell], cell),
        )[:PLACES]
        self._times += bool(clear)
        return places[clear[self._times % len(clear)]] if clear else None
