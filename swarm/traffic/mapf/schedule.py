"""When each robot of a joint plan enters each cell, if it goes as soon as the order of entries lets it.

A robot begins to drive into a cell when the robot there before it has arrived in its next cell. It occupies a cell from
then on until it has arrived in its own next cell. Between these times the cell is free: `reroute` finds a quickest way
through the free times of all cells (safe interval path planning: Phillips and Likhachev, ICRA 2011).

Compiled: improving a plan tries hundreds of changes.
"""

from collections.abc import Sequence
from heapq import heappop, heappush
from math import inf, isinf, sqrt
from typing import Final, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

CORNER: Final = sqrt(0.5)  # steps for a cell in which the way turns: from the middle of one edge to that of the next
ON_THE_SPOT: Final = 1.8  # the same in a lane, where a robot stands, turns and drives on
BACK: Final = 2.5  # steps where the way leads back: a turn on the spot takes 1.5 (measured with the fuzzy drive)
NOBODY: Final = -1
NONE: Final = -1  # no neighbour, or no cell to visit
BEGINS, ARRIVES = 0, 1  # to drive into a cell of its way; in it
POPS: Final = 3_000  # expansions of the search for one way
CHANCE: Final = 0.01  # steps, a random cost that decides between equal ways
ROUNDING: Final = 1e-9  # steps
WIDER: Final = 2  # times as many cells as its longest way has, for the ways of a changed plan

Integers = NDArray[np.int64]
Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]


class Schedule(NamedTuple):
    """A joint plan with times. The arrays are wider than the longest way; what is beyond a way has no meaning."""

    ways: Integers  # (robots, width): cells, the present one first, none twice in a row
    lengths: Integers  # (robots): the number of cells of each way
    times: Floats  # (2, robots, width): when each robot BEGINS to drive into a cell and ARRIVES in it [steps]
    last: float  # arrival [steps]
    total: float  # of all arrivals [steps]
    corner: float  # steps for a cell in which a way turns
    paces: Floats  # (robots): times as long as the quickest that each takes for its way

    def steps(self) -> list[tuple[int, ...]]:
        """Return the cells of all robots at each time step: each moves as soon as the order of entries lets it."""
        begins = [
            (when, robot, place)
            for robot, length in enumerate(self.lengths.tolist())
            for place, when in enumerate(self.times[BEGINS, robot, 1:length].tolist(), 1)
        ]
        ways = self.ways.tolist()
        moved = [0] * len(ways)  # time step of the last move of each robot
        left: dict[int, int] = {}  # time step in which somebody left each cell
        moves: list[dict[int, int]] = [{}]  # [time step] -> robots that move, and where to
        for _, robot, place in sorted(begins):
            cell = ways[robot][place]
            time = moved[robot] = max(moved[robot] + 1, left.get(cell, 0))
            left[ways[robot][place - 1]] = time
            moves.extend({} for _ in range(time + 1 - len(moves)))
            moves[time][robot] = cell
        plan = [tuple(way[0] for way in ways)]
        for moving in moves[1:]:
            plan.append(tuple(moving.get(robot, cell) for robot, cell in enumerate(plan[-1])))
        return plan


def move_time(before: int, cell: int, other: int, corner: float = CORNER) -> float:
    """Return the time from ``cell`` to ``other`` [steps]; ``before`` is the previous cell, or ``cell`` at the start.

    Straight on, a cell takes one step, and where the way turns ``corner`` steps. In large cells a robot that turns cuts
    the corner: it drives a way of corners alone as one slanting line.
    """
    if before == cell or other - cell == cell - before:
        return 1.0
    return BACK if other == before else corner


_pace = njit("f8(i8, i8, i8, f8)", cache=True)(move_time)


@njit("f8(i8[::1], i8, f8, f8)", cache=True)
def _move_time_at(way: Integers, place: int, corner: float, pace: float) -> float:
    """Return the time from the cell before a place of a way to the cell there [steps], at a robot's ``pace``."""
    before = way[place - 2] if place > 1 else way[place - 1]
    return pace * _pace(before, way[place - 1], way[place], corner)


