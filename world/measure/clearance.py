"""An independent judge of gaps: it computes the smallest gap from recorded poses and the map, without physics."""

from collections.abc import Sequence
from typing import Final

import numpy as np
import shapely

from swarm.maps.occupancy import OBSTACLE, UNKNOWN, WALL, OccupancyMap

BLOCK: Final = 256  # ticks judged at once, so that memory does not grow with the run


class ClearanceJudge:
    """A judge that gets all positions at every tick and keeps the smallest gap [m] between footprints or to a wall."""

    def __init__(self, floor: OccupancyMap, radii: Sequence[float]) -> None:
        """Judge robots with these radii [m] on a floor."""
        self._radii = np.array(radii, np.float64)
        self._block: list[Sequence[tuple[float, ...]]] = []
        self._smallest = float("inf")
        self.set_floor(floor)

    def set_radii(self, radii: Sequence[float]) -> None:
        """Judge robots with these radii [m] from now on: one was added."""
        self.settle()
        self._radii = np.array(radii, np.float64)

    def set_floor(self, floor: OccupancyMap) -> None:
        """Judge against this floor from now on."""
        self.settle()
        blocks = [
            shapely.Polygon(floor.corners(low, high))
            for kind in (WALL, OBSTACLE, UNKNOWN)
            for low, high in floor.blocks(kind)
        ]
        self._tree = shapely.STRtree(blocks)
        self._solid = bool(blocks)

    def observe(self, places: Sequence[tuple[float, ...]]) -> None:
        """Take in the x, y [m] of each robot at one tick; further values are ignored."""
        self._block.append(places)
        if len(self._block) >= BLOCK:
            self.settle()

    @property
    def smallest(self) -> float:
        """The smallest gap [m] so far; negative if shapes overlapped, infinite if there is nothing to touch."""
        self.settle()
        return self._smallest

    def restore(self, smallest: float) -> None:
        """Continue with the smallest gap [m] so far."""
        self._block, self._smallest = [], smallest

    def settle(self) -> None:
        """Judge what was observed so far."""
        if not self._block:
            return
        places = np.array(self._block, np.float64)[:, :, :2]  # (ticks, robots, 2)
        self._block = []
        if self._solid:
            moved = np.ones(places.shape[:2], np.bool_)
            moved[1:] = (places[1:] != places[:-1]).any(axis=2)
            points = shapely.points(places[moved])
            _, gaps = self._tree.query_nearest(points, return_distance=True, all_matches=False)
            radii = np.broadcast_to(self._radii, places.shape[:2])[moved]
            self._smallest = min(self._smallest, float((gaps - radii).min()))
        order = places[:, :, 0].argsort(axis=1)  # from west to east, in each tick
        places, radii = np.take_along_axis(places, order[:, :, None], axis=1), self._radii[order]
        widest = 2 * float(self._radii.max(initial=0.0))  # m, of two bodies
        for later in range(1, places.shape[1]):
            apart, both = places[:, later:] - places[:, :-later], radii[:, later:] + radii[:, :-later]
            if apart[:, :, 0].min() - widest > self._smallest:
                break  # all that follow in the row are farther off still
            self._smallest = min(self._smallest, float((np.linalg.norm(apart, axis=2) - both).min()))
