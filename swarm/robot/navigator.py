"""A robot's own path to its goal, and the waypoint ahead on it."""

from bisect import bisect_right
from collections.abc import Sequence
from itertools import pairwise
from typing import Final

from swarm.geometry import Pose, bearing, distance
from swarm.maps.occupancy import Point
from swarm.planning.grid import Grid
from swarm.planning.path import Path, line_is_free, plan

AHEAD: Final = 1.0  # m, how far along the path the waypoint lies
NEARER: Final = (1.0, 0.6, 0.3)  # shares of AHEAD tried until the straight way to the waypoint is free
STRAYED: Final = 0.8  # m off the path: plan anew
JUMP: Final = 2.0  # m, the farthest that progress may leap along the path between two ticks
BODY_GAP: Final = 0.15  # m, kept from robots that stand in the way


class Navigator:
    """Plans from where the robot is to where it wants to be, and follows."""

    def __init__(self, grid: Grid, radius: float) -> None:
        self.grid = grid
        self._radius = radius
        self._way = grid  # what the path was planned on: the grid, and those who stood in the way
        self.path: Path | None = None
        self._along = 0.0  # m, how far on the path
        self.plans = 0

    def clear(self) -> None:
        """Forget the path."""
        self.path = None

    def take_ground(self, grid: Grid) -> None:
        """Take in that the floor is another; a path that leads through something solid now is forgotten."""
        self.grid = grid
        self._way = grid
        if self.path is not None:
            rest = [self.path.point_at(self._along), *self.path.points[bisect_right(self.path.stations, self._along) :]]
            if not all(line_is_free(grid, a, b) for a, b in pairwise(rest)):
                self.path = None

    def head_for(self, here: Point, goal: Point, standing: Sequence[Point] = ()) -> bool:
        """Plan to a goal, around robots that stand; False where no path is, and the one at hand stays."""
        around = [body for body in standing if distance(body, here) > 2 * self._radius]
        grid = self.grid.with_discs(around, self._radius + BODY_GAP) if around else self.grid
        path = plan(grid, here, goal)
        if path is None:
            return False
        self.path, self._along, self._way = path, 0.0, grid
        self.plans += 1
        return True

    def advance(self, pose: Pose) -> bool:
        """Note where on the path the robot is; False where it strayed too far from it."""
        assert self.path is not None
        self._along = self.path.project(pose.x, pose.y, self._along, within=JUMP)
        return distance(self.path.point_at(self._along), pose) <= STRAYED

    @property
    def remaining(self) -> float:
        """What is left of the path [m]."""
        return self.path.remaining(self._along) if self.path else 0.0

    def ahead(self, reach: float, step: float) -> list[Point]:
        """List points of the path from here on, each ``step`` [m], as far as ``reach`` [m] and the end."""
        if self.path is None:
            return []
        length = min(reach, self.remaining)
        count = int(length / step)
        return [self.path.point_at(self._along + k * step) for k in range(count + 1)]

    def heading_error(self, pose: Pose, seen: float | None, goal: Point) -> float:
        """Give the bearing [rad, left positive] to steer by: the goal's own once seen, else a waypoint's ahead.

        ``seen`` is what the infrared sensor reads for the goal, None where it is out of sight; it is used where the
        straight way is wide enough for the robot too.
        """
        assert self.path is not None
        here = (pose.x, pose.y)
        if seen is not None and line_is_free(self._way, here, goal):
            return seen
        for share in NEARER:
            waypoint = self.path.point_at(self._along + share * AHEAD)
            if line_is_free(self._way, here, waypoint):
                break
        return bearing(pose, waypoint)
