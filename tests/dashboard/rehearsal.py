"""A made-up run that sends the messages of a real fleet, to see the dashboard without a fleet.

Robots follow a drawn way past three targets and home, one after the other, and give way now and then. To the
first and the third stop they go by a joint plan. It is a function of the tick; nothing here simulates anything.
"""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from math import atan2, hypot
from typing import Any, Final

from swarm.fuzzy import load_profile
from swarm.geometry import wrap
from swarm.maps.text import from_text
from swarm.messages import (
    CLOCK,
    EVENT,
    PLAN,
    RADIO,
    STATE,
    TRUTH,
    Account,
    Activity,
    Body,
    Broadcast,
    Clock,
    Event,
    Liveness,
    Message,
    Phase,
    Plan,
    Point,
    RobotStatus,
    State,
    Status,
    Steering,
    Topic,
    Truth,
)
from swarm.messages.traffic import Entry, Epoch, JointPlan, Record, Relayed, TrafficBroadcast
from swarm.scenario.load import Scenario, check_values
from swarm.scenario.prepare import settle_lattice
from swarm.traffic.lattice.placement import cells_of

RATE: Final = 20  # Hz
GROUP: Final = 8  # robots of one joint plan
SPEED: Final = 0.8  # m/s
DRAWN: Final = """\
############################
#.........#................#
#.........#................#
#.........#................#
#.........#.......#........#
#.........#.......#........#
#.........#.......#........#
#...oo....#...oo..#........#
#...oo....#...oo..#...oo...#
#.........#.......#...oo...#
#.........#.......#........#
#.........#.......#........#
#.........#.......#........#
#.................#........#
#.................#........#
#.................#........#
#.................#........#
#.................#........#
#.................#........#
############################
"""
TARGETS: Final[tuple[Point, ...]] = ((2.0, 8.5), (7.2, 8.0), (12.0, 2.0))
WAY: Final[tuple[tuple[Point, ...], ...]] = (  # to each stop in turn; home is added
    ((1.4, 6.0), TARGETS[0]),
    ((3.6, 6.5), (3.8, 3.6), (5.2, 2.0), (6.3, 4.0), (6.2, 7.0), TARGETS[1]),
    ((8.6, 8.7), (9.8, 8.6), (10.2, 5.8), (10.2, 3.4), TARGETS[2]),
    ((12.6, 5.0), (11.0, 7.8), (9.2, 8.9), (8.1, 7.0), (6.8, 2.6), (5.2, 1.6), (3.6, 2.2)),
)


def scenario() -> Scenario:
    """Return the scenario that belongs to it."""
    told = {
        "name": "rehearsal",
        "map": {"text": DRAWN, "cell": 0.5},
        "start": {"area": [0.7, 0.7, 4.0, 3.0]},
        "targets": [list(target) for target in TARGETS],
    }
    settings = check_values(told, "rehearsal")
    return settle_lattice(Scenario(settings, from_text(DRAWN, 0.5), load_profile("paper")))


@dataclass(frozen=True)
class At:
    """Where a robot is and what it is about at one tick."""

    x: float
    y: float
    yaw: float
    activity: Activity
    target: int
    distance: float
    reached: list[bool]
    moving: bool


