"""The body and its cells: what a robot has to hold because its body is there, whatever it wants."""

from collections.abc import Collection, Mapping
from math import hypot
from typing import Final, NamedTuple

from swarm.geometry import Pose
from swarm.messages.traffic import Record
from swarm.traffic.interface import TrafficInputs
from swarm.traffic.lattice.cell_map import OUTSIDE, CellMap
from swarm.traffic.reservations.route import ALONE, BESIDE, RouteProgress
from swarm.traffic.reservations.rules import Reservations
from swarm.traffic.settings import TrafficConstants

VIEW: Final = 2  # cells around the body that count while no robot is near
OFF_WAY: Final = 30  # ticks off its way after which a robot begins its way again where it is


class Footprint(NamedTuple):
    """The body of a robot: where it is, and which cells it reaches into."""

    tick: int
    pose: Pose
    cell: int
    touched: frozenset[int]  # cells that it reaches into, now and until it has come to rest


def footprint_of(inputs: TrafficInputs, radius: float, cells: CellMap) -> Footprint:
    """Return the body, as a disc [m]."""
    x, y, _ = inputs.pose
    touched = cells.swept(((x, y),), radius)
    if len(inputs.braking):
        touched |= cells.swept(inputs.braking, radius)
    return Footprint(inputs.tick, inputs.pose, cells.cell_of(x, y), touched)


def begun(
    number: int, body: Footprint, touched: frozenset[int], cells: CellMap, held: Collection[int] = ()
) -> RouteProgress:
    """Begin a way where the robot is, holding only cells that it touches. ``number`` is that of its next claim.

    Where it can stand in none of them, it keeps the nearest cell to stand in of those ``held`` until now: it takes no
    cell that it neither touches nor held. Only where ``touched`` is empty (the body is outside of all cells) and it
    can stand in none of those held does it take the nearest cell to stand in of the map.
    """
    x, y, _ = body.pose
    standable = [cell for cell in touched if cells.stands[cell]] or [cell for cell in held if cells.stands[cell]]
    if standable or not touched:
        head = cells.nearest_standable(x, y, standable)
    else:
        head = body.cell if body.cell in touched else min(touched)
    kept = (*sorted(touched - {head}), head)
    return RouteProgress(Reservations(kept, (), number), (BESIDE,) * (len(kept) - 1) + (ALONE,))


def restart_here(progress: RouteProgress, body: Footprint, cells: CellMap) -> RouteProgress:
    """Begin the way again where the robot is. It holds new cells only if it touches none of those held."""
    held = progress.reservations.held
    touched = body.touched & frozenset(held) or body.touched
    return begun(progress.reservations.number, body, touched, cells, held)


def after_sleep(progress: RouteProgress | None, body: Footprint, cells: CellMap) -> RouteProgress:
    """Return the progress of a robot that has just started or was away."""
    if progress is None:
        return begun(body.tick * 64 + 1, body, body.touched, cells)
    if body.touched <= set(progress.reservations.held) and not progress.strayed(body.cell):
        return progress.awoken(body.touched)
    return restart_here(progress, body, cells)


def hold_under_body(progress: RouteProgress, body: Footprint, cells: CellMap, radius: float) -> RouteProgress:
    """Add the cells under the body to the held cells: the robot was pushed, or drove badly."""
    if body.touched.issubset(progress.reservations.held):
        return progress
    under = frozenset(cells.touched(body.pose.x, body.pose.y, radius)) - {OUTSIDE}
    return progress.widened(under)


def given_back(progress: RouteProgress, body: Footprint, cells: CellMap) -> RouteProgress:
    """Drop the way, the claims, and the held cells ahead of the braking path."""
    if BESIDE in progress.steps:  # the cell behind may not be one to stand in
        return restart_here(progress, body, cells)
    return progress.given_back(body.touched)


def brought_to_rest(progress: RouteProgress, body: Footprint, cells: CellMap) -> RouteProgress:
    """Return the progress of a robot that was told to stop: it keeps the cells under its body and brake."""
    free = not progress.route and not progress.following and not progress.reservations.all_claims
    if free and body.touched.issuperset(progress.reservations.held):
        return progress
    return given_back(progress, body, cells)


def spread(
    progress: RouteProgress, inputs: TrafficInputs, cells: CellMap, settings: TrafficConstants
) -> tuple[RouteProgress, Footprint]:
    """Hold all cells that the body could reach within two ticks: in free drive it may leave the cells held so far."""
    radius = settings.radius + settings.margin + 2 * settings.speed * settings.tick
    body = footprint_of(inputs, radius, cells)
    progress = progress.widened(body.touched)
    if progress.strayed(body.cell) and cells.stands[body.cell]:
        progress = begun(progress.reservations.number, body, body.touched, cells)
    return progress, body


def free_drive_cells(
    body: Footprint,
    others: Mapping[str, Record],
    fresh: Mapping[str, Record],
    cells: CellMap,
    settings: TrafficConstants,
) -> tuple[int, ...]:
    """List the free-drive cells: those around the body, if no robot is near enough to ask for any of them, else ().

    The robot then holds what its body and its brake need, and nothing constrains the fuzzy tables.
    """
    (x, y, _), alone = body.pose, settings.alone
    for record in fresh.values():
        if hypot(record.x - x, record.y - y) < alone:
            return ()
    theirs = {cell for record in others.values() for cell in (*record.held, *(claim.cell for claim in record.claims))}
    about = cells.around(body.cell, VIEW)
    return () if not theirs.isdisjoint(about) else tuple(cell for cell in about if cells.stands[cell])


class OffRoute:
    """Notices when a robot has been off its way for long."""

    def __init__(self) -> None:
        self._fled = False  # off its way, because it fled from a threat
        self._on_way = 0  # tick

    def keep_on_way(
        self, progress: RouteProgress, body: Footprint, cells: CellMap, *, threatened: bool
    ) -> RouteProgress:
        """Begin the way again where the robot is, if it has been off it for long.

        A robot in a joint plan begins again only if it fled, or is not next to its way: if it uses room beside its way,
        it comes back. Call it once a tick.
        """
        strayed = progress.strayed(body.cell)
        self._fled = strayed and (self._fled or threatened)
        if not strayed or (progress.following and not self._fled and progress.is_beside(body.cell, cells)):
            self._on_way = body.tick
        elif body.tick - self._on_way > OFF_WAY and body.cell != OUTSIDE and cells.stands[body.cell]:
            self._on_way = body.tick
            return restart_here(progress, body, cells)
        return progress
