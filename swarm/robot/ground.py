"""What one robot knows about the floor: a given map with edits, or a map learned from its rays and the radio."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from math import ceil
from typing import Final

import numpy as np
from numpy.typing import NDArray

from swarm.geometry import Pose, from_frame
from swarm.maps.occupancy import FREE, OBSTACLE, UNKNOWN, WALL, Cell, OccupancyMap, Point
from swarm.messages import Edit, Kind, Sense
from swarm.planning.grid import Grid
from swarm.planning.rays import note_ray
from swarm.robot.sectors import sectors
from swarm.scenario.load import Scenario
from swarm.scenario.prepare import RESOLUTION, planning_grid

KINDS: Final = {Kind.WALL: WALL, Kind.OBSTACLE: OBSTACLE, Kind.FREE: FREE}

GAIN, LOSS, MOST, SOLID = 2, 1, 10, 4  # counts: added by a hit, removed by a pass, the largest, the solid
SURE: Final = 8  # count from which a solid cell is broadcast
DOUBT: Final = 4.0  # standard deviations; a reading so close to the range may have hit nothing
DEEPER: Final = 2.0  # standard deviations by which a hit counts as farther away, half a cell at most
NEARER, FARTHER = 4.0, 1.0  # standard deviations; a known wall so far before or behind a hit is what was hit
DEAF: Final = 30.0  # s for which a robot ignores the walls of others after it cleared its map
TELL: Final = 120  # cells in one broadcast: new ones first, then all in turn


Block = tuple[Cell, Cell]  # fine cells from the first to before the second, in rows and columns


class Ground:
    """One robot's map and planning grid."""

    def __init__(self, scenario: Scenario, grid: Grid | None = None, edits: int = 0) -> None:
        settings = scenario.settings
        self._known = settings.map.known
        self._range, self._radius = settings.sensors.range, settings.robot.radius
        self._noise = settings.sensors.noise
        self._hits = self._range - 0.01 - DOUBT * self._noise  # m; a shorter reading hit something
        self._angles = [angle for sector in sectors(settings.sensors) for angle in sector]
        self.map = scenario.map if self._known else _blank(scenario.map)
        if not self._known:
            grid = planning_grid(scenario, self.map)
        self.grid = grid or planning_grid(scenario)
        self.edits = edits  # number of edits in the map
        self._odds: NDArray[np.int8] = np.zeros(self.map.shape, np.int8)
        self._to_tell: list[int] = []
        self._told_up_to = 0
        self._news: list[Block] = []
        self._deaf_until = 0.0  # s

    def take_radius(self, scenario: Scenario) -> None:
        """Plan for the radius of the scenario's robot from now on, on the floor that is known."""
        self._radius = scenario.settings.robot.radius
        own = replace(scenario, map=self.map)
        self.grid = planning_grid(own) if self._known else planning_grid(own, self.map)
        self._news = [((0, 0), self.map.shape)]

    def take_edits(self, before: int, edits: Sequence[Edit]) -> bool:
        """Apply new edits; return True if the floor changed. ``before`` is the number of earlier edits.

        Nothing is applied if the robot has missed edits between: then it must ask for the map (see ``missed``).
        """
        if not self._known or before > self.edits:
            return False
        fresh = edits[self.edits - before :]
        for edit in fresh:
            self.map, low, high = self.map.edit_rectangle(KINDS[edit.kind], edit.low, edit.high)
            self.grid = self.grid.update_cells(self.map, low, high)
        self.edits = max(self.edits, before + len(edits))
        return bool(fresh)

    def has_missed_edits(self, before: int) -> bool:
        """Return True if the robot has missed edits; ``before`` is as in ``take_edits``."""
        return self._known and before > self.edits

    def learn(self, sense: Sense, is_robot: Callable[[Point], bool]) -> bool:
        """Learn an unknown floor from every ray; return True if a cell became solid or stopped being solid.

        ``is_robot`` returns True if another robot's body may be at a point [m]; a hit there makes no wall. A hit counts
        as ``DEEPER`` than it was read, so that noise rarely puts it before the wall.
        """
        pose = Pose(sense.x, sense.y, sense.yaw)
        x, y = self.grid.to_cells(pose.x, pose.y)
        side, yaw = self.map.resolution, pose.yaw - self.map.origin.yaw
        deeper = min(DEEPER * self._noise, side / 2)
        nearer, farther = NEARER * self._noise / side, FARTHER * self._noise / side
        for angle, read in zip(self._angles, sense.rays, strict=True):
            reach = self._radius + read
            hit = read < self._hits and not is_robot(
                from_frame(Pose(pose.x, pose.y, pose.yaw + angle), reach + 0.5 * self._radius, 0.0)
            )
            length = (reach + deeper if hit else reach) / side
            note_ray(self._odds, x, y, yaw + angle, length, nearer, farther, hit, GAIN, LOSS, MOST, SOLID)
        return self._settle(int(y), int(x), ceil((self._range + self._radius) / side) + 2)

    def hear(self, cells: Iterable[int], time: float) -> bool:
        """Take over solid cells that others broadcast; return True if one is new."""
        if time < self._deaf_until:
            return False
        rows, columns = self.map.shape
        changed = False
        for cell in cells:
            row, column = divmod(cell, columns)
            if 0 <= row < rows and self._odds[row, column] == 0:
                self._odds[row, column] = SOLID
                changed |= self._settle(row, column, 0)
        return changed

    def tell(self) -> list[int]:
        """Return solid cells to broadcast: new ones, then all known ones in turn, for robots that joined late."""
        if self._known:
            return []
        sure = (self.map.cells == WALL) & (self._odds >= SURE)
        fresh = [cell for cell in self._to_tell if sure.flat[cell]]
        news, self._to_tell = fresh[:TELL], [cell for cell in self._to_tell if cell not in fresh[:TELL]][-4 * TELL :]
        solid = np.flatnonzero(sure)
        room = min(TELL - len(news), solid.size)
        if room:
            turn = (self._told_up_to + np.arange(room)) % solid.size
            self._told_up_to = int(turn[-1]) + 1
            news += solid[turn].tolist()
        return news

    def take_news(self) -> list[Block]:
        """Return the blocks of the learned map that changed since the last call."""
        news, self._news = self._news, []
        return news

    def forget(self, time: float) -> None:
        """Clear the learned map, because it leaves no way."""
        self._deaf_until = time + DEAF
        self._news = [((0, 0), self.map.shape)]
        np.minimum(self._odds, 0, out=self._odds)
        self.map = replace(self.map, cells=np.full(self.map.shape, UNKNOWN, np.uint8))
        self.grid = self.grid.update_cells(self.map, (0, 0), self.map.shape)

    def _settle(self, row: int, column: int, reach: int) -> bool:
        """Update the map from the counts around a cell; return True if a cell became solid or stopped being solid."""
        low = max(0, row - reach), max(0, column - reach)
        block = np.s_[low[0] : row + reach + 1, low[1] : column + reach + 1]
        odds, was = self._odds[block], self.map.cells[block] == WALL
        solid = np.where(was, odds > 0, odds >= SOLID)
        changed = np.argwhere(solid != was)
        if not changed.size:
            return False
        cells = self.map.cells.copy()
        cells[block] = np.where(solid, WALL, np.where(odds < 0, FREE, UNKNOWN))
        self.map = replace(self.map, cells=cells)
        first, last = changed.min(axis=0), changed.max(axis=0) + 1
        from_ = (low[0] + int(first[0]), low[1] + int(first[1]))
        beyond = (low[0] + int(last[0]), low[1] + int(last[1]))
        self.grid = self.grid.update_cells(self.map, from_, beyond)
        self._news.append((from_, beyond))
        columns = self.map.shape[1]
        self._to_tell += [(low[0] + r) * columns + low[1] + c for r, c in changed.tolist() if solid[r, c]]
        return True


def _blank(floor: OccupancyMap) -> OccupancyMap:
    """Return an unknown map of the same extent with cells of at most ``RESOLUTION``."""
    factor = ceil(floor.resolution / RESOLUTION - 1e-9)
    rows, columns = floor.shape
    cells = np.full((rows * factor, columns * factor), UNKNOWN, np.uint8)
    return OccupancyMap(cells, floor.resolution / factor, floor.origin)
