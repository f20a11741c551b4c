"""The cells of a scenario: the same for every robot and for the world that watches them."""

from dataclasses import replace
from functools import lru_cache
from itertools import combinations
from math import ceil, inf, log
from typing import Any, Final

from swarm.errors import ConfigError
from swarm.geometry import distance
from swarm.kinds import all_bodies
from swarm.maps.occupancy import OccupancyMap, Point
from swarm.settings import Settings
from swarm.traffic.lattice.cell_map import OUTSIDE, CellMap
from swarm.traffic.lattice.dock import find_dock, gap_to_place
from swarm.traffic.settings import TrafficConstants

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
    return build_lattice(floor, side, settings.robot.radius + OFF_LINE, offset, lean_room(settings))


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


@lru_cache(maxsize=8)  # one for each kind of robots
def build_lattice(floor: OccupancyMap, side: float, fits: float, offset: Point | None, lean: float | None) -> CellMap:
    """Return the lattice with cells of ``side`` [m] over a floor; ``fits`` [m] must be free around a cell's middle."""
    cells = CellMap(floor, side=side, radius=fits, offset=offset or (0.0, 0.0))
    return cells if lean is None else remove_unheard_joins(cells, lean)


def lean_room(settings: Settings) -> float | None:
    """Return the room [m] that a robot keeps when it leans round corners; None if walls do not stop the radio."""
    return traffic_settings(settings).leaning_room if settings.radio.line_of_sight else None


def traffic_settings(settings: Settings) -> TrafficConstants:
    """Return traffic's constants for a scenario."""
    robot, radio, bodies = settings.robot, settings.radio, all_bodies(settings)
    constants = TrafficConstants(
        tick=1.0 / settings.rate,
        every=radio.every,
        radius=robot.radius,
        top=robot.top_speed,
        widest=max(body.radius for body in bodies),
        tells_body=bool(settings.kinds),
        radio_range=radio.range,
        speed=max(body.top_speed for body in bodies),
        acceleration=max(body.wheel_acceleration for body in bodies),
        braking=min(body.wheel_acceleration for body in bodies),
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
