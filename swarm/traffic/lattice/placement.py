"""The cells of a scenario: the same for every robot and for the world that watches them."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import combinations
from math import ceil, inf, isclose, log
from typing import Any, Final

import msgspec

from swarm.errors import ConfigError
from swarm.geometry import distance, poses_on_circle
from swarm.maps.occupancy import OccupancyMap, Point
from swarm.settings import Settings
from swarm.traffic.lattice.cell_map import OUTSIDE, CellMap
from swarm.traffic.lattice.dock import find_dock, gap_to_place
from swarm.traffic.lattice.offset import PHASES, best_offset
from swarm.traffic.settings import LEAST_CLAIM, TrafficConstants

# side of a cell if the scenario gives none: at 6 radii a robot turns in it under the paper's controller; the last two
# are lanes, in which a robot can do little but follow them
RADII: Final[tuple[float, ...]] = (6.0, 5.0, 4.0, 3.0, 2.5)
LANES: Final = 4.0  # radii; a lattice of such cells or smaller is also tried with its lines in the middle of the floor
MOST_LANES: Final = 20_000  # cells; a floor of more is not tried in cells of less than ``LANES``
CROWDED: Final = 0.75  # share of the cells that robots fill, above which smaller cells are tried
# radii; a map whose squares are of such a side is its own lattice, which loses no floor
OWN: Final[tuple[float, ...]] = (4.0, 10.0)
ALIKE: Final = 1e-6  # share by which two lengths may differ that are meant to be the same: 6 x 0.2 m is not 1.2 m
OFF_LINE: Final = 0.05  # m, how far a robot may stray from the line between two cells
# Two robots that each take the other for silent may both take a cell. A lossy radio needs more broadcasts.
DEAF: Final = 3e-4  # chance that all these broadcasts are lost in one direction; in both directions: its square
UNHEARD: Final = 3e-5  # chance that a robot listens and hears nothing from a robot in range
SURE: Final = 5  # standard deviations; a ray of the map's wall reads shorter by more once in 3 million
LOSSY: Final = 0.9  # share lost; a radio that loses more is not supported
# if walls stop the radio: a robot claims one cell at a time and waits for five broadcasts; silence is common there
IN_SIGHT: Final[dict[str, Any]] = {
    "in_sight": True,
    "horizon": 1,
    "ripe": 20,
    "absent": 600,
    "plan_stuck": 400,
    "surmise": 600,
}


def cells_of(floor: OccupancyMap, settings: Settings) -> CellMap:
    """Return the lattice over a floor, as ``with_lattice`` placed it: all robots must give a cell the same number.

    Raises:
        ConfigError: The settings do not say where the lattice lies.
    """
    side, offset = _lattice_place(settings)
    return build_lattice(floor, side, settings.robot.radius + OFF_LINE, offset, _lean_room(settings))


def cells_of_learned_floor(floor: OccupancyMap, settings: Settings) -> CellMap:
    """Return the same lattice over what one robot has learned of a floor; unknown fine cells count as free.

    Raises:
        ConfigError: The settings do not say where the lattice lies.
    """
    side, offset = _lattice_place(settings)
    return CellMap(floor, side=side, radius=settings.robot.radius + OFF_LINE, offset=offset, unknown_is_free=True)


def _lattice_place(settings: Settings) -> tuple[float, Point]:
    side, offset = settings.traffic.cell, settings.traffic.offset
    if side is None or offset is None:
        raise ConfigError(
            "traffic: expected `cell` and `offset` of the lattice, got none; call swarm.scenario.prepare before the run"
        )
    return side, offset


def with_lattice(settings: Settings, floor: OccupancyMap, robots: int | None = None) -> Settings:
    """Return the settings with the lattice's place, fixed for the whole run: edits and learned walls must not shift it.

    ``robots`` is how many drive, by default those of the settings.

    A map drawn in squares that a robot can turn in is its own lattice. Otherwise the side of a cell is the largest,
    from 6 radii down to 2.5, at which a robot can reach every stop from the starts over cells, no two robots start in
    one cell, and robots can pass each other. If none serves, it is the largest at which all stops can be reached; if
    there is none either, the first is taken, and the check of the scenario refuses it.
    """
    traffic, sides = settings.traffic, _sides(settings, floor)
    robots = robots or settings.robots
    if traffic.offset is not None:
        return _set_lattice(settings, sides[0], traffic.offset)
    fits = settings.robot.radius + OFF_LINE
    tried: dict[str, list[tuple[float, Point]]] = {"serves": [], "reached": [], "docked": [], "all": []}
    for side, offset in _lattices(settings, floor, sides, robots):
        tried["all"].append((side, offset))
        cells = build_lattice(floor, side, fits, offset, _lean_room(settings))
        serves = not _count_shared_starts(cells, settings, robots) and _has_room_to_pass(cells, settings, robots)
        if _can_reach_all_stops(cells, settings):
            if serves:
                return _set_lattice(settings, side, offset)
            tried["reached"].append((side, offset))
        if _can_reach_all_stops(cells, settings, by_docks=True):
            tried["serves" if serves else "docked"].append((side, offset))
    return _set_lattice(settings, *next(places[0] for places in tried.values() if places))


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
    return best_offset(
        floor,
        side=side,
        radius=settings.robot.radius + OFF_LINE,
        missed=lambda cells: (
            _count_stops_out_of_reach(cells, settings, by_docks=by_docks)
            + _count_shared_starts(cells, settings, robots)
        ),
        centred=by_docks or side <= (LANES + ALIKE) * settings.robot.radius,
    )


def _sides(settings: Settings, floor: OccupancyMap) -> list[float]:
    """List the sides of cells to try [m], the first choice first; one that is meant to be the map's is the map's."""
    radius, own = settings.robot.radius, floor.resolution
    if settings.traffic.cell:
        sides = [settings.traffic.cell]
    else:
        fits = settings.traffic.offset is None and OWN[0] - ALIKE <= own / radius <= OWN[1] + ALIKE
        height, width = (count * own for count in floor.shape)
        sides = [own] * fits + [
            radii * radius for radii in RADII if radii >= LANES or height * width <= MOST_LANES * (radii * radius) ** 2
        ]
    return list(dict.fromkeys(own if isclose(side, own, rel_tol=ALIKE) else side for side in sides))


def lattices_tried(settings: Settings, floor: OccupancyMap) -> list[tuple[float, int]]:
    """Return the sides of cells [m] that are tried on a floor of any size, each with the number of its lattices."""
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
    stops = [*settings.targets, *settings.pool, *(stop for stops in settings.own_targets for stop in stops)]
    if settings.start.circle is not None:
        return [*stops, *(pose[:2] for pose in poses_on_circle(*settings.start.circle, settings.robots))]
    return stops + ([pose[:2] for pose in settings.start.poses or ()] if settings.return_home else [])


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
    joined += [cells.nearest_standable(*pose[:2]) for pose in settings.start.poses or ()]
    if settings.start.area is not None:
        drawn = cells_within(cells, settings.start.area)
        if len(drawn) < settings.robots:
            return False
        joined += drawn
    pieces = {cells.pieces[cell] for cell in joined}
    return len(pieces) <= 1 and OUTSIDE not in pieces


def _start_places(settings: Settings, robots: int) -> list[Point]:
    """List the places where robots start [m] that are known before the start poses are drawn."""
    if settings.start.circle is not None:
        return [pose[:2] for pose in poses_on_circle(*settings.start.circle, robots)]
    return [pose[:2] for pose in (settings.start.poses or ())[:robots]]


def _count_shared_starts(cells: CellMap, settings: Settings, robots: int) -> int:
    """Count the cells into which more than one robot reaches at its start: each would hold it."""
    body = settings.robot.radius + traffic_settings(settings).margin
    under = Counter(
        cell
        for place in _start_places(settings, robots)
        for cell in cells.cells_under_disc(*place, body)
        if cell != OUTSIDE
    )
    return sum(count > 1 for count in under.values())


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


def cells_within(cells: CellMap, area: tuple[float, float, float, float]) -> list[int]:
    """List the cells to stand in whose centres lie in the box between two corners [m]."""
    x0, y0, x1, y1 = min(area[0], area[2]), min(area[1], area[3]), max(area[0], area[2]), max(area[1], area[3])
    centres = ((cell, cells.centre(cell)) for cell in range(len(cells)) if cells.stands[cell])
    return [cell for cell, (x, y) in centres if x0 <= x <= x1 and y0 <= y <= y1]


def standable_under(cells: CellMap, place: Point, settings: Settings) -> list[int]:
    """List the cells to stand in that a robot at a place [m] reaches into; none: it is in a nook between cells."""
    return [
        cell for cell in cells.cells_under_disc(*place, settings.robot.radius) if cell != OUTSIDE and cells.stands[cell]
    ]


def comes_near(cells: CellMap, here: Point, there: Point, settings: Settings) -> bool:
    """Return True if a robot at ``here`` [m] can come within ``reach`` of a place [m] over cells.

    It may drive there straight from a cell. The result is also True if no cell to stand in is under the robot: the
    cells tell nothing then.
    """
    under, pieces = standable_under(cells, here, settings), cells.pieces
    joined = {pieces[cell] for cell in under}
    if not under or pieces[cells.cell_of(*there)] in joined:
        return True
    if find_dock(cells, there, traffic_settings(settings), lambda cell: pieces[cell] in joined) is not None:
        return True
    reachable = (cell for cell in range(len(cells)) if pieces[cell] in joined)
    nearest = min(reachable, key=lambda cell: (distance(cells.centre(cell), there), cell))
    stand = cells.move_inside(nearest, there, traffic_settings(settings).standing_room)
    return distance(stand, there) <= settings.reach


def distance_to_stop(cells: CellMap, stop: Point, settings: Settings) -> float:
    """Return how far from a stop [m] a robot stands at most; inf if there is no cell. 0: it drives straight there."""
    missed = gap_to_stop(cells, stop, settings)
    docks = missed > settings.reach and find_dock(cells, stop, traffic_settings(settings)) is not None
    return 0.0 if docks else missed


def gap_to_stop(cells: CellMap, stop: Point, settings: Settings) -> float:
    """Return how far from a stop [m] a robot stands that keeps to the cell of the stop; inf if there is no cell."""
    cell = cells.nearest_standable(*stop)
    return inf if cell == OUTSIDE else gap_to_place(cells, cell, stop, traffic_settings(settings))


@lru_cache(maxsize=4)
def build_lattice(floor: OccupancyMap, side: float, fits: float, offset: Point | None, lean: float | None) -> CellMap:
    """Return the lattice with cells of ``side`` [m] over a floor; ``fits`` [m] must be free around a cell's middle."""
    cells = CellMap(floor, side=side, radius=fits, offset=offset or (0.0, 0.0))
    return cells if lean is None else remove_unheard_joins(cells, lean)


