"""The choice of a scenario's cells, before its run: how large they are, and where they lie on the floor."""

from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import pairwise, zip_longest
from math import isclose
from random import Random
from typing import Final

import msgspec

from swarm.geometry import poses_on_circle
from swarm.kinds import kind_starts, kind_targets, list_kinds, list_views, settings_of, settings_of_widest, start_of
from swarm.maps.occupancy import OccupancyMap, Point
from swarm.settings import Settings
from swarm.traffic.joint.goals import assign_goals
from swarm.traffic.lattice.cell_map import OUTSIDE, CellMap
from swarm.traffic.lattice.dock import find_dock, find_way_out
from swarm.traffic.lattice.offset import PHASES, best_offset
from swarm.traffic.lattice.placement import (
    OFF_LINE,
    build_lattice,
    cells_within,
    distance_to_stop,
    gap_to_stop,
    lean_room,
    traffic_settings,
)
from swarm.traffic.mapf.planner import Budget, JointSearch, SearchOutcome
from swarm.traffic.settings import LEAST_CLAIM

# side of a cell if the scenario gives none: at 6 radii a robot turns in it under the paper's controller; the last two
# are lanes, in which a robot can do little but follow them
RADII: Final[tuple[float, ...]] = (6.0, 5.0, 4.0, 3.0, 2.5)
LANES: Final = 4.0  # radii; a lattice of such cells or smaller is also tried with its lines in the middle of the floor
FINER: Final = 8  # offsets tried along each axis for such cells: starts may lie on the line between two lanes
FINER_CELLS: Final = 1_000  # cells of a floor, at most, for which so many are tried
MOST_LANES: Final = 20_000  # cells; a floor of more is not tried in cells of less than ``LANES``
CROWDED: Final = 0.75  # share of the cells that robots fill, above which smaller cells are tried
# radii; a map whose squares are of such a side is its own lattice, which loses no floor
OWN: Final[tuple[float, ...]] = (4.0, 10.0)
SMALL: Final = 80  # cells of a floor, at most, on which a plan for all robots is looked for before the run
FEW: Final = 8  # robots in such a plan, at most
SEARCH: Final = Budget(starts=4, expansions=3_000, enough=0)
ALIKE: Final = 1e-6  # share by which two lengths may differ that are meant to be the same: 6 x 0.2 m is not 1.2 m


def with_lattice(settings: Settings, floor: OccupancyMap, robots: int | None = None) -> Settings:
    """Return the settings with the lattice's place, fixed for the whole run: edits and learned walls must not shift it.

    ``robots`` is how many drive, by default those of the settings.

    A map drawn in squares that a robot can turn in is its own lattice. Otherwise the side of a cell is the largest,
    from 6 radii down to 2.5, at which a robot can reach every stop from the starts over cells, no two robots start in
    one cell, robots can pass each other, and on a small floor a plan is found for all of them. If none serves, it is
    the one that fails the latest of these tests; stops that are not reached are refused by the check of the scenario.
    Of a fleet of several kinds, radii are those of the widest: each body has to fit in one cell.
    """
    return _set_lattice(settings, *_choose_lattice(settings_of_widest(settings), floor, robots or settings.count))


def _choose_lattice(settings: Settings, floor: OccupancyMap, robots: int) -> tuple[float, Point | None]:
    """Return side and offset [m] of the best cells; the settings are those of the widest robots."""
    traffic, sides, views = settings.traffic, _sides(settings, floor), list_views(settings)
    if traffic.offset is not None:
        return sides[0], traffic.offset
    best: tuple[tuple[bool, int, bool, bool, bool], float, Point] | None = None
    for side, offset in _lattices(settings, floor, sides, robots):
        cells = _cells_for(settings, floor, side, offset)
        seen = [(_cells_for(view, floor, side, offset), view) for view in views]
        inside = all(_can_reach_all_stops(own, view) for own, view in seen)
        reached = inside or all(_can_reach_all_stops(own, view, by_docks=True) for own, view in seen)
        poor, can_pass = _count_poor_starts(cells, settings, robots), _has_room_to_pass(cells, settings, robots)
        solved = reached and can_pass and not poor and _can_all_arrive(cells, settings, robots)
        worth = reached, -poor, can_pass, solved, inside
        if best is None or worth > best[0]:
            best = worth, side, offset
        if solved and inside:
            break
    assert best is not None
    return best[1:]


