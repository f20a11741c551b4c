"""What a robot does about silent robots: where they may stand, and a look at a cell that only they keep."""

from collections.abc import Collection, Iterable, Mapping
from enum import Enum
from math import cos, inf, pi, sin, sqrt
from typing import Final, NamedTuple

from swarm.geometry import Pose, bearing, distance, wrap
from swarm.maps.occupancy import Disc, Point
from swarm.messages.traffic import Record, Sighting
from swarm.traffic.interface import TrafficInputs
from swarm.traffic.lattice.cell_map import OUTSIDE, CellMap
from swarm.traffic.obstacles.scan import EDGE, Reading
from swarm.traffic.peers.sightings import has_reserved
from swarm.traffic.peers.situation import Situation
from swarm.traffic.reservations.route import RouteProgress
from swarm.traffic.settings import LEANS, TrafficConstants

FACING: Final = 0.1  # rad, how far off its heading a cell may be for a look
CENTRED: Final = 0.25  # m, how far a robot may be from the middle of its cell for a look
SHORT: Final = 0.05  # m; readings that differ by less count as equal
HIT: Final = 0.8  # of a body's radius; a ray that passes its middle nearer hits it for sure


class Inspection(NamedTuple):
    """The result of one look."""

    face: Point | None = None  # m, the point to turn to first
    seen: Sighting | None = None


class Inspector:
    """Looks at cells that only silent robots keep, for one robot."""

    def __init__(self, settings: TrafficConstants) -> None:
        self.leans_to: int | None = None  # the cell that cannot be judged from the middle of this one
        self._settings = settings
        self._gone: dict[str, int] = {}  # robots that left where they were heard last -> stamp of that record

    def inspect(
        self, progress: RouteProgress, situation: Situation, waits: tuple[str, ...], inputs: TrafficInputs
    ) -> Inspection:
        """Turn to the next cell if only robots long silent keep it, and judge it by what the rays show."""
        cell, pose, cells = progress.route[0] if progress.route else OUTSIDE, inputs.pose, situation.cells
        wants = bool(waits) or self.leans_to == cell  # a robot that leans to look may not be heard: it claims nothing
        if not wants or len(progress.reservations.held) > 1 or not self._is_long_silent(cell, waits, situation):
            self.leans_to = None
            return Inspection()
        middle = cells.centre(progress.head)
        leaning = cells.leaning_point(progress.head, cell, self._settings.leaning_room)
        leans = distance(leaning, pose) <= LEANS
        if not (leans or distance(middle, pose) <= CENTRED):
            return Inspection()
        body = self._last_body_in(cell, situation, inputs)
        if body is not None:
            if abs(bearing(pose, body)) > FACING:
                return Inspection(body[:2])
            if not leans and is_out_of_range(body, pose, self._settings):
                self.leans_to = cell
                return Inspection()
            return self._report_sighting(cell, cells.centre(cell), empty=False, tick=inputs.tick)
        centre = cells.centre(cell)
        if abs(bearing(pose, centre)) > FACING:
            return Inspection(centre if leans or self.leans_to != cell else None)
        seen = judge_cell(inputs.scan.readings, pose, cell, cells, self._settings)
        if seen is View.HIDDEN and not leans:
            self.leans_to = cell
            return Inspection()
        return self._report_sighting(cell, centre, empty=seen is View.EMPTY, tick=inputs.tick)

    def cells_of_silent(self, silent: Mapping[str, Record], cells: CellMap) -> frozenset[int]:
        """Return the cells in which silent robots were last heard, except robots seen to have gone."""
        found: set[int] = set()
        for robot, record in silent.items():
            if self._gone.get(robot) != record.stamp:
                found.update(cells.cells_under_disc(record.x, record.y, self._settings.radius_of(record)))
        return frozenset(found)

    def still_bodies(
        self, silent: Mapping[str, Record], found: Collection[Point], pose: Pose, cells: CellMap
    ) -> tuple[Disc, ...]:
        """Return the bodies that stand near the robot: silent robots, and obstacles found before, of its own size."""
        if not silent and not found:
            return ()
        near = 2 * cells.side
        settings = self._settings
        told = [
            (record.x, record.y, settings.radius_of(record))
            for robot, record in silent.items()
            if self._gone.get(robot) != record.stamp
        ]
        return tuple(
            [disc for disc in (*told, *((x, y, settings.radius) for x, y in found)) if distance(disc, pose) < near]
        )

    def _report_sighting(self, cell: int, centre: Point, *, empty: bool, tick: int) -> Inspection:
        self.leans_to = None
        return Inspection(centre, Sighting(cell, empty, tick))

    def _is_long_silent(self, cell: int, waits: tuple[str, ...], situation: Situation) -> bool:
        """Return True if robots keep a cell, and they and all robots waited for have long been silent."""
        others, oldest = situation.others, situation.tick - self._settings.surmise
        if max([others[robot].stamp for robot in waits], default=-1) >= oldest:
            return False
        keepers = [
            record
            for robot, record in others.items()
            if has_reserved(record, cell) and (robot, cell) not in situation.cleared
        ]
        return bool(keepers) and all(record.stamp < oldest for record in keepers)

    def _last_body_in(self, cell: int, situation: Situation, inputs: TrafficInputs) -> Disc | None:
        """Return the body of a silent robot that was last heard with a part in a cell, unless it is seen to have gone.

        A robot that dies or falls asleep while driving comes to rest some way beyond the place that it last told.
        """
        for robot, record in situation.others.items():
            body = record.x, record.y, self._settings.radius_of(record)
            if robot in situation.fresh or self._gone.get(robot) == record.stamp:
                continue
            if cell not in situation.cells.cells_under_disc(*body[:2], body[2] + self._settings.margin):
                continue
            if not has_gone(body, inputs.pose, inputs.scan.readings, self._settings.radius):
                return body
            self._gone[robot] = record.stamp
        return None