def _lean_room(settings: Settings) -> float | None:
    """Return the room [m] that a robot keeps when it leans round corners; None if walls do not stop the radio."""
    return traffic_settings(settings).leaning_room if settings.radio.line_of_sight else None


def traffic_settings(settings: Settings) -> TrafficConstants:
    """Return traffic's constants for a scenario."""
    robot, radio = settings.robot, settings.radio
    constants = TrafficConstants(
        tick=1.0 / settings.rate,
        every=radio.every,
        radius=robot.radius,
        radio_range=radio.range,
        speed=robot.top_speed,
        acceleration=robot.wheel_acceleration,
        sensor_range=settings.sensors.range,
        reach=settings.reach,
        learns=not settings.map.known,
    )
    fresh = max(constants.fresh, constants.every * _longest_loss_run(radio.loss, DEAF))
    later = max(0, fresh + constants.gap - constants.absent)
    constants = replace(
        constants,
        ripe=max(constants.ripe, 2 * constants.every),
        fresh=fresh,
        unexpected=max(constants.unexpected, SURE * settings.sensors.noise),
        absent=constants.absent + later,
        plan_stuck=constants.plan_stuck + later,
        surmise=constants.surmise + later,
        listen=max(constants.listen, constants.often * _longest_loss_run(radio.loss, UNHEARD)),
    )
    return replace(constants, **IN_SIGHT) if radio.line_of_sight else constants


def _longest_loss_run(loss: float, chance: float) -> int:
    """Return how many broadcasts in a row are all lost with at most ``chance``, if the share ``loss`` is lost."""
    return ceil(log(chance) / log(min(loss, LOSSY))) if loss > 0.0 else 0


def remove_unheard_joins(cells: CellMap, room: float) -> CellMap:
    """Return the cells without joins over which two robots could want one cell and not hear each other round a corner.

    A robot claims a cell from the middle of its own. If walls hide another robot from there, it leans towards the cell
    that it claims; ``room`` [m] is what it then keeps to the edge. If two robots that want one cell do not even see
    each other then, the cell is entered from one side only: from the cell with the lower number.
    """
    parted = True
    while parted:
        parted = False
        for cell in range(len(cells)):
            for one, other in combinations(sorted(cells.neighbours[cell]), 2):
                if not cells.in_sight(_claim_point(cells, one, cell, room), _claim_point(cells, other, cell, room)):
                    cells = cells.without_joins([(cell, other)])
                    parted = True
                    break
    return cells


def _claim_point(cells: CellMap, cell: int, towards: int, room: float) -> Point:
    return cells.leaning_point(cell, towards, room) if cells.is_blind(cell, towards) else cells.centre(cell)