@njit("void(i8[::1], f8[:, :, ::1], i8, i8, f8, f8, f8)", cache=True)
def _set_entry(way: Integers, times: Floats, robot: int, place: int, begins: float, corner: float, pace: float) -> None:
    """Note when a robot begins to drive into a place of its way, and so when it arrives there."""
    times[BEGINS, robot, place] = begins
    times[ARRIVES, robot, place] = begins + _move_time_at(way, place, corner, pace)


@njit("UniTuple(f8, 2)(i8[::1], f8[:, :, ::1])", cache=True)
def _makespan_and_flowtime(lengths: Integers, times: Floats) -> tuple[float, float]:
    """Return the last arrival, and the sum of all."""
    last = total = 0.0
    for robot in range(len(lengths)):
        last = max(last, times[ARRIVES, robot, lengths[robot] - 1])
        total += times[ARRIVES, robot, lengths[robot] - 1]
    return last, total


@njit("UniTuple(f8, 2)(i8[:, ::1], i8[:, ::1], i8[::1], f8[:, :, ::1], f8, f8[::1])", cache=True)
def _fill_schedule(
    steps: Integers, ways: Integers, lengths: Integers, times: Floats, corner: float, paces: Floats
) -> tuple[float, float]:
    """Fill in a schedule; return the last arrival and the sum of all, or no numbers where entries wait in a circle."""
    robots = steps.shape[1]
    visitor = np.full(steps.max() + 1, NOBODY)  # of each cell: the robot that was there last
    visit = np.zeros(visitor.size, np.int64)  # and which place of its way the cell was
    first = np.empty(robots, np.int64)  # of each mover: who has to leave the cell first, and which place that is
    left = np.empty(robots, np.int64)
    movers = np.empty(robots, np.int64)
    for robot in range(robots):
        visitor[steps[0, robot]] = robot
        ways[robot, 0], lengths[robot] = steps[0, robot], 1
    for time in range(1, steps.shape[0]):
        waiting = 0
        for robot in range(robots):
            cell = steps[time, robot]
            if cell != steps[time - 1, robot]:
                first[robot], left[robot] = visitor[cell], visit[cell]
                visitor[cell], visit[cell] = robot, lengths[robot]
                movers[waiting] = robot
                waiting += 1
        while waiting:
            still = 0
            for number in range(waiting):
                robot = movers[number]
                place = lengths[robot]
                other, begins = first[robot], times[ARRIVES, robot, place - 1]
                if other not in (NOBODY, robot):
                    if lengths[other] <= left[robot] + 1:
                        movers[still] = robot
                        still += 1
                        continue
                    begins = max(begins, times[ARRIVES, other, left[robot] + 1])
                ways[robot, place], lengths[robot] = steps[time, robot], place + 1
                _set_entry(ways[robot], times, robot, place, begins, corner, paces[robot])
            if still == waiting:
                return inf, inf
            waiting = still
    return _makespan_and_flowtime(lengths, times)


@njit("UniTuple(f8, 2)(i8[:, ::1], i8[::1], f8[:, :, ::1], i8, f8, f8[::1])", cache=True)
def _advance_entries(
    ways: Integers, lengths: Integers, times: Floats, cells: int, corner: float, paces: Floats
) -> tuple[float, float]:
    """Let all robots go as soon as the same order lets them; return the last arrival and the sum of all."""
    robots = ways.shape[0]
    count = lengths.sum() - robots
    when, who, places = np.empty(count), np.empty(count, np.int64), np.empty(count, np.int64)
    visitor, visit = np.full(cells, NOBODY), np.zeros(cells, np.int64)
    number = 0
    for robot in range(robots):
        visitor[ways[robot, 0]] = robot
        for place in range(1, lengths[robot]):
            when[number], who[number], places[number] = times[BEGINS, robot, place], robot, place
            number += 1
    for entry in np.argsort(when):
        robot, place = who[entry], places[entry]
        cell = ways[robot, place]
        other, begins = visitor[cell], times[ARRIVES, robot, place - 1]
        if other not in (NOBODY, robot):
            begins = max(begins, times[ARRIVES, other, visit[cell] + 1])
        _set_entry(ways[robot], times, robot, place, begins, corner, paces[robot])
        visitor[cell], visit[cell] = robot, place
    return _makespan_and_flowtime(lengths, times)


