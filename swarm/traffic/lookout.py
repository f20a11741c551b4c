"""What a robot makes of silent robots: where they may stand, and a look at a cell that only they keep."""

from collections.abc import Collection, Mapping
from typing import Final, NamedTuple

from swarm.geometry import Pose, bearing, distance
from swarm.maps.occupancy import Point
from swarm.messages.traffic import Record, Sighting
from swarm.traffic.cells import OUTSIDE, CellMap
from swarm.traffic.claiming import LEANS
from swarm.traffic.interface import TrafficInputs
from swarm.traffic.look import View, has_gone, is_out_of_range, view
from swarm.traffic.route_progress import RouteProgress
from swarm.traffic.settings import TrafficSettings
from swarm.traffic.sightings import keeps
from swarm.traffic.situation import Situation

FACING: Final = 0.1  # rad, off the cell looked at
CENTRED: Final = 0.25  # m, off the middle of the cell looked from


class Look(NamedTuple):
    """What one look decides."""

    face: Point | None = None  # m, turn to this before anything else
    seen: Sighting | None = None


class Lookout:
    """Looks at cells that only silent robots keep, for one robot."""

    def __init__(self, cells: CellMap, settings: TrafficSettings) -> None:
        self.cells = cells
        self.leans_to: int | None = None  # the cell that cannot be judged from the middle of this one
        self._settings = settings
        self._gone: dict[str, int] = {}  # silent robots that are not where they said last, and when they said it

    def look(
        self, progress: RouteProgress, situation: Situation, waits: tuple[str, ...], inputs: TrafficInputs
    ) -> Look:
        """Turn to the next cell when only robots long silent keep it, and judge it by what the rays see."""
        cell, pose = progress.route[0] if progress.route else OUTSIDE, inputs.pose
        wants = bool(waits) or self.leans_to == cell  # where it leans to look it may not be heard: it asks for nothing
        if not wants or len(progress.reservations.held) > 1 or not self._is_long_silent(cell, waits, situation):
            self.leans_to = None
            return Look()
        middle, leaning = (
            self.cells.centre(progress.head),
            self.cells.leaning(progress.head, cell, self._settings.leaning_room),
        )
        leans = distance(leaning, pose) <= LEANS
        if not (leans or distance(middle, pose) <= CENTRED):
            return Look()
        place = self._remembered_in(cell, situation, inputs)
        if place is not None:
            if abs(bearing(pose, place)) > FACING:
                return Look(place)
            if not leans and is_out_of_range(place, pose, self._settings):
                self.leans_to = cell
                return Look()
            return self._seen(cell, empty=False, tick=inputs.tick)
        centre = self.cells.centre(cell)
        if abs(bearing(pose, centre)) > FACING:
            return Look(centre if leans or self.leans_to != cell else None)
        seen = view(inputs.scan.readings, pose, cell, self.cells, self._settings.radius)
        if seen is View.HIDDEN and not leans:
            self.leans_to = cell
            return Look()
        return self._seen(cell, empty=seen is View.EMPTY, tick=inputs.tick)

    def remembered(self, silent: Mapping[str, Record]) -> frozenset[int]:
        """Return the cells that silent robots were in when they spoke last, but for those seen to have gone."""
        found: set[int] = set()
        for robot, record in silent.items():
            if self._gone.get(robot) != record.stamp:
                found.update(self.cells.touched(record.x, record.y, self._settings.radius))
        return frozenset(found)

    def still_bodies(self, silent: Mapping[str, Record], found: Collection[Point], pose: Pose) -> tuple[Point, ...]:
        """Return where bodies stand near the robot that nobody speaks for: silent robots, and things found [m]."""
        if not silent and not found:
            return ()
        near = 2 * self.cells.side
        told = [(record.x, record.y) for robot, record in silent.items() if self._gone.get(robot) != record.stamp]
        return tuple([place for place in (*told, *found) if distance(place, pose) < near])

    def _seen(self, cell: int, *, empty: bool, tick: int) -> Look:
        self.leans_to = None
        return Look(self.cells.centre(cell), Sighting(cell, empty, tick))

    def _is_long_silent(self, cell: int, waits: tuple[str, ...], situation: Situation) -> bool:
        """Return True if robots keep a cell, and all of them, and all waited for, have been silent for long."""
        others, oldest = situation.others, situation.tick - self._settings.surmise
        if max([others[robot].stamp for robot in waits], default=-1) >= oldest:
            return False
        keepers = [
            record for robot, record in others.items() if keeps(record, cell) and (robot, cell) not in situation.cleared
        ]
        return bool(keepers) and all(record.stamp < oldest for record in keepers)

    def _remembered_in(self, cell: int, situation: Situation, inputs: TrafficInputs) -> Point | None:
        """Return where a silent robot was last heard with a part of its body in a cell, unless it is seen to have gone.

        Who dies or falls asleep while driving comes to rest some way beyond the place that it last told.
        """
        reach = self._settings.radius + self._settings.margin
        for robot, record in situation.others.items():
            place = (record.x, record.y)
            if robot in situation.fresh or self._gone.get(robot) == record.stamp:
                continue
            if cell not in self.cells.touched(*place, reach):
                continue
            if not has_gone(place, inputs.pose, inputs.scan.readings, self._settings.radius):
                return place
            self._gone[robot] = record.stamp
        return None
