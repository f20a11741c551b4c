"""A robot's own path to its goal."""

from bisect import bisect_right
from collections.abc import Sequence
from itertools import pairwise
from math import ceil

import numpy as np

from swarm.geometry import Pose, distance
from swarm.maps.occupancy import Point
from swarm.planning.grid import Grid
from swarm.planning.path import Path, line_is_free, plan
from swarm.robot.tuning import PILOT, REPLAN


class Navigator:
    """One robot's path to its goal, and how far along it the robot is."""

    def __init__(self, grid: Grid, radius: float, reach: float) -> None:
        self.grid = grid
        self._radius = radius
        self._reach = reach  # m; a goal counts as reached from so far
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
        """Plan a path to a goal around standing robots; return False and keep the old path if there is none.

        If the robot would touch something at the goal, the path ends at the nearest free place within ``reach`` of it.
        """
        around = [body for body in standing if distance(body, here) > 2 * self._radius]
        grid = self.grid.with_discs(around, self._radius + REPLAN.body_gap) if around else self.grid
        path = self._path(grid, here, goal)
        if path is None:
            return False
        self.path, self._along = path, 0.0
        self.plans += 1
        return True

    def leads_to(self, here: Point, goal: Point) -> bool:
        """Return True if there is a path to a goal; the path to follow stays as it is."""
        return self._path(self.grid, here, goal) is not None

    def _path(self, grid: Grid, here: Point, goal: Point) -> Path | None:
        path = plan(grid, here, goal)
        if path is None and not self.grid.is_free(*goal) and (beside := self._free_place_near(goal)) is not None:
            path = plan(grid, here, beside)
        return path

    def _free_place_near(self, goal: Point) -> Point | None:
        """Return the free place nearest to a goal, well within ``reach`` of it."""
        row, column = self.grid.cell_of(*goal)
        within = ceil(self._reach / self.grid.resolution)
        low, left = max(0, row - within), max(0, column - within)
        free = np.argwhere(self.grid.free[low : row + within + 1, left : column + within + 1])
        places = [self.grid.centre_of((low + r, left + c)) for r, c in free.tolist()]
        nearest = min(places, key=lambda place: distance(place, goal), default=None)
        return nearest if nearest is not None and distance(nearest, goal) <= PILOT.well_within * self._reach else None

    def advance(self, pose: Pose) -> bool:
        """Update the progress along the path; return False if the robot is too far from the path."""
        assert self.path is not None
        self._along = self.path.project(pose.x, pose.y, self._along, within=REPLAN.jump)
        return distance(self.path.point_at(self._along), pose) <= REPLAN.strayed

    @property
    def remaining(self) -> float:
        """Length of the rest of the path [m]."""
        return self.path.remaining(self._along) if self.path else 0.0
