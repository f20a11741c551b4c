"""An independent checker of paths: it knows cells, lines and walls, and nothing of how a path was found.

It checks cells with array arithmetic and metres with shapely. It shares no code with the planner.
"""

from collections.abc import Sequence
from enum import StrEnum
from math import isfinite
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from swarm.geometry import distance
from swarm.maps.occupancy import OBSTACLE, UNKNOWN, WALL, Cell, OccupancyMap, Point


class PathFault(StrEnum):
    """What can be wrong with a path."""

    NO_PATH = "is no path"  # too short, or with a number that is not finite
    WRONG_START = "wrong start"
    WRONG_GOAL = "wrong goal"
    LEAVES_MAP = "leaves the map"
    ENTERS_SOLID = "enters solid"
    CUTS_CORNER = "cuts a corner"
    JUMPS = "jumps"
    WRONG_LENGTH = "wrong length"
    TOO_NEAR = "too near a wall"


class Finding(NamedTuple):
    """A fault of a path, and where it first occurs."""

    fault: PathFault
    where: str


def check_cells(
    free: NDArray[np.bool_], start: Cell, goal: Cell, cells: Sequence[Cell], length: float | None = None
) -> list[Finding]:
    """Check a path of (row, column) cells on a grid: 8-connected, no corner cutting. A good path has no findings.

    ``length`` is the claimed length in cells; it may be off by 1e-4 or by a share of 1e-5, whichever is more.
    """
    if not cells:
        return [Finding(PathFault.NO_PATH, "no cells")]
    findings = []
    if tuple(cells[0]) != tuple(start):
        findings.append(Finding(PathFault.WRONG_START, f"{cells[0]}, not {start}"))
    if tuple(cells[-1]) != tuple(goal):
        findings.append(Finding(PathFault.WRONG_GOAL, f"{cells[-1]}, not {goal}"))
    way = np.asarray(cells, np.int64)
    outside = (way < 0).any(axis=1) | (way >= np.array(free.shape)).any(axis=1)
    inside = way.clip(0, np.array(free.shape) - 1)
    here, onward = inside[:-1], inside[1:]
    steps = way[1:] - way[:-1]
    jump = np.abs(steps).max(axis=1, initial=0) != 1
    diagonal = (np.abs(steps) == 1).all(axis=1)
    # the two cells between which a diagonal step passes
    beside = ~free[here[:, 0], onward[:, 1]] | ~free[onward[:, 0], here[:, 1]]
    for fault, wrong in (
        (PathFault.LEAVES_MAP, outside),
        (PathFault.ENTERS_SOLID, ~outside & ~free[inside[:, 0], inside[:, 1]]),
        (PathFault.JUMPS, jump),
        (PathFault.CUTS_CORNER, diagonal & beside),
    ):
        if wrong.any():
            findings.append(Finding(fault, f"at cell {int(wrong.argmax())}: {cells[int(wrong.argmax())]}"))
    measured = float(np.sqrt((steps**2).sum(axis=1)).sum())
    return findings + _length(measured, length)


class Judge:
    """A checker of paths in metres on one map, for a round footprint."""

    def __init__(self, map: OccupancyMap, radius: float, unknown_free: bool = False) -> None:  # noqa: A002
        kinds = [WALL, OBSTACLE] if unknown_free else [WALL, OBSTACLE, UNKNOWN]
        blocks = [map.corners(low, high) for kind in kinds for low, high in map.blocks(kind)]
        self.radius = radius
        self.floor = shapely.Polygon(map.corners((0, 0), map.shape))
        self.solids = shapely.STRtree([shapely.Polygon(corners) for corners in blocks])

    def faults(
        self, start: Point, goal: Point, points: Sequence[Point], length: float | None = None, tolerance: float = 1e-6
    ) -> list[Finding]:
        """Check a path of points [m, map]; a good path has no findings.

        A robot may already stand nearer to something than its radius. In this case the path may be as near as its
        start up to its second point, but no nearer. ``tolerance`` [m] allows for rounding.
        """
        if len(points) < 2 or not all(isfinite(number) for point in points for number in point):
            return [Finding(PathFault.NO_PATH, "fewer than two points, or one that is not finite")]
        findings = []
        if distance(points[0], start) > tolerance:
            findings.append(Finding(PathFault.WRONG_START, f"{points[0]}, not {start}"))
        if distance(points[-1], goal) > tolerance:
            findings.append(Finding(PathFault.WRONG_GOAL, f"{points[-1]}, not {goal}"))
        line = shapely.LineString(points)
        if not self.floor.buffer(tolerance).covers(line):
            findings.append(Finding(PathFault.LEAVES_MAP, "beyond its outer edge"))
        if self.room(line) <= tolerance:
            findings.append(Finding(PathFault.ENTERS_SOLID, self._place(line)))
        else:
            allowed = min(self.radius, self.room(shapely.Point(points[0])))
            first, rest = shapely.LineString(points[:2]), shapely.LineString([points[1], *points[1:]])
            for part, keep in ((first, allowed), (rest, self.radius)):
                if self.room(part) < keep - tolerance:
                    said = f"{self._place(part)}: {self.room(part):.4f} m, less than {keep:.4f} m"
                    findings.append(Finding(PathFault.TOO_NEAR, said))
                    break
        return findings + _length(float(line.length), length)

    def room(self, shape: shapely.Geometry) -> float:
        """Return the distance [m] to the nearest solid cell or map edge."""
        edge = float(shapely.distance(self.floor.exterior, shape))
        if not len(self.solids):
            return edge
        return min(edge, float(shapely.distance(self.solids.geometries[self.solids.nearest(shape)], shape)))

    def _place(self, shape: shapely.Geometry) -> str:
        candidates: list[shapely.Geometry] = [self.floor.exterior]
        if len(self.solids):
            candidates.append(self.solids.geometries.item(int(self.solids.nearest(shape))))
        nearest = min(candidates, key=lambda each: float(shapely.distance(each, shape)))
        x, y = shapely.get_coordinates(shapely.shortest_line(shape, nearest))[0].tolist()
        return f"near ({x:.3f}, {y:.3f})"


def _length(measured: float, claimed: float | None) -> list[Finding]:
    if claimed is None or abs(measured - claimed) <= max(1e-4, 1e-5 * abs(claimed)):
        return []
    return [Finding(PathFault.WRONG_LENGTH, f"{measured:.6f}, not {claimed}")]
