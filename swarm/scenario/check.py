"""The check that a mission can be driven, made before any process is started."""

from collections.abc import Iterator
from itertools import combinations
from math import sqrt
from typing import Final

from swarm.errors import ConfigError
from swarm.geometry import Pose, distance
from swarm.maps.occupancy import FREE, OccupancyMap, Point
from swarm.planning.grid import Grid
from swarm.planning.path import is_reachable
from swarm.scenario.load import Scenario
from swarm.scenario.prepare import Prepared, check_grid_size, planning_grid, settle_lattice
from swarm.scenario.starts import robot_names, starts
from swarm.settings import Settings
from swarm.traffic.lattice.cell_map import OUTSIDE, CellMap
from swarm.traffic.lattice.placement import (
    cells_of,
    comes_near,
    distance_to_stop,
    standable_under,
    traffic_settings,
)
from swarm.traffic.lattice_choice import lattices_tried
from swarm.traffic.settings import least_range

MOST_STOPS: Final = 20_000  # of all robots
# share of 2 s that each cell of a lattice that is tried costs, alone and for each target and start; measured
CELL_COST: Final = 9e-7
STOP_COST: Final = 5e-10


def check(scenario: Scenario, robots: int, seed: int) -> Prepared:
    """Return the prepared mission if it can be driven: no start or target in a wall, no overlap, a path to each target.

    Raises:
        ConfigError: the mission cannot be driven; the text names the first reason.
    """
    _affordable(scenario, robots)
    scenario = settle_lattice(scenario, robots)
    settings, grid = scenario.settings, planning_grid(scenario)
    if settings.own_targets and robots > len(settings.own_targets):
        raise ConfigError(
            f"{settings.name}: own_targets: expected a list for each of {robots} robots, "
            f"got {len(settings.own_targets)}; add more or run fewer robots"
        )
    for number, target in enumerate(settings.targets, start=1):
        _standable(scenario, grid, target, f"targets: target {number}")
    for name, targets in zip(robot_names(robots), settings.own_targets, strict=False):
        for number, target in enumerate(targets, start=1):
            _standable(scenario, grid, target, f"own_targets: {name}'s target {number}")
    for number, target in enumerate(settings.pool, start=1):
        _standable(scenario, grid, target, f"pool: target {number}")
    for number, asked in enumerate(settings.orders):
        if asked.robot not in robot_names(robots):
            raise ConfigError(
                f"{settings.name}: orders[{number}].robot: expected one of {', '.join(robot_names(robots))}, "
                f"got {asked.robot!r}; correct it"
            )
    poses = starts(scenario, robots, seed)
    for name, pose in zip(robot_names(robots), poses, strict=True):
        _standable(scenario, grid, pose[:2], f"start of {name}")
    needed = 2 * settings.robot.radius
    for (a, one), (b, other) in combinations(zip(robot_names(robots), poses, strict=True), 2):
        if (apart := distance(one, other)) < needed:
            raise ConfigError(
                f"{settings.name}: start: expected {a} and {b} at least {needed:g} m apart, got {apart:.2f} m; "
                "move one of them"
            )
    for where, here, there in _ways_between_stops(scenario, poses, grid):
        if not is_reachable(grid, here, there):
            raise ConfigError(
                f"{where}: expected a way from "
                f"({here[0]:.2f}, {here[1]:.2f}) wide enough for a radius of {settings.robot.radius:g} m, "
                "found none; open the map or move the target"
            )
    _within_cells(scenario, poses, grid)
    return Prepared(scenario, grid, poses)


def _affordable(scenario: Scenario, robots: int) -> None:
    """Check the size of a mission before anything is computed from it: all checks together take a few seconds.

    Raises:
        ConfigError: the floor is too large for its lattice to be placed, or there are too many stops.
    """
    settings, floor = scenario.settings, scenario.map
    check_grid_size(floor)
    targets = settings.own_targets[:robots] or [settings.targets] * robots
    stops = sum(map(len, targets)) + robots * settings.return_home
    if stops > MOST_STOPS:
        raise ConfigError(
            f"{settings.name}: expected at most {MOST_STOPS} targets of all robots together, got {stops} of {robots}; "
            "run fewer robots or give them fewer targets"
        )
    width, height = (side * floor.resolution for side in floor.shape)
    listed = (
        sum(map(len, settings.own_targets))
        + len(settings.targets)
        + len(settings.pool)
        + len(settings.start.poses or ())
    )
    cost = sum(
        count * (width / side + 1) * (height / side + 1) * (CELL_COST + STOP_COST * listed)
        for side, count in lattices_tried(settings, floor)
    )
    if cost > 1.0:
        raise ConfigError(
            f"{settings.name}: expected a floor and targets for which the lattice of cells can be placed, got "
            f"{width:g} x {height:g} m with {listed} targets and starts, {cost:.1f} times too many; set `traffic.cell` "
            "and `traffic.offset`, cut the map, or list fewer targets"
        )


