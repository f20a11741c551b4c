"""The check that a mission can be driven, made before any process is started."""

from itertools import combinations

from swarm.errors import ConfigError
from swarm.geometry import Pose, distance
from swarm.maps.occupancy import FREE, Point
from swarm.planning.grid import Grid
from swarm.planning.path import is_reachable
from swarm.scenario.load import Scenario
from swarm.scenario.prepare import Mission, planning_grid, settled
from swarm.scenario.starts import names, starts
from swarm.traffic.cells_of import cells_of, comes_near, short_of
from swarm.traffic.settings import least_range


def check(scenario: Scenario, robots: int, seed: int) -> Mission:
    """Return the prepared mission if it can be driven: no start or target in a wall, no overlap, a path to each target.

    Raises:
        ConfigError: the mission cannot be driven; the text names the first reason.
    """
    scenario = settled(scenario)
    settings, grid = scenario.settings, planning_grid(scenario)
    if settings.own_targets and robots > len(settings.own_targets):
        raise ConfigError(
            f"{settings.name}: own_targets: expected a list for each of {robots} robots, "
            f"got {len(settings.own_targets)}; add more or run fewer robots"
        )
    for number, target in enumerate(settings.targets, start=1):
        _standable(scenario, grid, target, f"targets: target {number}")
    for name, targets in zip(names(robots), settings.own_targets, strict=False):
        for number, target in enumerate(targets, start=1):
            _standable(scenario, grid, target, f"own_targets: {name}'s target {number}")
    poses = starts(scenario, robots, seed)
    for name, pose in zip(names(robots), poses, strict=True):
        _standable(scenario, grid, pose[:2], f"start of {name}")
    needed = 2 * settings.robot.radius
    for (a, one), (b, other) in combinations(zip(names(robots), poses, strict=True), 2):
        if (apart := distance(one, other)) < needed:
            raise ConfigError(
                f"{settings.name}: start: expected {a} and {b} at least {needed:g} m apart, got {apart:.2f} m; "
                "move one of them"
            )
    for number, (name, pose) in enumerate(zip(names(robots), poses, strict=True)):
        here = pose[:2]
        for stop, there in enumerate(scenario.stops(number, here), start=1):
            if not is_reachable(grid, here, there):
                raise ConfigError(
                    f"{settings.name}: target {stop} of {name} at ({there[0]:g}, {there[1]:g}): expected a way from "
                    f"({here[0]:.2f}, {here[1]:.2f}) wide enough for a radius of {settings.robot.radius:g} m, "
                    "found none; open the map or move the target"
                )
            here = there
    _within_cells(scenario, poses)
    return Mission(scenario, grid, poses)


def _within_cells(scenario: Scenario, poses: list[Pose]) -> None:
    """Check that a robot inside its cells gets near enough to each stop, and that the radio range suits the cells.

    Raises:
        ConfigError: a stop is at a cell's edge or cut off, or robots that claim one cell cannot hear each other.
    """
    settings = scenario.settings
    cells = cells_of(scenario.map, settings)
    if settings.radio.range < (least := least_range(cells.side)) - 1e-9:
        raise ConfigError(
            f"{settings.name}: radio.range: expected {least:g} m or more for cells of {cells.side:g} m, got "
            f"{settings.radio.range:g} m: robots that claim a cell must hear each other; raise it or set a smaller "
            "`traffic.cell`"
        )
    for number, (name, pose) in enumerate(zip(names(len(poses)), poses, strict=True)):
        here = pose[:2]
        for stop, there in enumerate(scenario.stops(number, here), start=1):
            if (short := short_of(cells, there, settings)) > settings.reach:
                raise ConfigError(
                    f"{settings.name}: target {stop} of {name} at ({there[0]:g}, {there[1]:g}): expected a place that "
                    f"is reached within {settings.reach:g} m from inside its cell of {cells.side:g} m, the nearest is "
                    f"{short:.2f} m off; raise `reach`, or set `traffic.cell` or `traffic.offset`"
                )
            if not comes_near(cells, here, there, settings):
                raise ConfigError(
                    f"{settings.name}: target {stop} of {name} at ({there[0]:g}, {there[1]:g}): expected a way over "
                    f"cells of {cells.side:g} m from ({here[0]:.2f}, {here[1]:.2f}), found none; open the map, or set "
                    "`traffic.cell` or `traffic.offset`"
                )
            here = there


def _standable(scenario: Scenario, grid: Grid, point: Point, what: str) -> None:
    name, radius = scenario.settings.name, scenario.settings.robot.radius
    x, y = point
    floor = scenario.map
    where = f"{name}: {what} at ({x:g}, {y:g})"
    if not floor.inside(floor.cell_of(x, y)):
        low, high = floor.centre_of((0, 0)), floor.centre_of((floor.shape[0] - 1, floor.shape[1] - 1))
        raise ConfigError(
            f"{where}: expected a place on the map, which spans about ({low[0]:g}, {low[1]:g}) to "
            f"({high[0]:g}, {high[1]:g}); move it"
        )
    if floor.at(x, y) != FREE:
        raise ConfigError(f"{where}: expected free floor, got a wall or obstacle; move it")
    if not grid.is_free(x, y):
        raise ConfigError(f"{where}: expected at least {radius:g} m from any wall, for the robot's radius; move it")
