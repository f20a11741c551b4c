"""The check that a mission can be driven, made before any process is started."""

from collections.abc import Mapping, Sequence
from itertools import combinations
from math import sqrt
from typing import Final, NamedTuple

from swarm.errors import ConfigError
from swarm.geometry import Pose, distance
from swarm.kinds import check_mix, kind_of, targets_of
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
    check_mix(scenario.settings, scenario.settings.name)
    _affordable(scenario, robots)
    scenario = settle_lattice(scenario, robots)
    settings, names = scenario.settings, robot_names(robots)
    if settings.own_targets and robots > len(settings.own_targets):
        raise ConfigError(
            f"{settings.name}: own_targets: expected a list for each of {robots} robots, "
            f"got {len(settings.own_targets)}; add more or run fewer robots"
        )
    kinds = [kind_of(settings, number) for number in range(robots)]
    each = {kind: scenario.of_kind(kind) for kind in dict.fromkeys(kinds)}
    grids = {kind: planning_grid(own) for kind, own in each.items()}
    for kind, own in each.items():
        _check_places(own, grids[kind], kind)
    for number, (name, targets) in enumerate(zip(names, settings.own_targets, strict=False)):
        for stop, place in enumerate(targets, start=1):
            kind = kinds[number]
            _standable(each[kind], grids[kind], place, f"own_targets: {name}'s target {stop}")
    smallest = min(each, key=lambda kind: each[kind].settings.robot.radius)  # any robot may take a target of the pool
    for number, target in enumerate(settings.pool, start=1):
        _standable(each[smallest], grids[smallest], target, f"pool: target {number}")
    for number, asked in enumerate(settings.orders):
        if asked.robot not in names:
            raise ConfigError(
                f"{settings.name}: orders[{number}].robot: expected one of {', '.join(names)}, "
                f"got {asked.robot!r}; correct it"
            )
    poses = starts(scenario, robots, seed)
    radii = [each[kind].settings.robot.radius for kind in kinds]
    for name, kind, pose in zip(names, kinds, poses, strict=True):
        _standable(each[kind], grids[kind], pose[:2], f"start of {name}")
    for (a, one, half), (b, other, rest) in combinations(zip(names, poses, radii, strict=True), 2):
        if (apart := distance(one, other)) < (needed := half + rest):
            raise ConfigError(
                f"{settings.name}: start: expected {a} and {b} at least {needed:g} m apart, got {apart:.2f} m; "
                "move one of them"
            )
    ways = _ways_between_stops(scenario, poses, [grids[kind] for kind in kinds])
    for kind, own in each.items():
        _check_ways(own, grids[kind], [way for way in ways if kinds[way.robot] == kind])
    cells = cells_of(scenario.map, settings)
    _check_radio(settings, cells)
    _check_cells_of_starts(settings, cells, poses)
    if settings.kinds:
        _check_floor_of_starts(settings, cells, poses, radii)
    for kind, own in each.items():
        own_poses = {name: pose for name, other, pose in zip(names, kinds, poses, strict=True) if other == kind}
        _within_cells(own, own_poses, [way for way in ways if kinds[way.robot] == kind])
    return Prepared(scenario, poses)


def _check_places(scenario: Scenario, grid: Grid, kind: str) -> None:
    """Check that robots of a kind can stand at the targets that all of them have.

    Raises:
        ConfigError: a target is in a wall or too near one.
    """
    settings = scenario.settings
    own = settings.kinds[kind].targets if kind else None
    where, targets = ("targets", settings.targets) if own is None else (f"kinds.{kind}.targets", own)
    for number, target in enumerate(targets, start=1):
        _standable(scenario, grid, target, f"{where}: target {number}")


class Way(NamedTuple):
    """A way that is to be driven."""

    robot: int  # the first that drives it
    name: str  # for people
    here: Point  # m
    there: Point  # m


def _check_ways(scenario: Scenario, grid: Grid, ways: Sequence[Way]) -> None:
    """Check that paths lead over the floor.

    Raises:
        ConfigError: a way is too narrow, or there is none.
    """
    for _, where, here, there in ways:
        if not is_reachable(grid, here, there):
            raise ConfigError(
                f"{where}: expected a way from ({here[0]:.2f}, {here[1]:.2f}) wide enough for a radius of "
                f"{scenario.settings.robot.radius:g} m, found none; open the map or move the target"
            )


