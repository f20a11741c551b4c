"""The fold of what arrives into progress: ``fold`` takes one message and returns a new ``Progress``, and does no more.

Time comes from the messages only. Messages of robots count only in the run that the world announced last. A stop once
reached stays reached; of everything else the latest tick wins.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

import msgspec

from swarm.bus import Arrival, Presence
from swarm.messages import (
    RADIO,
    STATE,
    Activity,
    Broadcast,
    Clock,
    Event,
    Liveness,
    Phase,
    PoolCounts,
    State,
    Truth,
)

WAITING: Final = frozenset({Activity.GIVE_WAY, Activity.BLOCKED})
EVENTS_KEPT: Final = 100
RATE: Final = 20.0  # Hz, control steps per second, until the world's time and tick tell the real rate


class RobotProgress(msgspec.Struct, frozen=True, kw_only=True):
    """The mission of one robot, as far as it is known."""

    tick: int = -1  # of the newest message from the robot itself
    broadcast_tick: int = -1
    state_tick: int = -1
    activity: Activity = Activity.READY
    since: int = 0  # tick at which that activity was first heard
    waited: int = 0  # ticks it gave way or was blocked
    target: int = 0  # index of the stop it drives to; the number of stops when all are reached
    distance: float = 0.0  # m, to that stop along its path
    leg: float = 0.0  # m, the most that this distance has been
    reached_at: tuple[int | None, ...] = ()  # tick at which each stop was first heard to be reached
    unreachable: tuple[int, ...] = ()
    assignment: int = 0  # number of its stops; 0: the scenario's
    assigned_at: int = -1  # tick from which it has had them

    @property
    def stops(self) -> int:
        """Number of stops: the targets, and home if the mission returns; 0 until a message tells it."""
        return len(self.reached_at)

    @property
    def reached_count(self) -> int:
        """Number of stops reached."""
        return sum(tick is not None for tick in self.reached_at)

    @property
    def share(self) -> float:
        """Share of its way through its stops, 0 to 1; every stop counts the same, the way to the next by its length."""
        if self.target < self.stops and self.reached_at[self.target] is None and self.leg > 0.0:
            return (self.reached_count + 1.0 - self.distance / self.leg) / self.stops
        return self.reached_count / self.stops if self.stops else 0.0


class Progress(msgspec.Struct, frozen=True, kw_only=True):
    """The progress of a run as seen from outside."""

    run: int = -1  # -1: the world has not spoken yet
    tick: int = 0
    time: float = 0.0  # s, since the run began
    phase: Phase = Phase.WAITING
    clock_tick: int = -1
    order: tuple[str, ...] = ()  # the fleet, in the order of its colours
    present: frozenset[str] | None = None  # robots whose process is present, as the world says
    lost: frozenset[str] = frozenset()  # robots that have been absent for long, as the world says
    tokens: Mapping[str, frozenset[str]] = MappingProxyType({})  # robot -> sessions that announced it
    robots: Mapping[str, RobotProgress] = MappingProxyType({})
    pool: PoolCounts | None = None  # how far the targets for any robot are; None: there were none
    events: tuple[Event, ...] = ()  # the last ones, in the order they came
    rate: float = RATE  # Hz

    @property
    def share(self) -> float:
        """Share of the reached stops of all robots, 0 to 1."""
        known = [robot.stops for robot in self.robots.values()]
        most = max(known, default=0)
        total = sum(known) + most * (len(self.order) - len(known))
        return sum(robot.reached_count for robot in self.robots.values()) / total if total else 0.0

    @property
    def way(self) -> float:
        """Share of the ways of all robots, 0 to 1, by distance; who has not spoken has not moved."""
        return sum(self.robot(name).share for name in self.order) / len(self.order) if self.order else 0.0

    def robot(self, name: str) -> RobotProgress:
        """Return what is known about a robot; a robot that was never heard has done nothing yet."""
        return self.robots.get(name) or RobotProgress()

    def seconds(self, tick: int) -> float:
        """Return the time [s] of a tick since the run began."""
        return tick / self.rate

    def waits(self, name: str) -> float:
        """Return how long [s] a robot has been giving way or blocked by now."""
        robot = self.robot(name)
        return self.seconds(max(0, self.tick - robot.since)) if robot.activity in WAITING else 0.0

    def radio_freshness(self, name: str) -> Liveness:
        """Return how fresh a robot's messages are; a broadcast and a state each have their own timeout."""
        announced = bool(self.tokens.get(name))
        if not (announced if self.tokens else self.present is None or name in self.present):
            return Liveness.LOST if name in self.lost else Liveness.GONE
        robot = self.robot(name)
        if self.phase is not Phase.RUNNING:
            return Liveness.ALIVE
        fresh = (
            self.seconds(self.tick - max(0, robot.broadcast_tick)) <= RADIO.timeout
            or self.seconds(self.tick - max(0, robot.state_tick)) <= STATE.timeout
        )
        return Liveness.ALIVE if fresh else Liveness.STALE


