"""A robot's own path to its goal."""

from bisect import bisect_right
from collections.abc import Sequence
from itertools import pairwise

from swarm.geometry import Pose, distance
from swarm.maps.occupancy import Point
from swarm.planning.grid import Grid
from swarm.planning.path import Path, line_is_free, plan
from swarm.robot.tuning import REPLAN


class Navigator:
    """One robot's path to its goal, and how far along it the robot is."""

    def __init__(self, grid: Grid, radius: float) -> None:
        self.grid = grid
        self._radius = radius
        self.path: Path | None = None
        self._along = 0.0  # m, progress along the path
        self.plans = 0

    def clear(self) -> None:
        """Forget the path."""
        self.path = None

    def take_ground(self, grid: Grid) -> None:
        """Replace the grid; forget the path if it now leads through something solid."""
        self.grid = grid
        if self.path is not None:
            rest = [self.path.point_at(self._along), *self.path.points[bisect_right(self.path.stations, self._along) :]]
            if not all(line_is_free(grid, a, b) for a, b in pairwise(rest)):
                self.path = None

    def head_for(self, here: Point, goal: Point, standing: Sequence[Point] = ()) -> bool:
        """Plan a path to a goal around standing robots; return False and keep the old path if there is none."""
        around = [body for body in standing if distance(body, here) > 2 * self._radius]
        grid = self.grid.with_discs(around, self._radius + REPLAN.body_gap) if around else self.grid
        path = plan(grid, here, goal)
        if path is None:
            return False
        self.path, self._along = path, 0.0
        self.plans += 1
        return True

    def advance(self, pose: Pose) -> bool:
        """Update the progress along the path; return False if the robot is too far from the path."""
        assert self.path is not None
        self._along = self.path.project(pose.x, pose.y, self._along, within=REPLAN.jump)
        return distance(self.path.point_at(self._along), pose) <= REPLAN.strayed

    @property
    def remaining(self) -> float:
        """Length of the rest of the path [m]."""
        return self.path.remaining(self._along) if self.path else 0.0