@njit("Tuple((i8[::1], f8[::1], f8[::1]))(i8[:, ::1], i8[::1], f8[:, :, ::1], b1[::1], i8)", cache=True)
def _occupied_intervals(
    ways: Integers, lengths: Integers, times: Floats, out: Flags, cells: int
) -> tuple[Integers, Floats, Floats]:
    """Return when robots that are not ``out`` occupy each cell: the first index of each cell, the begins, the ends."""
    first = np.zeros(cells + 1, np.int64)
    for robot in range(ways.shape[0]):
        if not out[robot]:
            for place in range(lengths[robot]):
                first[ways[robot, place] + 1] += 1
    for cell in range(cells):
        first[cell + 1] += first[cell]
    begins, ends, filled = np.empty(first[cells]), np.empty(first[cells]), first[:-1].copy()
    for robot in range(ways.shape[0]):
        if not out[robot]:
            for place in range(lengths[robot]):
                cell, begin = ways[robot, place], times[BEGINS, robot, place]
                index = filled[cell]
                filled[cell] += 1
                while index > first[cell] and begins[index - 1] > begin:
                    begins[index], ends[index] = begins[index - 1], ends[index - 1]
                    index -= 1
                begins[index] = begin
                ends[index] = times[ARRIVES, robot, place + 1] if place + 1 < lengths[robot] else inf
    return first, begins, ends


