"""Moving aside: a robot that has stood beside a mute robot for long drives away for a while, and then comes back.

A mute robot follows no plan and does not say where it wants to be. It may want to be where this robot stands. The
numbers below are choices, not measurements. Times are in ticks: the seconds beside them hold at 20 Hz only.
"""

from collections.abc import Collection
from typing import Final

from swarm.geometry import Pose, distance
from swarm.maps.occupancy import Point
from swarm.traffic.lattice.cell_map import CellMap
from swarm.traffic.peers.uncooperative import SAYS, Mutes

NEAR: Final = 1.5  # cell sides; a mute robot so near may want this place: diagonal neighbours are 1.41 apart
CLEAR: Final = 2.0  # cell sides from a mute robot to a place aside: a cell between them stays free for it
FARTHEST: Final = 6  # cells, the longest way to a place aside: there and back stays short beside ``LASTS``
PLACES: Final = 4  # nearest places, tried in turn: the first may be where the mute robot wants to be next
LASTS: Final = 300  # ticks (15 s) aside, with the way there: a mute robot has time to notice and to drive on
MOVED: Final = 0.3  # m; a robot that has moved farther does not stand; less is a turn on the spot or a nudge


class StepAside:
    """Decides when one robot moves aside, and where to."""

    def __init__(self) -> None:
        self._at: Pose | None = None  # where it stands
        self._since = 0  # tick since which it stands there, or moves aside
        self._to: Point | None = None  # m, the place aside; None: it does not move aside
        self._times = 0  # how often it has moved aside

    def decide(
        self, tick: int, pose: Pose, mutes: Mutes, head: int, taken: Collection[int], cells: CellMap, *, stands: bool
    ) -> Point | None:
        """Return the place aside [m] to drive to, or None: it does not move aside. Call it once a tick.

        The way to that place does not lead through cells that are ``taken``. ``head`` is the cell to start from. A
        robot that was told to stop ``stands``.
        """
        if self._to is not None and tick < self._since + LASTS and not stands:
            return self._to
        near = mutes.waiting(pose, NEAR * cells.side)
        moved = self._at is None or distance(self._at, pose) > MOVED
        if not near or moved or self._to is not None or stands:
            self._at, self._since, self._to = pose, tick, None
        elif tick - self._since >= SAYS:
            self._since, self._to = tick, self._place(near, head, taken, cells)  # it drives there from the next tick on
        return None

    def _place(self, near: Collection[Pose], head: int, taken: Collection[int], cells: CellMap) -> Point | None:
        """Return the centre [m] of a cell clear of the mute robots ``near``: each time another one, if there is any."""
        steps = cells.distances(head, frozenset(taken) - {head})
        reached = [cell for cell, far in enumerate(steps) if far <= FARTHEST and cells.stands[cell]]
        places = {cell: cells.centre(cell) for cell in reached}
        clear = sorted(
            [cell for cell, at in places.items() if all(distance(at, one) >= CLEAR * cells.side for one in near)],
            key=lambda cell: (steps[cell], cell),
        )[:PLACES]
        self._times += bool(clear)
        return places[clear[self._times % len(clear)]] if clear else None
