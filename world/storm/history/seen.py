"""What the laws read from a recorded run: the floor at a tick, dead robots, touched robots."""

from bisect import bisect_right
from collections.abc import Callable, Iterator, Mapping
from typing import Final

from swarm.maps.occupancy import OccupancyMap
from swarm.messages.traffic import Claim, Record
from swarm.traffic.lattice.cell_map import CellMap
from swarm.traffic.lattice.placement import cells_of
from world.faults import Health
from world.storm.history.history import History

PUSHED: Final = 400  # ticks after a contact in which a body may be outside its cells: it creeps back
EXACT: Final = 1e-6  # m and s

Found = Iterator[tuple[int, tuple[str, ...], str]]  # tick, robots, what happened
Law = Callable[[History], Found]


def floor_at(history: History, tick: int) -> OccupancyMap:
    """Return the floor as it is at a tick."""
    return next(known for since, known in reversed(history.floors) if since <= tick)


def cells_at(history: History, tick: int) -> CellMap:
    """Return the cells of the floor as it is at a tick."""
    return cells_of(floor_at(history, tick), history.settings)


def claims_of(record: Record) -> dict[int, Claim]:
    """Return a robot's oldest claim for each cell, by which it takes the cell: its path may enter a cell twice."""
    newest_first = sorted(record.claims, key=lambda claim: (claim.stamp, claim.number), reverse=True)
    return {claim.cell: claim for claim in newest_first}


def dead_of(history: History) -> set[str]:
    """Return the robots that no other can ask to move at the end: dead ones, and those that say nothing of traffic."""
    last = next((moment for moment in reversed(history.moments) if moment.health), None)
    dead = {name for name, health in last.health.items() if health is Health.DEAD} if last else set()
    return dead | history.mute


def pushes(history: History) -> Mapping[int, list[int]]:
    """Return by robot number the ticks at which something touched the robot, in order."""
    found: dict[int, set[int]] = {}
    for tick, contact, _ in history.contacts:
        found.setdefault(contact.robot, set()).add(tick)
    for moment in history.moments:
        for robot in moment.touching:
            found.setdefault(robot, set()).add(moment.tick)
    return {robot: sorted(ticks) for robot, ticks in found.items()}


def was_pushed(pushed: Mapping[int, list[int]], number: int, tick: int) -> bool:
    """Return True if something touched a robot shortly before a tick."""
    ticks = pushed.get(number, [])
    index = bisect_right(ticks, tick)
    return index > 0 and tick - ticks[index - 1] <= PUSHED
