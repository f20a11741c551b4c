"""Driving inside held cells: the fuzzy controller's wheel speeds, changed as little as keeps the footprint in them.

The cells that are not held are walls to this robot, beside those of the map. Wheel speeds pass when the way they lead,
for a while and then under the brake, stays clear of both; else the same arc slower; else a blend towards the aim, the
least that does; else the brake. A robot that faces away from its aim turns on the spot first, since a round footprint
sweeps nothing then.
"""

from collections.abc import Callable, Collection, Sequence
from enum import Enum
from math import copysign, cos, hypot, inf, sin, sqrt
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm.geometry import Pose, Twist, bearing, distance
from swarm.maps.occupancy import ORIGIN, Point
from swarm.planning.grid import Grid
from swarm.planning.path import line_is_free
from swarm.robot.kinematics import DifferentialDrive
from swarm.robot.lookahead import least_clearance
from swarm.traffic.cells import OUTSIDE, CellMap
from swarm.traffic.settings import NEAR
from swarm.traffic.sweep import NO_COMMANDS, braking_points, first_clear, lines_are_clear, path_room

TURN_FROM: Final = 1.3  # rad, off the aim: turn on the spot
TURN_UNTIL: Final = 0.07  # rad
BEHIND: Final = 2.0  # rad, off the aim: between walls the paper's tables would drive on, and away from it
ABOUT: Final = 2.6  # rad, off the aim: to turn either way is as good
TURN_RATE: Final = 2.5  # rad/s at most on the spot
STILL_FAST: Final = 1.5  # rad/s; who turns so fast when it faces its aim already has its commands come late,
CAREFUL: Final = 20.0  # s for which it then drives with care:
SETTLING: Final = 5.0  # 1/s, turn per heading error at most,
STOPPING: Final = 3.0  # 1/s, and speed per distance left
LOOK: Final = 0.4  # s, that far a command is looked ahead before the brake
AT_AIM: Final = 0.05  # m; what is nearer is no aim
AIM_SPARE: Final = 0.04  # m, kept from cells not held on the straight way to an aim
SHARES: Final = (0.75, 0.5, 0.25)  # of the way from the middle of the cell it is in to the next waypoint
SLOW_BRAKE: Final = 0.6  # share of the braking power planned with when coming to a stop
PURSUIT: Final = 3.0  # 1/s, yaw rate per heading error of the blend
GAP: Final = 0.1  # m, kept to whatever is seen ahead

TIGHT: Final = 0.01  # m, room enough out of a corner into which somebody was pushed,
CREEP: Final = 0.12  # m/s, as slow as that,
DETOURS: Final = (0.0, 0.25, -0.25, 0.5, -0.5, 0.75, -0.75, 1.0, -1.0, 1.25, -1.25)  # rad, so far off the aim

# (share of the speed, blend towards the aim), mildest first; those with no blend keep the tables' own ratio
CHANGES: Final = np.array((
    (1.0, 0.0), (0.7, 0.0), (0.45, 0.0), (1.0, 0.25), (0.6, 0.25), (1.0, 0.5), (0.6, 0.5), (0.3, 0.0),
    (1.0, 0.75), (0.6, 0.75), (1.0, 1.0), (0.5, 1.0), (0.25, 1.0),
))  # fmt: skip


NO_BODIES: Final = np.empty((0, 2))
NOWHERE: Final = np.empty((0, 2))  # m; a body that stands needs no way to come to rest
NO_WALLS: Final = np.empty((0, 0), np.float32)


RimSpeeds = tuple[float, float]  # left, right [m/s]


class Whose(Enum):
    """Whose the ratio of the wheel speeds is."""

    TABLES = "tables"
    BLEND = "blend"
    TURN = "turn"  # on the spot
    REST = "rest"


class Wheels(NamedTuple):
    """Rim speeds [m/s]."""

    left: float
    right: float
    whose: Whose


class Body(NamedTuple):
    """Where a robot is and how its wheels turn now."""

    pose: Pose
    left: float  # m/s, rim speed
    right: float


