"""A robot's own path to its goal."""

from bisect import bisect_right
from collections.abc import Sequence
from itertools import pairwise
from typing import Final

from swarm.geometry import Pose, distance
from swarm.maps.occupancy import Point
from swarm.planning.grid import Grid
from swarm.planning.path import Path, line_is_free, plan

STRAYED: Final = 0.8  # m off the path: plan anew
JUMP: Final = 2.0  # m, the farthest that progress may leap along the path between two ticks
BODY_GAP: Final = 0.15  # m, kept from robots that stand in the way


class Navigator:
    """Plans from where the robot is to where it wants to be, and follows."""

    def __init__(self, grid: Grid, radius: float) -> None:
        self.grid = grid
        self._radius = radius
        self.path: Path | None = None
        self._along = 0.0  # m, how far on the path
        self.plans = 0

    def clear(self) -> None:
        """Forget the path."""
        self.path = None

    def take_ground(self, grid: Grid) -> None:
        """Take in that the floor is another; a path that leads through something solid now is forgotten."""
        self.grid = grid
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
        self.path, self._along = path, 0.0
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