def fold(progress: Progress, arrived: object) -> Progress:
    """Return the progress after a message, or after what ``Bus.receive`` returned; the same object if nothing is new.

    A robot's presence has the session of its process, which tells two processes with one name apart.
    """
    match arrived:
        case Arrival(message=message):
            return fold(progress, message)
        case Presence(role="robot", id=robot, session=session, alive=alive):
            sessions = progress.tokens.get(robot, frozenset())
            sessions = sessions | {session} if alive else sessions - {session}
            return msgspec.structs.replace(progress, tokens=MappingProxyType({**progress.tokens, robot: sessions}))
        case Clock() | Truth() | Event():
            if arrived.run < progress.run:
                return progress
            if arrived.run > progress.run:
                progress = Progress(
                    run=arrived.run, order=progress.order, present=progress.present, tokens=progress.tokens
                )
            return _world(progress, arrived)
        case Broadcast() | State() if arrived.run == progress.run:
            old = progress.robot(arrived.robot)
            if (new := _mission(old, arrived)) is not old:
                robots = MappingProxyType({**progress.robots, arrived.robot: new})
                return msgspec.structs.replace(progress, robots=robots)
    return progress


def _world(progress: Progress, message: Clock | Truth | Event) -> Progress:
    if isinstance(message, Event):
        if message in progress.events:
            return progress  # the world was killed, goes on from its snapshot, and tells it again
        return msgspec.structs.replace(progress, events=(*progress.events, message)[-EVENTS_KEPT:])
    if message.tick >= progress.tick:
        rate = message.tick / message.time if message.tick and message.time else progress.rate
        progress = msgspec.structs.replace(progress, tick=message.tick, time=message.time, rate=rate)
    if isinstance(message, Truth) or message.tick < progress.clock_tick or progress.phase is Phase.OVER:
        return progress
    return msgspec.structs.replace(
        progress,
        clock_tick=message.tick,
        phase=message.phase,
        order=tuple(message.robots),
        present=frozenset(message.present),
        pool=message.pool,
        lost=frozenset(name for name, seen in message.presence.items() if seen.liveness is Liveness.LOST),
    )


def _mission(robot: RobotProgress, message: Broadcast | State) -> RobotProgress:
    """Return the robot after a message about its mission."""
    changed: dict[str, object] = {}
    if isinstance(message, State) and message.assignment > robot.assignment:
        robot = msgspec.structs.replace(
            robot, assignment=message.assignment, assigned_at=message.tick, reached_at=(), unreachable=(), leg=0.0
        )
    elif message.tick < robot.assigned_at:
        return robot  # about stops that it no longer has
    reached_at = _merge_reached(robot.reached_at, message.reached, message.tick)
    if reached_at != robot.reached_at:
        changed["reached_at"] = reached_at
    if isinstance(message, State):
        if message.tick > robot.state_tick:
            changed |= {"state_tick": message.tick, "unreachable": tuple(message.unreachable)}
    elif message.tick > robot.broadcast_tick:
        changed["broadcast_tick"] = message.tick
    if message.tick > robot.tick:
        changed |= {"tick": message.tick, "target": message.target, "distance": message.distance}
        changed["leg"] = max(message.distance, robot.leg if message.target == robot.target else 0.0)
        if robot.tick >= 0 and robot.activity in WAITING:
            changed["waited"] = robot.waited + message.tick - robot.tick
        if message.activity is not robot.activity or robot.tick < 0:
            changed |= {"activity": message.activity, "since": message.tick}
    return msgspec.structs.replace(robot, **changed) if changed else robot


def _merge_reached(known: tuple[int | None, ...], said: list[bool], tick: int) -> tuple[int | None, ...]:
    """Return the reached stops after a message; the earliest tick of each stop stays, in any order of messages."""
    length = max(len(known), len(said))
    times: list[int | None] = [*known, *[None] * (length - len(known))]
    for stop, there in enumerate(said):
        first = times[stop]
        if there and (first is None or tick < first):
            times[stop] = tick
    return tuple(times)
