"""What a robot does about silent robots: where they may stand, and a look at a cell that only they keep."""

from collections.abc import Collection, Mapping
from typing import Final, NamedTuple

from swarm.geometry import Pose, bearing, distance
from swarm.maps.occupancy import Point
from swarm.messages.traffic import Record, Sighting
from swarm.traffic.interface import TrafficInputs
from swarm.traffic.lattice.cell_map import OUTSIDE, CellMap
from swarm.traffic.obstacles.scan import View, has_gone, is_out_of_range, view
from swarm.traffic.peers.sightings import keeps
from swarm.traffic.peers.situation import Situation
from swarm.traffic.reservations.route import RouteProgress
from swarm.traffic.settings import LEANS, TrafficConstants

FACING: Final = 0.1  # rad, how far off its heading a cell may be for a look
CENTRED: Final = 0.25  # m, how far a robot may be from the middle of its cell for a look


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
        leaning = cells.leaning(progress.head, cell, self._settings.leaning_room)
        leans = distance(leaning, pose) <= LEANS
        if not (leans or distance(middle, pose) <= CENTRED):
            return Inspection()
        place = self._remembered_in(cell, situation, inputs)
        if place is not None:
            if abs(bearing(pose, place)) > FACING:
                return Inspection(place)
            if not leans and is_out_of_range(place, pose, self._settings):
                self.leans_to = cell
                return Inspection()
            return self._seen(cell, cells.centre(cell), empty=False, tick=inputs.tick)
        centre = cells.centre(cell)
        if abs(bearing(pose, centre)) > FACING:
            return Inspection(centre if leans or self.leans_to != cell else None)
        seen = view(inputs.scan.readings, pose, cell, cells, self._settings.radius)
        if seen is View.HIDDEN and not leans:
            self.leans_to = cell
            return Inspection()
        return self._seen(cell, centre, empty=seen is View.EMPTY, tick=inputs.tick)

    def remembered(self, silent: Mapping[str, Record], cells: CellMap) -> frozenset[int]:
        """Return the cells in which silent robots were last heard, except robots seen to have gone."""
        found: set[int] = set()
        for robot, record in silent.items():
            if self._gone.get(robot) != record.stamp:
                found.update(cells.touched(record.x, record.y, self._settings.radius))
        return frozenset(found)

    def still_bodies(
        self, silent: Mapping[str, Record], found: Collection[Point], pose: Pose, cells: CellMap
    ) -> tuple[Point, ...]:
        """Return where bodies stand near the robot [m]: silent robots, and obstacles found before."""
        if not silent and not found:
            return ()
        near = 2 * cells.side
        told = [(record.x, record.y) for robot, record in silent.items() if self._gone.get(robot) != record.stamp]
        return tuple([place for place in (*told, *found) if distance(place, pose) < near])

    def _seen(self, cell: int, centre: Point, *, empty: bool, tick: int) -> Inspection:
        self.leans_to = None
        return Inspection(centre, Sighting(cell, empty, tick))

    def _is_long_silent(self, cell: int, waits: tuple[str, ...], situation: Situation) -> bool:
        """Return True if robots keep a cell, and they and all robots waited for have long been silent."""
        others, oldest = situation.others, situation.tick - self._settings.surmise
        if max([others[robot].stamp for robot in waits], default=-1) >= oldest:
            return False
        keepers = [
            record for robot, record in others.items() if keeps(record, cell) and (robot, cell) not in situation.cleared
        ]
        return bool(keepers) and all(record.stamp < oldest for record in keepers)

    def _remembered_in(self, cell: int, situation: Situation, inputs: TrafficInputs) -> Point | None:
        """Return where a silent robot was last heard with a part of its body in a cell, unless it is seen to have gone.

        A robot that dies or falls asleep while driving comes to rest some way beyond the place that it last told.
        """
        reach = self._settings.radius + self._settings.margin
        for robot, record in situation.others.items():
            place = (record.x, record.y)
            if robot in situation.fresh or self._gone.get(robot) == record.stamp:
                continue
            if cell not in situation.cells.touched(*place, reach):
                continue
            if not has_gone(place, inputs.pose, inputs.scan.readings, self._settings.radius):
                return place
            self._gone[robot] = record.stamp
        return None
