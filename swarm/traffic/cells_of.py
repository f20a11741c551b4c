"""The cells of a scenario: the same for every robot and for the world that watches them."""

from functools import lru_cache
from typing import Final

import msgspec

from swarm.maps.occupancy import OccupancyMap, Point
from swarm.scenario.schema import Settings
from swarm.traffic.cells import CellMap, best_offset
from swarm.traffic.settings import TrafficSettings

RADII: Final = 6.0  # a cell's side, where the scenario says nothing: a robot turns in it under the paper's controller
SPARE: Final = 0.05  # m, what a robot may stray on the line between two cells


def cells_of(floor: OccupancyMap, settings: Settings) -> CellMap:
    """Lay the lattice over a floor, where the scenario says it lies: all must give a cell the same number."""
    radius = settings.robot.radius
    return _lattice(floor, settings.traffic.cell or RADII * radius, radius + SPARE, settings.traffic.offset)


def with_lattice(settings: Settings, floor: OccupancyMap) -> Settings:
    """Settle where the lattice lies, once for a run: edits of the floor must not shift it.

    A map whose own cells are as large is its own lattice; else the offset is taken that opens most ways.
    """
    traffic, fits = settings.traffic, settings.robot.radius + SPARE
    if traffic.rule != "holds" or traffic.offset is not None:
        return settings
    side = traffic.cell or RADII * settings.robot.radius
    offset = (0.0, 0.0) if side == floor.resolution else best_offset(floor, side=side, radius=fits)
    return msgspec.structs.replace(settings, traffic=msgspec.structs.replace(traffic, offset=offset))


@lru_cache(maxsize=4)
def _lattice(floor: OccupancyMap, side: float, fits: float, offset: Point | None) -> CellMap:
    return CellMap(floor, side=side, radius=fits, offset=offset or (0.0, 0.0))


def traffic_settings(settings: Settings) -> TrafficSettings:
    """Give traffic its constants for a scenario."""
    robot = settings.robot
    return TrafficSettings(
        tick=1.0 / settings.rate,
        every=settings.radio.every,
        radius=robot.radius,
        radio_range=settings.radio.range,
        speed=4.0 * robot.speed_scale,
        sensor_range=settings.sensors.range,
    )