def _cells_for(settings: Settings, floor: OccupancyMap, side: float, offset: Point) -> CellMap:
    """Return the cells of a lattice as they are joined for the robot of the settings."""
    return build_lattice(floor, side, settings.robot.radius + OFF_LINE, offset, lean_room(settings))


def _lattices(
    settings: Settings, floor: OccupancyMap, sides: Sequence[float], robots: int
) -> Iterator[tuple[float, Point]]:
    """Yield the lattices to try: of each side the one that misses fewest stops, then the one with most lanes."""
    for side in sides:
        if _is_own_lattice(settings, floor, side):
            yield side, (0.0, 0.0)
            continue
        yield side, _offset_for(settings, floor, side, robots)
        if side < (RADII[0] - ALIKE) * settings.robot.radius:
            yield side, _offset_for(settings, floor, side, robots, by_docks=True)


def _offset_for(settings: Settings, floor: OccupancyMap, side: float, robots: int, *, by_docks: bool = False) -> Point:
    """Return the best lattice offset [m] for cells of ``side`` [m] under the starts and stops of a scenario.

    Stops that robots drive to straight from a cell count as missed, unless ``by_docks``.
    """
    views = list_views(settings)
    centred = by_docks or side <= (LANES + ALIKE) * settings.robot.radius
    return best_offset(
        floor,
        side=side,
        radius=settings.robot.radius + OFF_LINE,
        missed=lambda cells: (
            sum(_count_stops_out_of_reach(_cells_like(cells, view), view, by_docks=by_docks) for view in views)
            + _count_poor_starts(cells, settings, robots)
        ),
        centred=centred,
        phases=FINER if centred and _area(floor) <= FINER_CELLS * side**2 else PHASES,
        places=[*_start_places(settings, robots), *_stops(settings)],
    )


def _cells_like(cells: CellMap, view: Settings) -> CellMap:
    """Return cells as they are joined for the robot of the settings."""
    radius = view.robot.radius + OFF_LINE
    return cells if radius == cells.radius else cells.for_radius(radius)


def _sides(settings: Settings, floor: OccupancyMap) -> list[float]:
    """List the sides of cells to try [m], the first choice first; one that is meant to be the map's is the map's."""
    radius, own = settings.robot.radius, floor.resolution
    if settings.traffic.cell:
        sides = [settings.traffic.cell]
    else:
        fits = settings.traffic.offset is None and OWN[0] - ALIKE <= own / radius <= OWN[1] + ALIKE
        sides = [own] * fits + [
            radii * radius for radii in RADII if radii >= LANES or _area(floor) <= MOST_LANES * (radii * radius) ** 2
        ]
    return list(dict.fromkeys(own if isclose(side, own, rel_tol=ALIKE) else side for side in sides))


def _area(floor: OccupancyMap) -> float:
    """Return the area of a map [m2]."""
    return floor.cells.size * floor.resolution**2


def lattices_tried(settings: Settings, floor: OccupancyMap) -> list[tuple[float, int]]:
    """Return the sides of cells [m] that are tried on a floor of any size, each with the number of its lattices."""
    settings = settings_of_widest(settings)
    sides = _sides(settings, floor)
    if settings.traffic.offset is not None:
        return [(sides[0], 1)]
    large = [side for side in sides if side >= (LANES - ALIKE) * settings.robot.radius] or sides[:1]
    return [(side, 1 if _is_own_lattice(settings, floor, side) else PHASES * PHASES) for side in large]


def _is_own_lattice(settings: Settings, floor: OccupancyMap, side: float) -> bool:
    """Return True if the squares of the map's drawing are the cells: they have ``side`` [m], and are no mere lanes."""
    given = settings.traffic.cell is not None or side >= (LANES - ALIKE) * settings.robot.radius
    return given and side == floor.resolution


