"""The cells of a scenario: the same for every robot and for the world that watches them."""

from functools import lru_cache
from typing import Final

from swarm.maps.occupancy import OccupancyMap
from swarm.scenario.schema import Settings
from swarm.traffic.cells import CellMap, best_offset
from swarm.traffic.settings import TrafficSettings

RADII: Final = 6.0  # a cell's side, where the scenario says nothing: a robot turns in it under the paper's controller
SPARE: Final = 0.05  # m, what a robot may stray on the line between two cells


def cells_of(floor: OccupancyMap, settings: Settings) -> CellMap:
    """Lay the lattice over a floor; a map whose own cells are as large as that is its own lattice."""
    radius = settings.robot.radius
    return _lattice(floor, settings.traffic.cell or RADII * radius, radius + SPARE)


@lru_cache(maxsize=4)
def _lattice(floor: OccupancyMap, side: float, fits: float) -> CellMap:
    offset = (0.0, 0.0) if side == floor.resolution else best_offset(floor, side=side, radius=fits)
    return CellMap(floor, side=side, radius=fits, offset=offset)


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