def _ways_between_stops(scenario: Scenario, poses: list[Pose], grid: Grid) -> Iterator[tuple[str, Point, Point]]:
    """Yield the ways from stop to stop [m] with their names; a way of several robots is named after the first.

    The way to a target of the pool begins where a robot starts that has one, if any has.
    """
    seen = set()
    for number, (name, pose) in enumerate(zip(robot_names(len(poses)), poses, strict=True)):
        here = pose[:2]
        for stop, there in enumerate(scenario.stops(number, here), start=1):
            if (here, there) not in seen:
                seen.add((here, there))
                yield f"{scenario.settings.name}: target {stop} of {name} at ({there[0]:g}, {there[1]:g})", here, there
            here = there
    for number, there in enumerate(scenario.settings.pool, start=1):
        able = (pose[:2] for pose in poses if is_reachable(grid, pose[:2], there))
        where = f"{scenario.settings.name}: pool: target {number} at ({there[0]:g}, {there[1]:g})"
        yield where, next(able, poses[0][:2]), there


def _within_cells(scenario: Scenario, poses: list[Pose], grid: Grid) -> None:
    """Check that a robot inside its cells gets near enough to each stop, and that the radio range suits the cells.

    Raises:
        ConfigError: a stop is at a wall or cut off, robots that claim one cell cannot hear each other, or two
            robots start too near each other.
    """
    settings = scenario.settings
    cells = cells_of(scenario.map, settings)
    if settings.radio.range < (least := least_range(cells.side)) - 1e-9:
        raise ConfigError(
            f"{settings.name}: radio.range: expected {least:g} m or more for cells of {cells.side:g} m, got "
            f"{settings.radio.range:g} m: robots that claim a cell must hear each other; raise it or set a smaller "
            "`traffic.cell`"
        )
    _check_cells_of_starts(settings, cells, poses)
    for name, (x, y, _) in zip(robot_names(len(poses)), poses, strict=True):
        if not standable_under(cells, (x, y), settings):
            raise ConfigError(
                f"{settings.name}: start of {name} at ({x:g}, {y:g}): expected a place with room to drive off, got a "
                f"nook between walls; {_nearest(cells, (x, y), settings)}"
            )
    for where, here, there in _ways_between_stops(scenario, poses, grid):
        if (short := distance_to_stop(cells, there, settings)) > settings.reach:
            raise ConfigError(
                f"{where}: expected a place that a robot comes within {settings.reach:g} m of, got one at a wall or "
                f"behind a corner: it has to stay {short:.2f} m away from it; {_nearest(cells, there, settings)}"
            )
        if not comes_near(cells, here, there, settings):
            raise ConfigError(
                f"{where}: expected a way from ({here[0]:.2f}, {here[1]:.2f}) on which a robot reserves squares of "
                f"{cells.side:g} m, found none; widen the way"
            )


def _nearest(cells: CellMap, place: Point, settings: Settings) -> str:
    """Return what to do about a place without a cell: where the nearest is, if there is any."""
    cell = cells.nearest_standable(*place)
    if cell == OUTSIDE:
        return "open the map"
    x, y = cells.move_inside(cell, place, traffic_settings(settings).standing_room)
    return f"the nearest place is ({x:.2f}, {y:.2f}); move it there"


def _check_cells_of_starts(settings: Settings, cells: CellMap, poses: list[Pose]) -> None:
    """Check that no two robots stand in one cell: it is the place of one, so no joint plan could tell them apart.

    Raises:
        ConfigError: two of them do.
    """
    holders: dict[int, tuple[str, Pose]] = {}
    for name, pose in zip(robot_names(len(poses)), poses, strict=True):
        cell = cells.cell_of(*pose[:2])
        holder, there = holders.setdefault(cell, (name, pose)) if cell != OUTSIDE else (name, pose)
        if holder != name:
            raise ConfigError(
                f"{settings.name}: start: expected {holder} at ({there.x:g}, {there.y:g}) and {name} at ({pose.x:g}, "
                f"{pose.y:g}) farther apart, got {distance(there, pose):.2f} m, and {sqrt(2) * cells.side:.2f} m are "
                "always enough; move one of them"
            )


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
    if wrong := explain_not_free(floor, point):
        raise ConfigError(f"{where}: {wrong}; move it")
    if not grid.is_free(x, y):
        raise ConfigError(f"{where}: expected at least {radius:g} m from any wall, for the robot's radius; move it")


def explain_not_free(floor: OccupancyMap, place: Point) -> str:
    """Return what was expected of a place [m] and what came, "" if it is free floor."""
    if not floor.inside(floor.cell_of(*place)):
        return "expected a place on the map, got one outside"
    return "" if floor.at(*place) == FREE else "expected free floor, got a wall or obstacle"