class Driver:
    """Keeps one robot's footprint in the cells it holds. It remembers only how it turns on the spot."""

    def __init__(
        self,
        cells: CellMap,
        drive: DifferentialDrive,
        *,
        radius: float,
        margin: float,
        acceleration: float,
        dt: float,
        fastest: float,
        grid: Grid | None = None,
    ) -> None:
        self.grid = grid  # of the floor as it is known now; None: the cells are free all over
        self.bodies = NO_BODIES  # m, (n, 2): those in the cell it is in
        self._cells = cells
        self._drive = drive
        self._radius = radius
        self._margin = margin  # m, between the footprint and what is not held
        self._acceleration = acceleration  # m/s2, of a rim speed
        self._dt = dt
        self._ticks = max(1, round(LOOK / dt))
        self._fastest = fastest  # m/s, of the blend
        x, y, yaw = cells.occupancy.origin
        self._origin = (x, y, cos(yaw), sin(yaw))
        self._aimed_for: tuple[object, ...] = ()  # what the last aim was chosen for: one who stands asks again
        self._aimed: Point = (0.0, 0.0)
        self._turning = False
        self._side = 0.0  # of the turn on the spot it was last told to make; 0: none
        self._careful = 0  # ticks for which it drives with care
        self._shut_for: tuple[tuple[int, ...], NDArray[np.float64]] = ((), np.empty((0, 4)))

    def take_cells(self, cells: CellMap) -> None:
        """Take another floor, on the same lattice."""
        self._cells = cells

    def braking(self, body: Body, under_way: Sequence[RimSpeeds] = ()) -> NDArray[np.float64]:
        """Return the points ((n, 2), m) on which the body would come to rest, to keep the cells under them.

        ``under_way`` are the newest commands, oldest first, of which any number may still be carried out.
        """
        if body.left == body.right == 0.0 and not any(map(any, under_way)):
            return NOWHERE
        commands = np.array(under_way, np.float64) if under_way else NO_COMMANDS
        return braking_points(
            *body.pose, body.left, body.right, self._drive.track_width, self._acceleration, self._dt, commands
        )

    def aim(self, pose: Pose, held: Sequence[int], waypoints: Sequence[Point]) -> Point:
        """Choose the farthest point that the footprint reaches straight through held cells, at no edge nearer.

        It is a waypoint, or lies between the first, the middle of the cell it is in, and the second.
        """
        asked = (pose, self.grid, tuple(held), tuple(waypoints))
        if asked != self._aimed_for:
            self._aimed_for, self._aimed = asked, self._aim(*asked)
        return self._aimed

    def _aim(self, pose: Pose, grid: Grid | None, held: tuple[int, ...], waypoints: tuple[Point, ...]) -> Point:
        shut = self._shut(held)
        x, y, _ = self._local(pose)
        (x0, y0), (x1, y1) = waypoints[0], waypoints[min(1, len(waypoints) - 1)]
        between = [(x0 + share * (x1 - x0), y0 + share * (y1 - y0)) for share in SHARES]
        last = self._cells.cell_of(*waypoints[-1])  # its middle can be reached where a place beside it cannot
        middle = [self._cells.centre(last)] if last != OUTSIDE and len(waypoints) > 1 else []
        ways = [*reversed(waypoints[1:]), *middle, *between]
        points = [point for point in ways if distance(pose, point) > AT_AIM] or [waypoints[0]]
        places = np.array([self._flat(point) for point in points], np.float64)
        for spare in (AIM_SPARE, TIGHT):  # beside a wall that leaves no more room, the next cell is still to be reached
            clear = lines_are_clear(shut, x, y, places, self._radius + TIGHT, self._radius + spare)
            for point, is_clear in zip(points, clear, strict=True):
                if is_clear and (grid is None or line_is_free(grid, (pose.x, pose.y), point, spare)):
                    return point
        return waypoints[0]

    def faces_away(self, error: float) -> bool:
        """Tell whether an aim so far off the heading [rad] is to be turned to on the spot, though nobody is near."""
        self._turning = abs(error) > (TURN_UNTIL if self._turning else BEHIND)
        return self._turning

    def wheels(
        self,
        body: Body,
        held: Sequence[int],
        aim: Point,
        *,
        stop_at: float,
        tables: tuple[float, float],
        free: float = inf,
        may_drive: bool = True,
    ) -> Wheels:
        """Turn the tables' rim speeds [m/s] into ones that keep the footprint in the held cells.

        ``stop_at`` [m] is how far ahead the robot has to stand at the latest, ``free`` how far off a body ahead is;
        ``may_drive`` False lets it only turn.
        """
        error = bearing(body.pose, aim)
        if stop_at <= NEAR:
            return self._rest()
        turned, self._turning = self._turning, abs(error) > (TURN_UNTIL if self._turning else TURN_FROM)
        late = turned and not self._turning and abs(self._drive.twist(body.left, body.right).angular) > STILL_FAST
        self._careful = round(CAREFUL / self._dt) if late else max(0, self._careful - 1)
        room = min(stop_at, (free - GAP) / SLOW_BRAKE)
        if self._turning or not may_drive or room <= 0.0:
            return self._turn(body, error)
        wanted = self._drive.twist(*tables)
        most = min(sqrt(2 * SLOW_BRAKE * self._acceleration * room), STOPPING * room if self._careful else inf)
        pursuit = Twist(self._fastest * max(0.2, cos(2 * error)), max(-TURN_RATE, min(TURN_RATE, PURSUIT * error)))
        shut = self._shut(held)
        here = self._room(shut, body, 0.0, 0.0, 0)
        here -= 1e-3 if here > self._radius + TIGHT else 0.0  # near the edge no look may lose any room
        grid = self.grid
        walls, side, origin = (NO_WALLS, 1.0, ORIGIN) if not grid else (grid.clearance, grid.resolution, grid.origin)
        number, left, right = first_clear(
            CHANGES, *wanted, *pursuit, most, min(self._radius + self._margin, here), shut, *self._local(body.pose),
            walls, side, *origin, self.bodies, self._radius, *body.pose, body.left, body.right,
            self._drive.track_width, self._acceleration * self._dt, self._dt, self._ticks,
        )  # fmt: skip
        if number >= 0:
            return Wheels(left, right, Whose.BLEND if CHANGES[int(number), 1] else Whose.TABLES)
        return self._creep(body, shut, error, min(self._radius + TIGHT, here))

    def _creep(self, body: Body, shut: NDArray[np.float64], error: float, need: float) -> Wheels:
        """Get out of a corner: turn to the way nearest the aim that leaves the room needed, and creep along it."""
        for off in DETOURS:
            x, y, yaw = body.pose
            if self._room(shut, Body(Pose(x, y, yaw + error + off), 0.0, 0.0), CREEP, CREEP, self._ticks) < need:
                continue
            if abs(error + off) > TURN_UNTIL:
                return self._turn(body, error + off)
            return Wheels(CREEP, CREEP, Whose.BLEND)
        return self._rest()

    def room_in(self, pose: Pose, held: Sequence[int]) -> Callable[[RimSpeeds, RimSpeeds], float]:
        """Make the measure of the room in held cells [m] that rim speeds now and those wanted leave the centre."""
        shut = self._shut(held)
        return lambda now, wanted: self._cell_room(shut, Body(pose, *now), wanted, self._ticks)

    def face(self, body: Body, point: Point) -> Wheels:
        """Turn to a point without driving."""
        return self._turn(body, bearing(body.pose, point))

    def _rest(self) -> Wheels:
        self._turning = False
        return Wheels(0.0, 0.0, Whose.REST)

    def _turn(self, body: Body, error: float) -> Wheels:
        """Brake first; then turn as fast as can be stopped in time: sqrt(2 a e) on the rim."""
        if abs(body.left + body.right) > 0.04:
            return Wheels(0.0, 0.0, Whose.TURN)
        if abs(error) > ABOUT and self._side * error < 0.0:
            error = -error  # as good a way round, and the one it is on; what the wheels do now may be an old command's
        self._side = copysign(1.0, error)
        angular_brake = 2 * SLOW_BRAKE * self._acceleration / (self._drive.track_width / 2)
        left = max(0.0, abs(error) - TURN_UNTIL / 2)
        rate = min(TURN_RATE, sqrt(angular_brake * left), SETTLING * left if self._careful else inf)
        return Wheels(*self._drive.rim_speeds(Twist(0.0, copysign(rate, error))), Whose.TURN)

    # ---- cells as boxes, in the lattice's own frame

    def _flat(self, point: Point) -> Point:
        (x, y), (x0, y0, c, s) = point, self._origin
        return c * (x - x0) + s * (y - y0), c * (y - y0) - s * (x - x0)

    def _local(self, pose: Pose) -> tuple[float, float, float]:
        x, y, yaw = pose
        return *self._flat((x, y)), yaw - self._cells.occupancy.origin.yaw

    def _shut(self, held: Collection[int]) -> NDArray[np.float64]:
        """List the cells beside held ones that are not held themselves: (n, 4) of low x, low y, high x, high y [m]."""
        cells, held = self._cells, tuple(held)
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

    def _room(
        self,
        shut: NDArray[np.float64],
        body: Body,
        left: float,
        right: float,
        ticks: int,
    ) -> float:
        """Give the least distance [m] of the centre to what is shut or solid, driving so and then braking."""
        room = self._cell_room(shut, body, (left, right), ticks)
        if self.grid is None:
            return room
        walls = least_clearance(
            self.grid, body.pose, (body.left, body.right), (left, right), self.bodies, body_radius=self._radius,
            track_width=self._drive.track_width, acceleration=self._acceleration, dt=self._dt, ticks=ticks,
        )  # fmt: skip
        return min(room, walls)

    def _cell_room(self, shut: NDArray[np.float64], body: Body, wanted: RimSpeeds, ticks: int) -> float:
        return path_room(
            shut, *self._local(body.pose), body.left, body.right, *wanted,
            self._drive.track_width, self._acceleration * self._dt, self._dt, ticks,
        )  # fmt: skip


def distance_along(pose: Pose, waypoints: Sequence[Point]) -> float:
    """Measure from a pose over the waypoints beyond the first to the last [m]."""
    here, length = (pose.x, pose.y), 0.0
    for point in waypoints[1:] or waypoints:
        length += hypot(point[0] - here[0], point[1] - here[1])
        here = point
    return length
