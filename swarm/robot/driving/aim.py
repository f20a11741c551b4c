"""The aim: the farthest point of the way that the footprint reaches in a straight line through held cells.

The fuzzy tables know only the aim, not the way. Here, cells that the robot does not hold count as walls.
"""

from collections.abc import Collection, Iterable, Iterator, Sequence
from math import cos, hypot, sin

import numpy as np
from numpy.typing import NDArray

from swarm.geometry import Pose, from_frame
from swarm.maps.occupancy import Point
from swarm.motion.drive import line_is_clear
from swarm.planning.grid import Grid
from swarm.planning.path import line_is_free, plan
from swarm.robot.tuning import AIM, SAFETY
from swarm.traffic.interface import TrafficOutputs
from swarm.traffic.lattice.cell_map import OUTSIDE, CellMap
from swarm.traffic.settings import NEAR


class Aiming:
    """Chooses the points that one robot steers to; its footprint has a ``radius`` [m]. The last answer is cached.

    ``lattice`` are cells of any floor: only where they lie counts, which stays the same for a whole run.
    """

    def __init__(self, lattice: CellMap, radius: float) -> None:
        self._lattice = lattice
        self._radius = radius
        x, y, yaw = lattice.occupancy.origin
        self._origin = (x, y, cos(yaw), sin(yaw))
        self._aimed_for: tuple[object, ...] = ()
        self._aimed: Point = (0.0, 0.0)
        self._shut_for: tuple[tuple[int, ...], NDArray[np.float64]] = ((), np.empty((0, 4)))

    def choose(
        self, grid: Grid | None, pose: Pose, held: Sequence[int], waypoints: Sequence[Point], uncertainty: float = 0.0
    ) -> Point:
        """Return the farthest point [m] that the footprint reaches in a straight line through held cells.

        The aim is a waypoint, the centre of the last cell, or a point between the first two waypoints. The first
        waypoint is the centre of the robot's cell. If nothing of that is reached, the aim is another point in the cell
        of a later waypoint, else a point of a path over the floor to one, else that centre. ``grid`` is the floor as
        the robot knows it now; with None the whole area of every cell is free. The footprint may be off by
        ``uncertainty`` [m].
        """
        asked = (pose, grid, tuple(held), tuple(waypoints), uncertainty)
        if asked != self._aimed_for:
            self._aimed_for, self._aimed = asked, self._choose(*asked)
        return self._aimed

    def _choose(
        self, pose: Pose, grid: Grid | None, held: tuple[int, ...], waypoints: tuple[Point, ...], uncertainty: float
    ) -> Point:
        shut = self.shut_boxes(held)
        x, y, _ = self.to_lattice_frame(pose)
        (x0, y0), (x1, y1) = waypoints[0], waypoints[min(1, len(waypoints) - 1)]
        between = [(x0 + share * (x1 - x0), y0 + share * (y1 - y0)) for share in AIM.shares]
        last = self._lattice.cell_of(*waypoints[-1])  # its centre may be free where a point beside it is not
        middle = [self._lattice.centre(last)] if last != OUTSIDE and len(waypoints) > 1 else []
        ways = [*reversed(waypoints[1:]), *middle, *between]
        here_x, here_y, _ = pose

        def is_far(point: Point) -> bool:
            return hypot(point[0] - here_x, point[1] - here_y) > AIM.nearest

        def find_reached(points: Iterable[Point], spare: float, off: float, *, tight: bool) -> Point | None:
            radius = self._radius + off
            least, enough = radius + AIM.tight_gap, radius + (spare if tight else max(spare, SAFETY.gap))
            for point in points:
                clear = line_is_clear(shut, x, y, *self._flat(point), least, enough)
                if clear and (grid is None or line_is_free(grid, (here_x, here_y), point, spare)):
                    return point
            return None

        far = list(filter(is_far, ways)) or [waypoints[0]]
        for tight in (False, True):  # the safety filter lets it come no nearer to cells that it does not hold
            for off in (uncertainty, 0.0) if uncertainty else (0.0,):  # an aim that it may miss is better than none
                for spare in (AIM.gap, AIM.tight_gap):
                    if (aim := find_reached(far, spare, off, tight=tight)) is not None:
                        return aim
            for points in (filter(is_far, self._entries(pose, waypoints[1:])), waypoints[:1]):
                if (aim := find_reached(points, AIM.tight_gap, 0.0, tight=tight)) is not None:
                    return aim
        return next(filter(is_far, self._points_back_to_way(grid, (here_x, here_y), waypoints)), waypoints[0])

    def _entries(self, pose: Pose, waypoints: Sequence[Point]) -> Iterator[Point]:
        """Yield points of the waypoints' cells [m], last cell first: its nearest point, then some nearer its middle.

        A robot that used a cell beside its way as room may see no waypoint from there. If that cell is half wall, its
        middle is no place to drive to.
        """
        x, y, _ = self.to_lattice_frame(pose)
        cells, room = self._lattice, max(0.0, self._lattice.side / 2 - self._radius - AIM.tight_gap)
        for cell in (cells.cell_of(*point) for point in reversed(waypoints)):
            if cell == OUTSIDE:
                continue
            u, v = self._flat(cells.centre(cell))
            along, up = min(max(x - u, -room), room), min(max(y - v, -room), room)
            for share in (1.0, *AIM.shares):
                yield from_frame(cells.occupancy.origin, u + share * along, v + share * up)

    def _points_back_to_way(self, grid: Grid | None, here: Point, waypoints: Sequence[Point]) -> Iterator[Point]:
        """Yield points in sight on a path over the floor to the next waypoint off the walls [m], the farthest first.

        A robot beside its way, behind a corner, may have to drive through cells that it does not hold yet.
        """
        if grid is None:
            return
        path = next(filter(None, (plan(grid, here, waypoint) for waypoint in waypoints[1:])), None)
        for point in reversed(path.points if path is not None else ()):
            if line_is_free(grid, here, point, AIM.tight_gap):
                yield point

    def beyond(self, grid: Grid, pose: Pose, cells: Sequence[int], aim: Point) -> Point:
        """Return the farthest of the cells' centres [m] that no wall hides, or the aim if walls hide all of them."""
        for cell in reversed(cells):
            point = self._lattice.centre(cell)
            if line_is_free(grid, (pose.x, pose.y), point, AIM.gap):
                return point
        return aim

    def sticks_out(self, pose: Pose, granted: TrafficOutputs, room: float) -> bool:
        """Return True if the body reaches a little into the cell behind it: robots would wait for each other's rims.

        ``room`` [m] is what it keeps around its centre. Only cells hardly larger than the body let a robot stand near
        the middle of its cell and yet not inside. The result is False before an unexpected obstacle.
        """
        if self._lattice.side / 2 - room >= NEAR or len(granted.held) == 1 or granted.threats:
            return False
        return any(cell != granted.way[0] for cell in self._lattice.cells_under_disc(pose.x, pose.y, room))

    # ---- cells as boxes, in the lattice's own frame

    def _flat(self, point: Point) -> Point:
        x0, y0, c, s = self._origin
        x, y = point[0] - x0, point[1] - y0
        return c * x + s * y, c * y - s * x

    def to_lattice_frame(self, pose: Pose) -> Pose:
        """Return a pose in the lattice's own frame."""
        x, y, yaw = pose
        return Pose(*self._flat((x, y)), yaw - self._lattice.occupancy.origin.yaw)

    def shut_boxes(self, held: Collection[int]) -> NDArray[np.float64]:
        """Return the cells beside held ones that are not held: (n, 4) of low x, low y, high x, high y [m, lattice]."""
        cells, held = self._lattice, tuple(held)
        if held == self._shut_for[0]:
            return self._shut_for[1]
        side, columns, (x0, y0) = cells.side, cells.columns, cells.offset
        mine = {divmod(cell, columns) for cell in held}
        beside = sorted(
            {
                (row + i, column + j)
                for row, column in mine
                for i in (-1, 0, 1)
                for j in (-1, 0, 1)
                if (row + i, column + j) not in mine
            }
        )
        corner = np.array([(x0 + column * side, y0 + row * side) for row, column in beside], np.float64)
        self._shut_for = held, np.hstack([corner, corner + side])
        return self._shut_for[1]


def distance_along(pose: Pose, waypoints: Sequence[Point]) -> float:
    """Return the length [m] of the line from a pose through all waypoints after the first one."""
    here, length = (pose.x, pose.y), 0.0
    for point in waypoints[1:] or waypoints:
        length += hypot(point[0] - here[0], point[1] - here[1])
        here = point
    return length
