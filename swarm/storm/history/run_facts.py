"""What the laws read from a recorded run: the floor at a tick, dead and touched robots, and which cells robots take."""

from bisect import bisect_right
from collections.abc import Callable, Iterator, Mapping
from math import hypot
from typing import Final, NamedTuple

from swarm.geometry import distance
from swarm.maps.occupancy import OccupancyMap
from swarm.messages.traffic import Claim, Record
from swarm.robot.pose_estimate import BOUND
from swarm.storm.history.history import History, Moment
from swarm.traffic.lattice.cell_map import OUTSIDE, CellMap
from swarm.traffic.lattice.placement import cells_of
from world.bodies.movers import Patrol
from world.faults import SILENT, Health

PUSHED: Final = 400  # ticks after a contact in which a body may be outside its cells: it creeps back
PUT_BACK: Final = 20  # ticks after those that a new world repeats in which the same holds: the robot has not moved
MISPLACED: Final = 200  # ticks after a pose was worse than told in which the same holds: the robot looks for itself
EXACT: Final = 1e-6  # m and s
AWAY: Final = 20  # ticks without a step after which a robot starts with new reservations
SHARES: Final = 200  # places along a moving obstacle's path

Found = Iterator[tuple[int, tuple[str, ...], str]]  # tick, robots, what happened
Law = Callable[[History], Found]


def floor_at(history: History, tick: int) -> OccupancyMap:
    """Return the floor as it is at a tick."""
    return next(known for since, known in reversed(history.floors) if since <= tick)


def cells_at(history: History, tick: int, number: int = 0) -> CellMap:
    """Return the cells of the floor as it is at a tick, and as they are joined for a robot; all have the same cells."""
    return cells_of(floor_at(history, tick), history.settings_of(number))


def cells_swept(history: History, cells: CellMap, number: int) -> frozenset[int]:
    """Return the cells in which a robot's body may meet a moving obstacle."""
    settings, found = history.settings, set[int]()
    for mover in settings.movers:
        patrol, radius = Patrol(mover), mover.radius or hypot(*(mover.size or (0.0, 0.0))) / 2
        along = [patrol.pose_at(share / SHARES * patrol.period)[:2] for share in range(SHARES)]
        found.update(cells.swept_cells(along, radius + history.body(number).radius))
    return frozenset(found)


def claims_of(record: Record) -> dict[int, Claim]:
    """Return a robot's oldest claim for each cell, by which it takes the cell: its path may enter a cell twice."""
    newest_first = sorted(record.claims, key=lambda claim: (claim.stamp, claim.number), reverse=True)
    return {claim.cell: claim for claim in newest_first}


def dead_of(history: History) -> set[str]:
    """Return the robots that no other can ask to move at the end: dead ones, and those that say nothing of traffic."""
    last = next((moment for moment in reversed(history.moments) if moment.health), None)
    dead = {name for name, health in last.health.items() if health is Health.DEAD} if last else set()
    return dead | history.mute


class Pushes(NamedTuple):
    """What has moved robots that did not mean to move: by robot number, ticks in order."""

    touched: Mapping[int, list[int]]  # by something
    put_back: Mapping[int, list[int]]  # by a new world, which goes on from before the last one died
    misplaced: Mapping[int, list[int]]  # nothing has: it was told a pose that was worse than it was said to be


def find_pushes(history: History) -> Pushes:
    """Return what has moved robots that did not mean to move."""
    found: dict[int, set[int]] = {}
    for tick, contact, _ in history.contacts:
        found.setdefault(contact.robot, set()).add(tick)
    for moment in history.moments:
        for robot in moment.touching:
            found.setdefault(robot, set()).add(moment.tick)
    return Pushes({robot: sorted(ticks) for robot, ticks in found.items()}, history.put_back, _find_misplaced(history))


def _find_misplaced(history: History) -> dict[int, list[int]]:
    """Return the ticks at which each robot was told a pose that was worse than it was said to be."""
    found: dict[int, list[int]] = {}
    if history.settings.localisation.exact:
        return found
    for moment in history.moments:
        for number, (name, pose) in enumerate(zip(history.robots, moment.poses, strict=True)):
            sense = moment.senses.get(name)
            if sense is not None and distance((sense.x, sense.y), pose) > BOUND * sense.pose_error + EXACT:
                found.setdefault(number, []).append(moment.tick)
    return found


def was_pushed(pushed: Pushes, number: int, tick: int) -> bool:
    """Return True if something has moved a robot shortly before a tick, or it was told that it is elsewhere."""
    reasons = (pushed.touched, PUSHED), (pushed.put_back, PUT_BACK), (pushed.misplaced, MISPLACED)
    return any(_is_soon_after(ticks.get(number, []), tick, within) for ticks, within in reasons)


def _is_soon_after(ticks: list[int], tick: int, within: int) -> bool:
    index = bisect_right(ticks, tick)
    return index > 0 and tick - ticks[index - 1] <= within


def iterate_new_cells(history: History) -> Iterator[tuple[Moment, dict[str, frozenset[int]]]]:
    """Return each moment with the cells that each robot holds and did not hold before.

    A robot is left out if it just began or was away, drives unconstrained because nobody is in range, or was pushed.
    """
    pushed = find_pushes(history)
    before: dict[str, tuple[int, frozenset[int], bool]] = {}  # tick, held, unconstrained
    said: dict[str, list[int]] = {}  # what each said last that it holds
    for moment in history.moments:
        grown: dict[str, frozenset[int]] = {}
        for name, command in moment.commands.items():
            was = before.get(name)
            if was is not None and command.held == said[name]:
                before[name] = moment.tick, was[1], command.unconstrained
                continue
            said[name], held = command.held, frozenset(command.held) - {OUTSIDE}
            before[name] = moment.tick, held, command.unconstrained
            if was is None or _begins(history, moment, name, was[0]) or command.unconstrained or was[2]:
                continue
            if held - was[1] and not was_pushed(pushed, history.robots.index(name), moment.tick):
                grown[name] = held - was[1]
        yield moment, grown


def _begins(history: History, moment: Moment, name: str, last: int) -> bool:
    """Return True if a robot whose last step was at tick ``last`` starts again: it was away, or has a new process."""
    return moment.tick - last > AWAY or _health_before(history, moment, name) in SILENT


def has_new_process(history: History, moment: Moment, name: str) -> bool:
    """Return True in the first tick of a robot's new process."""
    return name in moment.commands and _health_before(history, moment, name) is Health.AWAY


def _health_before(history: History, moment: Moment, name: str) -> Health | None:
    index = moment.tick - history.moments[0].tick
    return history.moments[index - 1].health.get(name) if index > 0 else None
