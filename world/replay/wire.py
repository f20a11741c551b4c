"""What the processes of a run have sent to all listeners, from its tape: for a picture of it afterwards."""

from collections.abc import Iterator
from typing import Final

from swarm.messages import CLOCK, Clock, Event, Liveness, Map, Message, Phase, Seen, State, Status
from swarm.scenario.prepare import planning_grid
from world.fleet.publisher import EVENTS_KEPT, floor
from world.replay.replay import Replay
from world.replay.values import ReplayedTick
from world.views.metrics import shortest_lengths
from world.views.report import missing
from world.views.status import states, status
from world.views.truth import truth

AWAY: Final = 1.0  # s without an answer, after which a robot is shown as gone


class Wire:
    """The messages of a run that is replayed: each says the newest of its topic. It must be told of every tick.

    A tape has no links and no clocks on the wall: a robot counts as gone while it does not answer.
    """

    def __init__(self, replay: Replay) -> None:
        self._replay = replay
        self._rate = replay.world.settings.rate
        replay.when_sensed = self._note
        self._note()
        self._begin()

    def _begin(self) -> None:
        self._run = self._replay.world.run
        self._map: Map | None = None
        self._listed = 0  # robots that the map has starts of
        self._answered: dict[str, int] = {}  # the tick in which each robot has answered last
        self._seen = dict.fromkeys(self._replay.world.robots, Seen(Liveness.GONE, 0.0))
        self._states: dict[str, State] = {}
        self.events: tuple[Event, ...] = ()  # the last ones

    def _note(self) -> None:
        """Keep the true state as it is told, with what robots sense there."""
        self._truth = truth(self._replay.world)

    def take(self, tick: ReplayedTick) -> Iterator[Message]:
        """Yield what was sent in a tick that was replayed just now: first the map and the clock, if they are due."""
        world = self._replay.world
        if world.run != self._run:
            self._begin()
        self._answered |= dict.fromkeys((*tick.joined, *(name for name, *_ in tick.steps)), world.tick)
        changed = self._look()
        if self._map is None or (self._map.edits, self._listed) != (world.bodies.edits, len(world.robots)):
            self._map, self._listed = floor(self._replay.edited(), world), len(world.robots)
            yield self._map
        if changed or self._truth.tick % round(self._rate / CLOCK.rate) == 0:
            yield self.clock()
        yield self._truth
        for _, _, stepped in tick.steps:
            if stepped is not None and stepped.outputs is not None:
                outputs = stepped.outputs
                yield from (one for one in (outputs.broadcast, outputs.state, outputs.plan) if one is not None)
                if outputs.state is not None:
                    self._states[outputs.state.robot] = outputs.state
        self.events = (*self.events, *tick.events)[-EVENTS_KEPT:]
        yield from tick.events

    def end(self, phase: Phase) -> Iterator[Message]:
        """Yield what was sent after the last tick."""
        self._note()
        yield self._truth
        yield self.status(phase)
        yield self.clock(phase)

    def _look(self) -> bool:
        """Find out which robots are there; return True if that has changed."""
        world, before = self._replay.world, self._seen
        self._seen = dict(before)
        for name in world.robots:
            there = name in self._answered and world.tick - self._answered[name] <= AWAY * self._rate
            now = Liveness.ALIVE if there else Liveness.GONE
            if name not in before or before[name].liveness is not now:
                self._seen[name] = Seen(now, world.time)
        return self._seen != before

    def clock(self, phase: Phase = Phase.RUNNING) -> Clock:
        """Return the time of the run that the newest truth has, and who is there."""
        world = self._replay.world
        present = [name for name, seen in self._seen.items() if seen.liveness is Liveness.ALIVE]
        return Clock(
            run=world.run, tick=self._truth.tick, time=self._truth.time, phase=phase, robots=list(world.robots),
            present=present, presence=self._seen, pool=world.tasks.pool.counts,
        )  # fmt: skip

    def states(self) -> list[State]:
        """Return the state of every robot."""
        return list(states(self._replay.world, self._states).values())

    def status(self, phase: Phase) -> Status:
        """Return the status of the run as it is now; shortest lengths are computed if it is over."""
        world = self._replay.world
        over = phase is Phase.OVER
        shortest = shortest_lengths(world, planning_grid(self._replay.edited())) if over else [None] * len(world.robots)
        reason = missing(world) if over and not world.tasks.complete else ""
        return status(world, phase, reason, self._seen, self._states, self.events, shortest)