def _set_lattice(settings: Settings, cell: float, offset: Point | None) -> Settings:
    traffic = msgspec.structs.replace(settings.traffic, cell=cell, offset=offset)
    return msgspec.structs.replace(settings, traffic=traffic)


def _stops(settings: Settings) -> list[Point]:
    """List the places to go to that are known before the start poses are drawn [m]; on a circle, starts are targets."""
    own = (stop for stops in settings.own_targets for stop in stops)
    stops = [*settings.targets, *kind_targets(settings), *settings.pool, *own]
    if settings.start.circle is not None:
        return [*stops, *(pose[:2] for pose in poses_on_circle(*settings.start.circle, settings.count))]
    return stops + (_all_starts(settings) if settings.return_home else [])


def _all_starts(settings: Settings) -> list[Point]:
    """List the starts [m] that the scenario lists, also those of no robot."""
    sections = (settings.start, *kind_starts(settings))
    return [pose[:2] for section in sections for pose in section.poses or ()]


def _count_stops_out_of_reach(cells: CellMap, settings: Settings, *, by_docks: bool = False) -> int:
    away = distance_to_stop if by_docks else gap_to_stop
    return sum(away(cells, stop, settings) > settings.reach for stop in _stops(settings))


def _can_reach_all_stops(cells: CellMap, settings: Settings, *, by_docks: bool = False) -> bool:
    """Return True if a robot can reach all stops from all starts: from inside their cells, or ``by_docks`` too."""
    constants = traffic_settings(settings)
    if constants.claim_radius < LEAST_CLAIM * cells.side:
        return False
    docks = [find_dock(cells, stop, constants) if by_docks else None for stop in _stops(settings)]
    missed = [gap_to_stop(cells, stop, settings) > settings.reach for stop in _stops(settings)]
    if any(far and dock is None for far, dock in zip(missed, docks, strict=True)):
        return False
    joined = [
        dock.cell if dock is not None else cells.nearest_standable(*stop)
        for stop, dock in zip(_stops(settings), docks, strict=True)
    ]
    joined += [_first_cell(cells, start, settings) for start in _all_starts(settings)]
    for section in (settings.start, *kind_starts(settings)):
        if section.area is not None:
            drawn = cells_within(cells, section.area)
            if len(drawn) < sum(start_of(settings, number)[0] is section for number in range(settings.count)):
                return False
            joined += drawn
    pieces = {cells.pieces[cell] for cell in joined}
    return len(pieces) <= 1 and OUTSIDE not in pieces


def _first_cell(cells: CellMap, start: Point, settings: Settings) -> int:
    """Return the cell over which a robot begins its way from a start [m]; OUTSIDE: none."""
    here = cells.cell_of(*start)
    if here != OUTSIDE and cells.stands[here]:
        return here
    return find_way_out(cells, start, settings.robot.radius)


def _last_cell(cells: CellMap, stop: Point, settings: Settings) -> int:
    """Return the cell from which a robot reaches a stop [m]."""
    dock = find_dock(cells, stop, traffic_settings(settings))
    return cells.nearest_standable(*stop) if dock is None else dock.cell


def _start_places(settings: Settings, robots: int) -> list[Point]:
    """List the places where robots start [m] that are known before the start poses are drawn."""
    if settings.start.circle is not None:
        return [pose[:2] for pose in poses_on_circle(*settings.start.circle, robots)]
    placed = (start_of(settings, number) for number in range(robots))
    return [section.poses[place][:2] for section, place in placed if place < len(section.poses or ()) and section.poses]


