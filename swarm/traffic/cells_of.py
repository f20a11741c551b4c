"""The cells of a scenario: the same for every robot and for the world that watches them."""

from dataclasses import replace
from functools import lru_cache
from typing import Any, Final

import msgspec

from swarm.geometry import distance
from swarm.maps.occupancy import OccupancyMap, Point
from swarm.scenario.schema import Settings
from swarm.traffic.cells import CellMap, best_offset
from swarm.traffic.settings import TrafficSettings

RADII: Final = 6.0  # a cell's side, where the scenario says nothing: a robot turns in it under the paper's controller
SPARE: Final = 0.05  # m, what a robot may stray on the line between two cells
# where walls stop the radio: claim one cell at a time and wait for five broadcasts; to be unheard is nothing special
IN_SIGHT: Final[dict[str, Any]] = {"in_sight": True, "horizon": 1, "ripe": 20, "absent": 600, "plan_stuck": 400}
STANDS: Final = 0.05  # m, off the point it drives to


def cells_of(floor: OccupancyMap, settings: Settings) -> CellMap:
    """Lay the lattice over a floor, where the scenario says it lies: all must give a cell the same number."""
    radius = settings.robot.radius
    return _lattice(floor, settings.traffic.cell or RADII * radius, radius + SPARE, settings.traffic.offset)


def with_lattice(settings: Settings, floor: OccupancyMap) -> Settings:
    """Settle where the lattice lies, once for a run: edits of the floor must not shift it.

    A map whose own cells are as large is its own lattice; else the offset is taken that lets most stops be reached
    within their cells, and of those the one that opens most ways.
    """
    traffic, fits = settings.traffic, settings.robot.radius + SPARE
    if traffic.rule != "holds" or traffic.offset is not None:
        return settings
    side = traffic.cell or RADII * settings.robot.radius
    stops = [*settings.targets, *(stop for stops in settings.own_targets for stop in stops)]
    if settings.return_home:
        stops += [pose[:2] for pose in settings.start.poses or ()]

    def missed(cells: CellMap) -> int:
        return sum(short_of(cells, stop, settings) > settings.reach for stop in stops)

    own = side == floor.resolution
    offset = (0.0, 0.0) if own else best_offset(floor, side=side, radius=fits, missed=missed)
    return msgspec.structs.replace(settings, traffic=msgspec.structs.replace(traffic, offset=offset))


def short_of(cells: CellMap, stop: Point, settings: Settings) -> float:
    """Give how far from a stop [m] a robot comes to stand that keeps to the cell the stop is in."""
    cell = cells.nearest_standable(*stop)
    return distance(cells.moved_inside(cell, stop, traffic_settings(settings).standing_room), stop) + STANDS


@lru_cache(maxsize=4)
def _lattice(floor: OccupancyMap, side: float, fits: float, offset: Point | None) -> CellMap:
    return CellMap(floor, side=side, radius=fits, offset=offset or (0.0, 0.0))


def traffic_settings(settings: Settings) -> TrafficSettings:
    """Give traffic its constants for a scenario."""
    robot = settings.robot
    constants = TrafficSettings(
        tick=1.0 / settings.rate,
        every=settings.radio.every,
        radius=robot.radius,
        radio_range=settings.radio.range,
        speed=4.0 * robot.speed_scale,
        sensor_range=settings.sensors.range,
    )
    return replace(constants, **IN_SIGHT) if settings.radio.line_of_sight else constants