def _affordable(scenario: Scenario, robots: int) -> None:
    """Check the size of a mission before anything is computed from it: all checks together take a few seconds.

    Raises:
        ConfigError: the floor is too large for its lattice to be placed, or there are too many stops.
    """
    settings, floor = scenario.settings, scenario.map
    check_grid_size(floor)
    stops = sum(len(targets_of(settings, number)) for number in range(robots)) + robots * settings.return_home
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


def _ways_between_stops(scenario: Scenario, poses: list[Pose], grids: Sequence[Grid]) -> list[Way]:
    """Return the ways from stop to stop; one of several robots of a kind is named after the first.

    The way to a target of the pool begins where a robot starts that has one, if any has.
    """
    seen, found, settings = set(), [], scenario.settings
    for number, (name, pose) in enumerate(zip(robot_names(len(poses)), poses, strict=True)):
        here, kind = pose[:2], kind_of(settings, number)
        for stop, there in enumerate(scenario.stops(number, here), start=1):
            if (kind, here, there) not in seen:
                seen.add((kind, here, there))
                where = f"{settings.name}: target {stop} of {name} at ({there[0]:g}, {there[1]:g})"
                found.append(Way(number, where, here, there))
            here = there
    for number, there in enumerate(settings.pool, start=1):
        able = (robot for robot, pose in enumerate(poses) if is_reachable(grids[robot], pose[:2], there))
        where = f"{settings.name}: pool: target {number} at ({there[0]:g}, {there[1]:g})"
        found.append(Way(robot := next(able, 0), where, poses[robot][:2], there))
    return found


def _within_cells(scenario: Scenario, poses: Mapping[str, Pose], ways: Sequence[Way]) -> None:
    """Check that robots of one kind inside their cells get near enough to each stop.

    Raises:
        ConfigError: a stop is at a wall or cut off, or a robot has no room to drive off.
    """
    settings = scenario.settings
    cells = cells_of(scenario.map, settings)
    for name, (x, y, _) in poses.items():
        if not standable_under(cells, (x, y), settings):
            raise ConfigError(
                f"{settings.name}: start of {name} at ({x:g}, {y:g}): expected a place with room to drive off, got a "
                f"nook between walls; {_nearest(cells, (x, y), settings)}"
            )
    for _, where, here, there in ways:
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


def _check_radio(settings: Settings, cells: CellMap) -> None:
    """Check that the radio range suits the cells.

    Raises:
        ConfigError: robots that claim one cell cannot hear each other.
    """
    if settings.radio.range < (least := least_range(cells.side)) - 1e-9:
        raise ConfigError(
            f"{settings.name}: radio.range: expected {least:g} m or more for cells of {cells.side:g} m, got "
            f"{settings.radio.range:g} m: robots that claim a cell must hear each other; raise it or set a smaller "
            "`traffic.cell`"
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


def _check_floor_of_starts(settings: Settings, cells: CellMap, poses: Sequence[Pose], radii: Sequence[float]) -> None:
    """Check that no two robots of a fleet of kinds reach into one cell: each holds what its body reaches into.

    Where all are alike, the cells are made small enough for that, or are what the scenario says.

    Raises:
        ConfigError: two of them do.
    """
    margin, holders = traffic_settings(settings).margin, dict[int, int]()
    for number, (pose, radius) in enumerate(zip(poses, radii, strict=True)):
        for cell in cells.cells_under_disc(pose.x, pose.y, radius + margin):
            if cell != OUTSIDE and (other := holders.setdefault(cell, number)) != number:
                one, two = (robot_names(len(poses))[robot] for robot in (other, number))
                there = poses[other]
                raise ConfigError(
                    f"{settings.name}: start: expected {one} at ({there.x:g}, {there.y:g}) and {two} at ({pose.x:g}, "
                    f"{pose.y:g}) on squares of their own, got both on one of {cells.side:g} m; move one of them, or "
                    "set a smaller `traffic.cell`"
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
