"""Room: cells beside the way in which a robot would drive if it had them. It asks only for cells that none needs.

A robot that such a cell led away from its way, so that only a corner is between them, asks for a cell on the way back.

Before a threat it asks for all cells that nobody holds: a robot that plans to drive there later can wait.
"""

from collections.abc import Mapping, Sequence

from swarm.geometry import Pose, distance
from swarm.messages.traffic import Record
from swarm.traffic.lattice.cell_map import CellMap
from swarm.traffic.reservations.route import BESIDE, RouteProgress


def room_beside(
    progress: RouteProgress,
    pose: Pose,
    sweeps: Sequence[int],
    fresh: Mapping[str, Record],
    threats: Sequence[tuple[float, ...]],
    cells: CellMap,
) -> tuple[int, ...]:
    """List the cells to ask for: back to the way, then where the tables would drive; or away from threats.

    ``sweeps`` are the cells that the tables would drive over; ``threats`` are points [m], of which x and y count.
    Without a threat, a robot in its head cell asks for none: it has no cell ahead to drive to.
    """
    if threats:
        held = {cell for one in fresh.values() for cell in one.held}
        return tuple([cell for cell in _away(threats, pose, cells) if cell not in held])
    here = cells.cell_of(*pose[:2])
    back = [cell for cell in way_back(progress, here, cells) if not _is_wanted(cell, fresh)]
    if not sweeps or progress.place(here) >= len(progress.reservations.held) - 1:
        return tuple(back)
    beside = _beside(progress, cells)
    return (*back, *[cell for cell in sweeps if cell in beside and not _is_wanted(cell, fresh)])


def way_back(progress: RouteProgress, here: int, cells: CellMap) -> tuple[int, ...]:
    """List the cells between a robot's cell ``here`` beside its way and the cells of its way.

    There are none if it is on its way, or if its cell and one of the way share a side.
    """
    if not progress.strayed(here):
        return ()
    beside = _beside(progress, cells)
    if here in beside:
        return ()
    return tuple([cell for cell in cells.beside(here) if cell in beside and cells.is_passable(here, cell)])


def _beside(progress: RouteProgress, cells: CellMap) -> set[int]:
    """Return the cells that share a side with a cell of the way that the robot holds, no wall all along it."""
    held = zip(progress.reservations.held, progress.steps, strict=True)
    way = [cell for cell, step in held if step != BESIDE]
    return {near for cell in way for near in cells.beside(cell) if cells.is_passable(cell, near)}


def _is_wanted(cell: int, fresh: Mapping[str, Record]) -> bool:
    """Return True if a robot holds or claims a cell, or its way leads there."""
    return any(
        cell in one.held or cell in one.ahead or any(claim.cell == cell for claim in one.claims)
        for one in fresh.values()
    )


def _away(threats: Sequence[tuple[float, ...]], pose: Pose, cells: CellMap) -> list[int]:
    """List the cells around the robot that it can stand in and that are farther from the nearest threat than it is.

    From a cell that it cannot stand in, it would find no way on.
    """

    def gap(place: tuple[float, ...]) -> float:
        return min(distance(threat, place) for threat in threats)

    about = cells.around(cells.cell_of(pose.x, pose.y), 1)
    return [cell for cell in about if cells.stands[cell] and gap(cells.centre(cell)) > gap(pose)]