class Rehearsal:
    """The messages of ``robots`` robots, tick by tick."""

    def __init__(self, robots: int, run: int = 0) -> None:
        self.scenario = scenario()
        self.names = tuple(f"r{number}" for number in range(1, robots + 1))
        self.run = run
        self._legs = [self._way(number) for number in range(robots)]
        self._cells = cells_of(self.scenario.map, self.scenario.settings)
        self._groups = [self.names[first : first + GROUP] for first in range(0, robots, GROUP)]
        self._plans = {
            (number, stop): self._joint(stop, group[place], group)
            for number, group in enumerate(self._groups)
            for stop, place in ((0, 0), (2, -1))
        }
        self.ticks = max(self._over(number) for number in range(robots)) + RATE

    def _way(self, number: int) -> list[list[Point]]:
        home = (0.9 + 0.8 * (number % 4), 0.9 + 0.8 * (number // 4 % 3))
        aside = 0.12 * ((number % 4) - 1.5)
        legs: list[list[Point]] = []
        here = home
        for points in (*WAY[:3], (*WAY[3], home)):
            between = [(x + aside, y + aside) for x, y in points[:-1]]
            leg = [here, *between, points[-1]]
            legs.append(leg)
            here = leg[-1]
        return legs

    def _joint(self, stop: int, leader: str, group: tuple[str, ...]) -> JointPlan:
        """Plan the way of a group to a stop: into each cell one after the other, in the order of their numbers."""
        ways, after, last = {}, {}, dict[int, tuple[str, int]]()
        for name in group:
            leg = self._legs[self.names.index(name)][stop]
            spots = (along(leg, 0.1 * step) for step in range(int(length(leg) / 0.1) + 1))
            ways[name] = tuple(cell for cell, _ in itertools.groupby(self._cells.cell_of(*spot) for spot in spots))
            before = {step: last[cell] for step, cell in enumerate(ways[name]) if step and cell in last}
            after[name] = tuple(Entry(step, *visit) for step, visit in before.items())
            last |= {cell: (name, step) for step, cell in enumerate(ways[name])}
        return JointPlan(epoch=Epoch(stop, leader), ways=ways, after=after)

    def _record(self, number: int, tick: int, now: At) -> Record:
        held = self._held(number, now)
        plan = self._plans.get((number // GROUP, now.target))
        way = plan.ways[self.names[number]] if plan is not None else ()
        left = way.index(held[0]) if held[0] in way else 0
        return Record(
            robot=self.names[number], stamp=tick, x=now.x, y=now.y, goal=way[-1] if way else held[0], held=held,
            ahead=way[left + len(held) :][:6], epoch=plan.epoch if plan is not None else None, left=left,
            entered=left + len(held) - 1 if way else 0,
            plan=next((made for made in self._plans.values() if made.epoch.leader == self.names[number]), None),
        )  # fmt: skip

    def _held(self, number: int, now: At) -> tuple[int, ...]:
        """Return the cell a robot is in and the next one of its way."""
        spots = [(now.x, now.y), *self._ahead(number, now)[:4]]
        return tuple(dict.fromkeys(self._cells.cell_of(*spot) for spot in spots))

    def _starts(self, number: int) -> int:
        return 10 + number % GROUP * 4 * RATE

    def _over(self, number: int) -> int:
        return self._starts(number) + int(sum(map(length, self._legs[number])) / SPEED * RATE) + 3 * RATE + 2

    def at(self, number: int, tick: int) -> At:
        """Return where a robot is at a tick."""
        legs, start = self._legs[number], self._starts(number)
        pause = start + 15 * RATE  # stands three seconds for another
        waits = pause <= tick < pause + 3 * RATE
        driven = max(0, min(tick, pause) - start + max(0, tick - pause - 3 * RATE)) * SPEED / RATE
        target = 0
        while target < len(legs) and driven >= length(legs[target]) - 0.2:
            driven -= length(legs[target])
            target += 1
        reached = [stop < target for stop in range(len(legs))]
        if target == len(legs):
            x, y = legs[-1][-1]
            return At(x, y, 0.0, Activity.DONE, target, 0.0, reached, False)
        here = along(legs[target], max(0.0, driven))
        ahead = along(legs[target], max(0.0, driven) + 0.4)
        behind = along(legs[target], max(0.0, driven - 0.2))
        yaw = atan2(ahead[1] - behind[1], ahead[0] - behind[0])
        activity = Activity.GIVE_WAY if waits or tick < start else Activity.DRIVE
        left = max(0.0, length(legs[target]) - driven)
        return At(*here, yaw, activity, target, left, reached, activity is Activity.DRIVE)

    def messages(self, tick: int) -> Iterator[tuple[Topic[Any], Message, dict[str, Any]]]:
        """Return everything that is sent at a tick."""
        time = tick / RATE
        all_at = [self.at(number, tick) for number in range(len(self.names))]
        records = [self._record(number, tick, now) for number, now in enumerate(all_at)]
        if tick % RATE == 0 or tick == self.ticks:
            yield CLOCK, self.clock(tick), {}
        for number, (name, now) in enumerate(zip(self.names, all_at, strict=True)):
            before = self.at(number, tick - 1) if tick else None
            new_leg = before is None or before.target != now.target
            if (tick + number) % 4 == 0 or new_leg:
                others = tuple(Relayed(1, record) for record in records if record.robot != name)
                said = Broadcast(
                    robot=name, run=self.run, tick=tick, x=now.x, y=now.y, yaw=now.yaw, activity=now.activity,
                    target=now.target, distance=now.distance, reached=now.reached,
                    traffic=TrafficBroadcast(own=records[number], others=others),
                )  # fmt: skip
                yield RADIO, said, {"robot": name, "zx": 0, "zy": 0}
            if tick % RATE == 0 or before is None or before.activity != now.activity or new_leg:
                yield STATE, self.state(number, tick), {"robot": name}
            if new_leg:
                yield PLAN, self.plan(number, tick), {"robot": name}
                if before is not None:
                    text = f"stop {now.target} of {len(now.reached)} at {time:.1f} s, 90\u00b0 \u2588"
                    yield EVENT, Event(run=self.run, tick=tick, time=time, robot=name, kind="reached", text=text), {}
        if tick % 2 == 0:
            yield TRUTH, self.truth(tick, all_at), {}

    def clock(self, tick: int) -> Clock:
        """Return where the run stands."""
        phase = Phase.OVER if tick >= self.ticks else Phase.RUNNING
        names = list(self.names)
        return Clock(run=self.run, tick=tick, time=tick / RATE, phase=phase, robots=names, present=names)

    def state(self, number: int, tick: int) -> State:
        """Return where a mission stands."""
        now = self.at(number, tick)
        return State(
            robot=self.names[number], run=self.run, tick=tick, activity=now.activity, target=now.target,
            reached=now.reached, unreachable=[], distance=now.distance, replans=now.target,
        )  # fmt: skip

    def plan(self, number: int, tick: int) -> Plan:
        """Return which path a robot follows."""
        now = self.at(number, tick)
        points = self._legs[number][now.target] if now.target < len(self._legs[number]) else []
        return Plan(robot=self.names[number], run=self.run, tick=tick, points=points)

    def truth(self, tick: int, all_at: list[At] | None = None) -> Truth:
        """Return where all robots are."""
        all_at = all_at or [self.at(number, tick) for number in range(len(self.names))]
        bodies = []
        for number, (name, now) in enumerate(zip(self.names, all_at, strict=True)):
            later = self.at(number, tick + 1)
            turn = wrap(later.yaw - now.yaw) * 0.2 * RATE if now.moving else 0.0
            speed = SPEED if now.moving else 0.0
            body = Body(
                robot=name, x=now.x, y=now.y, yaw=wrap(now.yaw), left_v=max(-2.0, min(2.0, speed - turn)),
                right_v=max(-2.0, min(2.0, speed + turn)), left=1.6, front=min(1.6, now.distance), right=1.6, heading=0.0,
                steering=Steering.TABLES if now.moving else Steering.BRAKED, activity=now.activity,
                held=list(self._held(number, now)),
                waits=[self.names[number - 1]] if number and now.activity is Activity.GIVE_WAY else [],
                members=list(self._groups[number // GROUP]) if now.target in {0, 2} else [],
            )  # fmt: skip
            bodies.append(body)
        return Truth(run=self.run, tick=tick, time=tick / RATE, bodies=bodies)

    def status(self, tick: int) -> Status:
        """Return what a world tells of it at a tick; what nobody has measured is 0."""
        phase = self.clock(tick).phase
        return Status(
            scenario=self.scenario.settings.name, run=self.run, tick=tick, time=tick / RATE, phase=phase,
            complete=phase is Phase.OVER, reason="", edits=0, events=[], world="rehearsal",
            robots=[self._row(number, tick) for number in range(len(self.names))],
            contacts={"robot": 0, "wall": 0, "obstacle": 0},
        )  # fmt: skip

    def _row(self, number: int, tick: int) -> RobotStatus:
        now, told = self.at(number, tick), self.state(number, tick)
        account = Account(
            targets=len(now.reached), reached=[tick / RATE if there else None for there in now.reached], laps=0,
            path_length=tick / RATE * SPEED, shortest_length=None, waiting=0.0, waits_for={}, replans=told.replans,
            contacts=0, struck=0, stalled=0, unreachable=[],
        )  # fmt: skip
        return RobotStatus(
            robot=told.robot, liveness=Liveness.ALIVE, since=0.0, pose=(now.x, now.y, wrap(now.yaw)), state=told,
            waits=[], event=None, account=account,
        )  # fmt: skip

    def _ahead(self, number: int, now: At) -> list[Point]:
        if now.target >= len(self._legs[number]):
            return []
        leg = self._legs[number][now.target]
        driven = length(leg) - now.distance
        return [along(leg, driven + 0.25 * step) for step in range(12)]


def length(points: list[Point]) -> float:
    """Measure a polyline [m]."""
    return sum(hypot(b[0] - a[0], b[1] - a[1]) for a, b in itertools.pairwise(points))


def along(points: list[Point], driven: float) -> Point:
    """Find the point so far along a polyline; before its begin and past its end, those."""
    for a, b in itertools.pairwise(points):
        side = hypot(b[0] - a[0], b[1] - a[1])
        if driven <= side:
            share = max(0.0, driven) / side if side else 0.0
            return a[0] + (b[0] - a[0]) * share, a[1] + (b[1] - a[1]) * share
        driven -= side
    return points[-1]
