"""Room: cells beside the way in which a robot would drive if it had them. It asks only for cells that none needs."""

from collections.abc import Mapping

from swarm.geometry import Pose, distance
from swarm.messages.traffic import Record
from swarm.traffic.cells import CellMap
from swarm.traffic.interface import TrafficInputs
from swarm.traffic.route_progress import BESIDE, RouteProgress
from swarm.traffic.threat import Threat


def room_beside(
    progress: RouteProgress, inputs: TrafficInputs, fresh: Mapping[str, Record], threat: Threat | None, cells: CellMap
) -> tuple[int, ...]:
    """List the cells to ask for that no other robot needs: where the tables would drive, or away from a threat.

    A robot in its head cell asks for none: it has no cell ahead to drive to.
    """
    if threat is not None:
        wished = _away(threat, inputs.pose, cells)
    elif inputs.sweeps and progress.place(cells.cell_of(*inputs.pose[:2])) < len(progress.reservations.held) - 1:
        way = [cell for cell, step in zip(progress.reservations.held, progress.steps, strict=True) if step != BESIDE]
        across = {cell + off for cell in way for off in (-1, 1, -cells.columns, cells.columns)}
        wished = [cell for cell in inputs.sweeps if cell in across]
    else:
        return ()
    needed = {k for one in fresh.values() for k in (*one.ahead, *[claim.cell for claim in one.claims], *one.held)}
    return tuple([cell for cell in wished if cell not in needed])


def _away(threat: Threat, pose: Pose, cells: CellMap) -> list[int]:
    """List the cells around the robot that it can stand in and that are farther from the threat than it is.

    From a cell that it cannot stand in, it would find no way on.
    """
    near, about = distance(threat, pose), cells.around(cells.cell_of(pose.x, pose.y), 1)
    return [cell for cell in about if cells.stands[cell] and distance(threat, cells.centre(cell)) > near]
