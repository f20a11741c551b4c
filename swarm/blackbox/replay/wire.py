"""What the processes of a run have sent to all listeners, from its tape: for a picture of it afterwards."""

from collections.abc import Iterator
from typing import Final

from msgspec.structs import replace

from swarm.blackbox.replay.answer_values import ReplayedTick
from swarm.blackbox.replay.replay import Replay
from swarm.messages import CLOCK, Clock, Events, Liveness, Message, Phase, Seen, Status
from world.fleet.publisher import floor
from world.views.metrics import shortest_lengths
from world.views.report import missing
from world.views.status import states, status
from world.views.truth import make_truth

AWAY: Final = 1.0  # s without an answer, after which a robot is shown as gone


class Wire:
    """The messages of a run that is replayed, from the tick on in which that is.

    A tape has no links and no clocks on the wall: a robot counts as gone while it does not answer.
    """

    def __init__(self, replay: Replay) -> None:
        self._replay = replay
        self._every = round(replay.world.settings.rate / CLOCK.rate)  # ticks between two clocks
        self._floor = (-1, 0, 0)  # run, edits and robots of the map that was told
        self._there: list[str] = []  # robots that are present by the clock that was told
        self._note()
        replay.when_sensed = self._note

    def _note(self) -> None:
        """Keep the true state as it is told, with what robots sense there."""
        self._truth = make_truth(self._replay.world)

    def messages_kept(self, phase: Phase = Phase.RUNNING) -> Iterator[Message]:
        """Yield what a world keeps for those who come late, as it is now."""
        replay, world = self._replay, self._replay.world
        yield floor(replay.scenario_on_floor(), world)
        yield self.clock(phase)
        yield from states(world, replay.last.states).values()
        yield from replay.last.plans.values()
        yield Events(events=list(replay.events))
        yield make_truth(world)

    def take(self, tick: ReplayedTick) -> Iterator[Message]:
        """Yield what was sent in a tick that was replayed just now: first the map and the clock, if they are due."""
        replay, world = self._replay, self._replay.world
        known = (world.run, world.bodies.edits, len(world.robots))
        if known != self._floor:
            self._floor = known
            yield floor(replay.scenario_on_floor(), world)
        clock, at = self.clock(), self._truth
        if clock.present != self._there or at.tick % self._every == 0:
            self._there = clock.present
            yield replace(clock, tick=at.tick, time=at.time)  # no later than what robots say of themselves in this tick
        yield at
        for _, _, stepped in tick.steps:
            if stepped is not None and stepped.outputs is not None:
                outputs = stepped.outputs
                yield from (one for one in (outputs.broadcast, outputs.state, outputs.plan) if one is not None)
        yield from tick.events

    def end(self, phase: Phase) -> Iterator[Message]:
        """Yield what was sent after the last tick."""
        yield make_truth(self._replay.world)
        yield self.status(phase)
        yield self.clock(phase)

    def _message_seen(self) -> dict[str, Seen]:
        replay, world = self._replay, self._replay.world
        found: dict[str, Seen] = {}
        for name in world.robots:
            came = replay.answered.get(name)
            away = came is None or world.tick - came > AWAY * world.settings.rate
            found[name] = Seen(Liveness.GONE, (came or 0) * world.dt) if away else Seen(Liveness.ALIVE, 0.0)
        return found

    def clock(self, phase: Phase = Phase.RUNNING) -> Clock:
        """Return the time of the run, and who is there."""
        world, seen = self._replay.world, self._message_seen()
        present = [name for name, one in seen.items() if one.liveness is Liveness.ALIVE]
        return Clock(
            run=world.run, tick=world.tick, time=world.time, phase=phase, robots=list(world.robots), present=present,
            presence=seen, pool=world.tasks.pool.counts,
        )  # fmt: skip

    def status(self, phase: Phase) -> Status:
        """Return the status of the run as it is now; shortest lengths are computed if it is over."""
        replay, world = self._replay, self._replay.world
        over = phase is Phase.OVER
        shortest = shortest_lengths(world) if over else [None] * len(world.robots)
        reason = missing(world) if over and not world.tasks.complete else ""
        return status(world, phase, reason, self._message_seen(), replay.last.states, replay.events, shortest)
