"""A scenario made ready for a run: the position of its lattice, the planning grid and the start poses."""

from functools import lru_cache
from typing import Final, NamedTuple

from swarm.geometry import Pose
from swarm.maps.limits import check_size
from swarm.maps.occupancy import OccupancyMap
from swarm.planning.grid import Grid, refinement
from swarm.scenario.load import Scenario
from swarm.scenario.starts import starts
from swarm.traffic.lattice_choice import with_lattice

RESOLUTION: Final = 0.1  # m, largest cell of the planning grid
EASE: Final = 0.8  # m, times distance_scale: clearance that paths prefer; the fuzzy term `near` ends there


class Prepared(NamedTuple):
    """The inputs of a run."""

    scenario: Scenario  # its lattice is settled
    starts: list[Pose]  # of each robot, in the order of their numbers


def prepare(scenario: Scenario, robots: int, seed: int) -> Prepared:
    """Return the mission: the scenario with its lattice placed, and the start poses.

    Raises:
        ConfigError: fewer poses are listed than robots, or the area has no room for so many robots.
    """
    scenario = settle_lattice(scenario, robots)
    return Prepared(scenario, starts(scenario, robots, seed))


def settle_lattice(scenario: Scenario, robots: int | None = None) -> Scenario:
    """Return the scenario with the position of its lattice in its settings; a position that is set already stays.

    ``robots`` is how many drive, by default those of the scenario.
    """
    return scenario.with_settings(with_lattice(scenario.settings, scenario.map, robots))


def check_grid_size(floor: OccupancyMap) -> None:
    """Check the size of a map's planning grid before it is made.

    Raises:
        ConfigError: it would have too many cells.
    """
    factor = refinement(floor, RESOLUTION)
    rows, columns = floor.shape
    check_size(rows * factor, columns * factor, f"planning grid of cells of {floor.resolution / factor:g} m")


def planning_grid(scenario: Scenario, learned: OccupancyMap | None = None) -> Grid:
    """Return the planning grid of the scenario's map, or of a ``learned`` map, whose unknown cells count as free."""
    robot = scenario.settings.robot
    margin = EASE * robot.distance_scale
    if learned is not None:
        return Grid.grown(learned, robot.radius, margin, RESOLUTION, unknown_free=True)
    return grid_of_floor(scenario.map, robot.radius, margin)


@lru_cache(maxsize=4)  # one for each kind; the robots of a machine share what the launcher's fork server has computed
def grid_of_floor(floor: OccupancyMap, radius: float, margin: float) -> Grid:
    """Return the planning grid of a given map for a footprint; both in metres."""
    return Grid.grown(floor, radius, margin, RESOLUTION)