class View(Enum):
    """What a robot sees of the next cell."""

    EMPTY = "empty"
    OCCUPIED = "occupied"
    HIDDEN = "hidden"  # something stands before it


def judge_cell(readings: Iterable[Reading], pose: Pose, cell: int, cells: CellMap, settings: TrafficConstants) -> View:
    """Judge a cell by the rays that cross it, each from the robot's edge to the end of its range.

    A ray that ends in the cell for lack of range, and not at a wall, does not show what is behind its end.
    """
    radius, reach = settings.radius, settings.radius + settings.sensor_range
    through = hidden = 0
    for reading in readings:
        enters, leaves = _crossing(pose, reading.bearing, cells.centre(cell), cells.side)
        wall = radius + reading.expected
        if leaves <= enters or wall <= enters:
            continue  # the ray misses the cell, or a wall of the map is in front of the cell
        hit = radius + reading.measured
        if hit >= min(leaves, wall) - SHORT:
            if leaves > reach + SHORT and wall >= reach:
                hidden += 1
            else:
                through += 1
        elif hit >= enters - EDGE:
            return View.OCCUPIED
        else:
            hidden += 1
    return View.EMPTY if through > hidden else View.HIDDEN


def has_gone(body: Disc, pose: Pose, readings: Iterable[Reading], own_radius: float) -> bool:
    """Return True if a ray points at where a body was, and sees beyond its near edge.

    ``own_radius`` [m] is that of the robot that looks, from whose edge rays begin.
    """
    radius = body[2]
    away, direction = distance(pose, body), bearing(pose, body)
    for reading in readings:
        off = wrap(direction - reading.bearing)
        beside = away * abs(sin(off))
        if abs(off) > pi / 2 or beside > HIT * radius:
            continue
        near_edge = away * cos(off) - sqrt(radius**2 - beside**2) - own_radius
        if reading.measured > near_edge + 2 * SHORT:
            return True
    return False


def is_out_of_range(body: Disc, pose: Pose, settings: TrafficConstants) -> bool:
    """Return True if a body is so far away that no ray shows whether it has gone."""
    near_edge = distance(pose, body) - settings.radius - sqrt(1 - HIT**2) * body[2]  # m, the farthest hit on it
    return near_edge + 2 * SHORT > settings.sensor_range


def _crossing(pose: Pose, off: float, centre: Point, side: float) -> tuple[float, float]:
    """Return how far [m] from the robot's centre a ray enters a square, and how far it leaves it."""
    enters, leaves = 0.0, inf
    heading = pose.yaw + off
    for start, middle, slope in ((pose.x, centre[0], cos(heading)), (pose.y, centre[1], sin(heading))):
        low, high = middle - side / 2 - start, middle + side / 2 - start
        if abs(slope) < 1e-9:
            if not low <= 0.0 <= high:
                return inf, 0.0
            continue
        near, far = sorted((low / slope, high / slope))
        enters, leaves = max(enters, near), min(leaves, far)
    return enters, leaves
