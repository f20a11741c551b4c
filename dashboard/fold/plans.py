"""The joint plans under way: which robots follow them, the remaining paths, and the order in which cells are entered.

Pure: computed from each robot's own record and from the plans that leaders sent. Cells are numbers of the ``CellMap``.
"""

from collections.abc import Iterable, Mapping, Sequence
from itertools import groupby
from math import inf
from typing import NamedTuple

from swarm.messages.traffic import Epoch, JointPlan, Record

Visit = tuple[str, int]  # a robot, and the index of the cell on its path


class Followed(NamedTuple):
    """A joint plan under way."""

    leader: str
    ways: dict[str, tuple[int, ...]]  # robot -> cells from the rearmost that it holds to the end
    turns: dict[int, tuple[str, ...]]  # cell -> robots that will enter it, in order; each order is listed once


def plans_under_way(records: Mapping[str, Record], plans: Mapping[Epoch, JointPlan]) -> list[Followed]:
    """Return the plans under way, the oldest first; a plan is done when no robot has any of it left to drive.

    ``records`` are the newest of each robot. If a plan is not in ``plans``, only its robots' next cells are known.
    """
    found = []
    for epoch in sorted({record.epoch for record in records.values() if record.epoch is not None}):
        members = {robot: record for robot, record in sorted(records.items()) if record.epoch == epoch}
        plan = plans.get(epoch)
        ways = {robot: _way(record, plan) for robot, record in members.items()}
        if any(len(way) > 1 for way in ways.values()):
            found.append(Followed(epoch.leader, ways, {} if plan is None else _turns(plan, members)))
    return found


def sort_by_turn(robots: Sequence[str], records: Mapping[str, Record], plans: Mapping[Epoch, JointPlan]) -> list[str]:
    """Return robots that drive to one target in the order of their turns there.

    The members of one joint plan change places among themselves, into the order in which it leads them into the cell of
    the target, or to the end of their ways if that is near it. All others stay where they are in ``robots``.
    """
    order = list(robots)
    for epoch, plan in plans.items():
        members = {robot: record for robot, record in records.items() if record.epoch == epoch and robot in plan.ways}
        if len(members.keys() & set(robots)) > 1:
            times = _times(plan, members)
            turn_of = {robot: times[robot][_last_step(plan, members[robot])] for robot in robots if robot in members}
            members_in_turn = iter(sorted(turn_of, key=turn_of.__getitem__))
            order = [next(members_in_turn) if robot in turn_of else robot for robot in order]
    return order


def _last_step(plan: JointPlan, record: Record) -> int:
    """Return the step of a member's way that leads it to its target, the last one if none does."""
    way = plan.ways[record.robot]
    return next((step for step in range(record.left, len(way)) if way[step] == record.goal), len(way) - 1)


def _times(plan: JointPlan, members: Mapping[str, Record]) -> dict[str, list[float]]:
    """Return when each member enters each cell of its way, in cells from now, if all drive as soon as they may.

    A turn that never comes takes infinitely long; a robot that does not follow the plan any more is not waited for.
    """
    times = {robot: [0.0] * (min(record.entered, len(plan.ways[robot]) - 1) + 1) for robot, record in members.items()}
    entries = {robot: {entry.step: entry for entry in plan.after.get(robot, ())} for robot in members}
    moves = True
    while moves:
        moves = False
        for robot, entered in times.items():
            while len(entered) < len(plan.ways[robot]):
                entry, begins = entries[robot].get(len(entered)), entered[-1]
                if entry is not None and entry.robot in times:
                    if len(times[entry.robot]) <= entry.place + 1:
                        break
                    begins = max(begins, times[entry.robot][entry.place + 1])
                entered.append(begins + 1.0)
                moves = True
    return {robot: entered + [inf] * (len(plan.ways[robot]) - len(entered)) for robot, entered in times.items()}


def _way(record: Record, plan: JointPlan | None) -> tuple[int, ...]:
    known = plan.ways.get(record.robot) if plan is not None else None
    return known[record.left :] if known is not None else (*record.held, *record.ahead)


def _turns(plan: JointPlan, members: Mapping[str, Record]) -> dict[int, tuple[str, ...]]:
    """Return the order at each cell that several robots still have to enter, without orders that another cell shows."""
    orders: list[tuple[int, tuple[str, ...]]] = []
    for cell, visits in _visits(plan).items():
        to_come = (robot for robot, step in visits if robot in members and step > members[robot].entered)
        order = tuple(robot for robot, _ in groupby(to_come))
        if len(order) > 1:
            orders.append((cell, order))
    told: dict[int, tuple[str, ...]] = {}
    for cell, order in sorted(orders, key=lambda item: -len(item[1])):  # of equal orders, the first on a path
        if not any(_is_part_of_order(order, other) for other in told.values()):
            told[cell] = order
    return told


def _visits(plan: JointPlan) -> dict[int, list[Visit]]:
    """Return the visits of each cell in order; a visit waits for the one before it, which may be of the same robot."""
    after: dict[Visit, Visit] = {}  # a visit -> the next one of the same cell
    first: dict[Visit, int] = {}  # the first visits -> their cells
    for robot, way in plan.ways.items():
        entries = {entry.step: (entry.robot, entry.place) for entry in plan.after.get(robot, ())}
        own: dict[int, Visit] = {}
        for step, cell in enumerate(way):
            before = entries.get(step) or own.get(cell)
            if before is None:
                first[robot, step] = cell
            else:
                after[before] = (robot, step)
            own[cell] = (robot, step)
    visits: dict[int, list[Visit]] = {}
    for visit, cell in sorted(first.items(), key=lambda item: item[0][1]):
        here: Visit | None = visit
        while here is not None:
            visits.setdefault(cell, []).append(here)
            here = after.pop(here, None)
    return visits


def _is_part_of_order(order: Iterable[str], other: tuple[str, ...]) -> bool:
    """Return True if ``other`` without some of its robots is ``order``."""
    rest = iter(other)
    return all(robot in rest for robot in order)