@njit("i8(i8, i8[:, ::1], i8[::1], f8[:, :, ::1], b1[::1], i4[:, ::1], i8[:, ::1], i8, i8, f8, f8)", cache=True)
def _reroute_robot(
    robot: int, ways: Integers, lengths: Integers, times: Floats, out: Flags,
    joined: NDArray[np.int32], tables: Integers, visits: int, chance: int, corner: float, pace: float,
) -> int:  # fmt: skip
    """Find a quickest way past the others for a robot that is ``out``, and write it into the schedule.

    Return the expansions, negative if there is no way.

    ``tables`` are its steps to its goal, and to that through the cell that it ``visits``. ``chance`` is a seed.
    """
    cells, sides = joined.shape
    first, begins, ends = _occupied_intervals(ways, lengths, times, out, cells)
    start, goal = ways[robot, 0], ways[robot, lengths[robot] - 1]
    if first[start] < first[start + 1] and begins[first[start]] <= 0.0:
        return -1
    # a state is a free time of a cell (one more than it is occupied), the side of entry, and whether it has visited
    cell_of = np.empty(cells + first[cells], np.int64)  # of each free time
    for cell in range(cells):
        cell_of[first[cell] + cell : first[cell + 1] + cell + 1] = cell
    reached = np.full(cell_of.size * (sides + 1) * 2, inf)
    came = np.full(reached.size, NONE)
    state = ((first[start] + start) * (sides + 1) + sides) * 2 + int(visits in (NONE, start))
    reached[state] = 0.0
    ready = [(0.0, 0.0, state)]
    pops, found = 0, NONE
    while ready and pops < POPS:
        _, now, state = heappop(ready)
        if now > reached[state]:
            continue
        pops += 1
        been, side, free = state % 2, state // 2 % (sides + 1), state // 2 // (sides + 1)
        cell = cell_of[free]
        index = free - cell  # of the time after it in which the cell is occupied
        until = begins[index] if index < first[cell + 1] else inf
        if cell == goal and been and until == inf:
            found = state
            break
        before = joined[cell, side] if side < sides else cell
        for other in joined[cell]:
            if other == NONE:
                break
            takes = pace * _pace(before, cell, other, corner)
            there = 1 if been or other == visits else 0
            left = tables[1 - there, other]
            if left >= cells * 2:
                continue  # no way leads on
            side = sides
            for number in range(sides):
                if joined[other, number] == cell:
                    side = number
            for index in range(first[other], first[other + 1] + 1):
                begin = max(now, ends[index - 1]) if index > first[other] else now
                if begin + takes > until + ROUNDING:
                    break
                if index < first[other + 1] and begin + takes >= begins[index]:
                    continue
                following = ((index + other) * (sides + 1) + side) * 2 + there
                if begin + takes < reached[following]:
                    reached[following], came[following] = begin + takes, state
                    chance = (chance * 1_103_515_245 + 12_345) % 2_147_483_648
                    cost = begin + takes + pace * left + CHANCE * (chance / 2_147_483_648)
                    heappush(ready, (cost, begin + takes, following))
    length, state = 0, found
    while state != NONE:
        length += 1
        state = came[state]
    if length == 0 or length > ways.shape[1]:
        return -pops
    lengths[robot], state = length, found
    for place in range(length - 1, -1, -1):
        ways[robot, place], times[ARRIVES, robot, place] = cell_of[state // 2 // (sides + 1)], reached[state]
        state = came[state]
    for place in range(1, length):
        times[BEGINS, robot, place] = times[ARRIVES, robot, place] - _move_time_at(ways[robot], place, corner, pace)
    return pops


@njit(
    "Tuple((f8, f8, i8))(i8[::1], i8[:, ::1], i8[::1], f8[:, :, ::1], i4[:, :, ::1], i8[::1], i8[:, :, ::1], i8[::1], "
    "i8, f8, f8[::1])",
    cache=True,
)
def reroute(
    robots: Integers, ways: Integers, lengths: Integers, times: Floats,
    joined: NDArray[np.int32], floor_of: Integers, tables: Integers, visits: Integers, chance: int, corner: float,
    paces: Floats,
) -> tuple[float, float, int]:  # fmt: skip
    """Find new ways for some robots of a schedule, in turn, past the others and those before them.

    Return the last arrival and the sum of all arrivals [steps], and the expansions. They are no numbers if a robot
    finds no way; the arrays then hold no schedule.

    Args:
        robots: those that get new ways.
        ways: of the schedule, which is changed.
        lengths: of the schedule.
        times: of the schedule.
        joined: (floors, cells, sides) joined cells, filled up with NONE.
        floor_of: (robots) the floor of each, an index of ``joined``.
        tables: (robots, 2, cells) steps to the goal, and to the goal through the cell to visit.
        visits: (robots) the cell that each has to visit on its way, or NONE.
        chance: a seed.
        corner: of the schedule [steps].
        paces: of the schedule.
    """
    out = np.zeros(ways.shape[0], np.bool_)
    out[robots] = True
    pops = 0
    for robot in robots:
        spent = _reroute_robot(
            robot, ways, lengths, times, out, joined[floor_of[robot]], tables[robot], visits[robot], chance + robot,
            corner, paces[robot],
        )  # fmt: skip
        pops += abs(spent)
        if spent <= 0:
            return inf, inf, pops
        out[robot] = False
    last, total = _advance_entries(ways, lengths, times, joined.shape[1], corner, paces)
    return last, total, pops


def schedule_plan(steps: Sequence[Sequence[int]], corner: float = CORNER, paces: Sequence[float] = ()) -> Schedule:
    """Return the schedule of a plan; ``steps`` holds the cell of each robot at each time step, at least one.

    ``corner`` are the steps for a cell in which the way turns. ``paces`` say how many times as long as the quickest
    each robot takes for a cell; (): all are equally quick.

    Raises:
        ValueError: Entries wait for each other in a circle. Only a plan with a ring of movers or a swap has one.
    """
    robots = len(steps[0])
    cells = np.array(steps, np.int64).reshape(len(steps), robots)
    longest = 1 + max((int(moves) for moves in (cells[1:] != cells[:-1]).sum(axis=0)), default=0)
    ways, lengths = np.zeros((robots, WIDER * longest), np.int64), np.zeros(robots, np.int64)
    times = np.zeros((2, robots, WIDER * longest))
    own = np.array(paces or (1.0,) * robots)
    last, total = _fill_schedule(cells, ways, lengths, times, corner, own) if robots else (0.0, 0.0)
    if isinf(last):
        raise ValueError("entries wait for each other in a circle: the plan has a ring of movers or a swap")
    return Schedule(ways, lengths, times, last, total, corner, own)


def makespan_and_flowtime(steps: Sequence[Sequence[int]], corner: float = CORNER) -> tuple[float, float]:
    """Return when the last robot arrives, and the sum of all arrivals, estimated [steps].

    ``steps`` holds the cell of each robot at each time step, ``corner`` the steps for a cell in which a way turns. A
    robot enters a cell when the one there before has left.

    Raises:
        ValueError: as `schedule_plan`.
    """
    if not steps:
        return 0.0, 0.0
    schedule = schedule_plan(steps, corner)
    return schedule.last, schedule.total
