"""The law of queues: nobody that is in reach of its stop is overtaken for ever."""

from collections.abc import Collection, Iterator
from typing import Final, NamedTuple

from swarm.maps.occupancy import Point
from swarm.storm.history.history import History, Moment
from swarm.storm.history.run_facts import Found, cells_at, cells_swept, find_pushes, was_pushed
from swarm.traffic.lattice.cell_map import OUTSIDE, CellMap
from world.faults import Health

REACH: Final = 3  # cells; a robot so near to its stop, by a free way, is in reach of it
EVERY: Final = 10  # ticks between two looks
# s with a free way in which a robot arrives if nobody is before it, and more for each robot before it. The longest of
# 1,470 arrivals in 95 runs of six profiles was 36.5 s with nobody before, 66 s with seven: 41 % of the bound at most
FIRST: Final = 90.0
EACH: Final = 15.0


class Queued(NamedTuple):
    """A robot in reach of its stop, from when it came until now."""

    robot: str
    stop: int
    before: frozenset[str]  # the others that drove to the same place when it came
    waited: float  # s with a free way


class Leg(NamedTuple):
    """Where a robot drives."""

    stop: int
    to: Point  # m
    since: Point | None  # m, the stop that it was at before; None: none


def nobody_overtaken_for_ever(history: History) -> Found:
    """Check that a robot near its stop with a free way arrives in 90 s, and 15 s for each robot before it."""
    blamed: set[tuple[str, int]] = set()
    for tick, one in queueing_robots(history):
        if one.waited > FIRST + EACH * len(one.before) and (one.robot, one.stop) not in blamed:
            blamed.add((one.robot, one.stop))
            text = f"{one.robot} was in reach of target {one.stop + 1} with a free way for {one.waited:.0f} s"
            yield tick, (one.robot,), f"{text}, and {len(one.before)} were before it"


def queueing_robots(history: History) -> Iterator[tuple[int, Queued]]:
    """Yield at each look, with its tick, the robots that are in reach of their stops with a free way.

    Cells of robots that drive to the same place, or on from it, shut nobody's way: they are the queue.
    """
    pushed = find_pushes(history)
    swept = [cells_swept(history, cells_at(history, 0), number) for number in range(len(history.robots))]
    legs: dict[str, Leg | None] = {}
    held: dict[str, Collection[int]] = {}
    queues: dict[str, Queued] = {}
    for moment in history.moments:
        held |= {name: command.held for name, command in moment.commands.items()}
        if moment.tick % EVERY or not moment.health:
            continue
        legs |= {name: _leg(history, moment, name) for name in moment.commands}
        driving = {name: leg for name, leg in legs.items() if leg is not None and _drives(history, moment, name)}
        for name, leg in driving.items():
            number, one = history.robots.index(name), queues.get(name)
            cells = cells_at(history, moment.tick, number)
            if one is not None and one.stop != leg.stop:
                one = None
                del queues[name]  # a patrol comes back to the same stop: it waits anew
            queue = {other for other, its in driving.items() if leg.to in {its.to, its.since}}
            shut = swept[number].union(*(held[other] for other in held if other not in queue))
            if was_pushed(pushed, number, moment.tick) or not _near(cells, moment.poses[number][:2], leg.to, shut):
                continue
            if one is None:
                before = (other for other, its in driving.items() if its.to == leg.to and other != name)
                one = Queued(name, leg.stop, frozenset(before), 0.0)
            queues[name] = one._replace(waited=one.waited + EVERY * history.dt)
            yield moment.tick, queues[name]


def _leg(history: History, moment: Moment, name: str) -> Leg | None:
    """Return where a robot drives as of its command, None if it has no stop left."""
    command, stops = moment.commands[name], history.stops[history.robots.index(name)]
    left = [stop for stop, there in enumerate(command.reached) if not there and stop not in command.unreachable]
    if not left:
        return None
    was_at = [stop for stop in range(left[0]) if command.reached[stop]]
    return Leg(left[0], stops[left[0]], stops[was_at[-1]] if was_at else None)


def _drives(history: History, moment: Moment, name: str) -> bool:
    """Return True if a robot can drive to its stop: it is well, takes part in traffic, and was not told to stop."""
    well = moment.health[name] is Health.WELL and name not in history.mute
    return well and name in moment.commands and not moment.senses[name].stopped


def _near(cells: CellMap, here: Point, stop: Point, shut: Collection[int]) -> bool:
    """Return True if at most ``REACH`` steps lead from a point to a stop [m] through cells that are not ``shut``."""
    start, seen = cells.cell_of(*here), {cells.cell_of(*stop)}
    if OUTSIDE in seen or not seen.isdisjoint(shut):
        return False
    for _ in range(REACH):
        seen |= {other for cell in seen for other in cells.neighbours[cell] if other not in shut}
    return start in seen
