"""A scenario made ready for a run: where its lattice lies, the grid that paths are planned on, and the starts."""

from dataclasses import replace
from typing import Final, NamedTuple

from swarm.geometry import Pose
from swarm.maps.occupancy import OccupancyMap
from swarm.planning.grid import Grid
from swarm.scenario.load import Scenario
from swarm.scenario.starts import starts
from swarm.traffic.cells_of import with_lattice

RESOLUTION: Final = 0.1  # m, of the planning grid, at most
EASE: Final = 0.8  # m, room beyond the radius that paths seek, times distance_scale: the terms' "near" ends there


class Mission(NamedTuple):
    """What a run begins with."""

    scenario: Scenario  # its lattice is settled
    grid: Grid
    starts: list[Pose]  # of each robot, in the order of their numbers


def prepare(scenario: Scenario, robots: int, seed: int) -> Mission:
    """Settle the lattice, grow the planning grid and draw the starts.

    Raises:
        ConfigError: there are fewer listed poses than robots, or the area has no room for so many.
    """
    scenario = settled(scenario)
    return Mission(scenario, planning_grid(scenario), starts(scenario, robots, seed))


def settled(scenario: Scenario) -> Scenario:
    """Return the scenario with the place of its lattice in its settings; the same one where it is there already."""
    return replace(scenario, settings=with_lattice(scenario.settings, scenario.map))


def planning_grid(scenario: Scenario, learned: OccupancyMap | None = None) -> Grid:
    """Grow the scenario's map to the grid its robots plan on; or a ``learned`` one, where the unknown may be free."""
    robot, floor = scenario.settings.robot, scenario.map if learned is None else learned
    margin = EASE * robot.distance_scale
    return Grid.grown(floor, robot.radius, margin, RESOLUTION, unknown_free=learned is not None)