def _count_poor_starts(cells: CellMap, settings: Settings, robots: int) -> int:
    """Count the starts in cells where no robot can stand, and the cells into which more than one robot reaches.

    Who starts where no robot can stand is in no joint plan before it has left; and each robot holds what it reaches.
    """
    margin, kinds, places = traffic_settings(settings).margin, list_kinds(settings), _start_places(settings, robots)
    own = [settings_of(settings, kind).robot.radius for kind in kinds] if settings.kinds else []
    radii = own or [settings.robot.radius] * len(places)
    under = Counter(
        cell
        for place, radius in zip(places, radii, strict=False)
        for cell in cells.cells_under_disc(*place, radius + margin)
        if cell != OUTSIDE
    )
    off = sum(cell == OUTSIDE or not cells.stands[cell] for cell in (cells.cell_of(*place) for place in places))
    return off + sum(count > 1 for count in under.values())


def _has_room_to_pass(cells: CellMap, settings: Settings, robots: int) -> bool:
    """Return True if robots can change their order on the cells where they drive, and do not fill them.

    On a single row of cells none can pass another. Without a known place, all cells count.
    """
    if robots < 2:
        return True
    known = {
        cells.pieces[cells.nearest_standable(*place)] for place in (*_start_places(settings, robots), *_stops(settings))
    }
    used = [cell for cell in range(len(cells)) if cells.stands[cell] and (not known or cells.pieces[cell] in known)]
    if robots > CROWDED * len(used):
        return False
    joins = [len(cells.neighbours[cell]) for cell in used]
    # a graph in one piece without a branch is a row or a ring; a ring has as many joins as cells
    return max(joins, default=0) > 2 or sum(joins) >= 2 * len(used)


def _can_all_arrive(cells: CellMap, settings: Settings, robots: int) -> bool:
    """Return True unless a search finds no plan in which all robots drive from one place of theirs to the next.

    It is asked on a small floor only, where few cells may leave no room to change the order; on a large one there is.
    """
    if not 2 <= robots <= FEW or sum(cells.stands) > SMALL or settings.kinds:
        return True  # of several kinds, each has its own joins
    starts, stops = _start_places(settings, robots), settings.own_targets[:robots]
    if len(starts) < robots or len(stops) < robots:
        return True
    heads = [_first_cell(cells, start, settings) for start in starts]
    if len(set(heads)) < robots or OUTSIDE in heads:
        return True
    together = [heads]
    for places in zip_longest(*stops):
        leg = [_last_cell(cells, stop, settings) for stop in places if stop is not None]
        shared = len(set(leg)) < len(leg)
        if len(leg) == robots and not shared and OUTSIDE not in leg:
            together.append(leg)
        for robot, stop in enumerate(places):
            if stop is not None and not _can_come_alone(cells, settings, heads, robot, stop, shared=shared):
                return False
    return all(_is_solved(cells, *legs) for legs in pairwise(together))


def _can_come_alone(
    cells: CellMap, settings: Settings, heads: Sequence[int], robot: int, stop: Point, *, shared: bool
) -> bool:
    """Return True unless no plan is found in which a robot comes to a stop [m] and no other is in a cell that it needs.

    It is asked where robots share the stop's cell or the robot needs others besides. Each leg can be driven backwards,
    so it does not matter where the others are before.
    """
    dock = find_dock(cells, stop, constants := traffic_settings(settings))
    cell = _last_cell(cells, stop, settings)
    if (dock is None and not shared) or cell == OUTSIDE:
        return True
    needs = dock.cells_beside(cells, constants) if dock is not None else ()
    names = {str(number): head for number, head in enumerate(heads)}
    wishes = names | {str(robot): cell}
    since, others = dict.fromkeys(names, 0), names.keys() - {str(robot)}
    found = assign_goals(cells, names, wishes, (), since, others, kept_free=needs)
    goals = [found[name] for name in names]
    return goals[robot] == cell and set(needs).isdisjoint(goals) and _is_solved(cells, heads, goals)


def _is_solved(cells: CellMap, starts: Sequence[int], goals: Sequence[int]) -> bool:
    """Return True if a plan is found in which each robot drives from its start to its goal."""
    tables = [cells.distances(goal) for goal in goals]
    search = JointSearch(cells.neighbours, tables, tuple(starts), tuple(goals), budget=SEARCH, random=Random(0))
    while (found := search.advance(SEARCH.expansions)) is None:
        pass
    return found.outcome is SearchOutcome.SOLVED
