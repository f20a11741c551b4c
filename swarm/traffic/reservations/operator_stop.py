"""A robot that was told to stop: it keeps the cells under its body and brake; no plan moves it."""

from collections.abc import Mapping

from swarm.messages.traffic import Record
from swarm.traffic.lattice.cell_map import CellMap
from swarm.traffic.reservations.presence import Footprint, given_back
from swarm.traffic.reservations.route import RouteProgress


def brought_to_rest(progress: RouteProgress, body: Footprint, cells: CellMap) -> RouteProgress:
    """Return the progress without a way, claims, and held cells ahead of the braking path."""
    free = not progress.route and not progress.following and not progress.reservations.all_claims
    if free and body.touched.issuperset(progress.reservations.held):
        return progress
    return given_back(progress, body, cells)


def kept_cells(fresh: Mapping[str, Record]) -> frozenset[int]:
    """Return the cells of the robots that were told to stop: a way leads round them, as round an obstacle."""
    return frozenset([cell for record in fresh.values() if record.stands for cell in record.held])
