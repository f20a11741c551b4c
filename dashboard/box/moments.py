"""The moments of a run that its tape has: the tape is run again up to the one that is asked for."""

from collections.abc import Iterator
from pathlib import Path
from typing import Final, NamedTuple

from dashboard.fold.overlays import KEPT
from swarm.errors import ConfigError
from swarm.messages import Clock, Events, Liveness, Message, Phase, Point, Seen, Truth
from world.explain.taped import Taped
from world.fleet.publisher import floor
from world.replay.wire import AWAY
from world.tape.reader import TapeFile
from world.views.status import states
from world.views.truth import truth

TRAIL: Final = 16.0  # s of a robot's way that are shown
APART: Final = 0.03  # m, at least, between two points of it


class Moment(NamedTuple):
    """The end of a tick of a run, and what its listeners were told then."""

    taped: Taped
    truth: Truth  # with what robots sensed in that tick

    def messages(self) -> Iterator[Message]:
        """Yield the messages that a page knows which looks at the run then: of each kind the last, of broadcasts more.

        The broadcasts are those of the last while: so long a page keeps what robots tell of the floor.
        """
        replay, world, past = self.taped.replay, self.taped.world, self.taped.past
        yield floor(replay.edited(), world)
        yield self._clock()
        yield Events(events=list(replay.events))
        since = past.tick - KEPT * past.rate
        yield from sorted(
            (words for row in past.said.values() for words in row if words.tick >= since), key=lambda words: words.tick
        )
        yield from states(world, replay.last.states).values()
        yield from replay.last.plans.values()
        yield self.truth

    def trails(self) -> dict[str, list[Point]]:
        """Return where each robot has been of late [m], the oldest point first."""
        past = self.taped.past
        return {name: _thinned(past.trail(name, round(TRAIL * past.rate))) for name in self.taped.world.robots}

    def _clock(self) -> Clock:
        """Return the time, and who is there: a tape has no links, so a robot is gone while it does not answer."""
        world, past = self.taped.world, self.taped.past
        oldest = past.tick - AWAY * past.rate
        present = [name for name in world.robots if past.came.get(name, -1.0) >= oldest and name in past.came]
        seen = {
            name: Seen(Liveness.ALIVE if name in present else Liveness.GONE, past.came.get(name, 0) / past.rate)
            for name in world.robots
        }
        return Clock(
            run=world.run, tick=self.truth.tick, time=self.truth.time, phase=Phase.RUNNING, robots=list(world.robots),
            present=present, presence=seen, pool=world.tasks.pool.counts,
        )  # fmt: skip


def _thinned(trail: list[Point]) -> list[Point]:
    kept = trail[:1]
    for x, y in trail[1:]:
        if abs(x - kept[-1][0]) + abs(y - kept[-1][1]) > APART:
            kept.append((x, y))
    return [(round(x, 3), round(y, 3)) for x, y in kept]


class Moments:
    """A tape, and one moment of it that goes forward; for an earlier one the tape is opened again.

    The tape of a run that goes on grows: it is opened again too for a tick that it did not have when it was read.
    """

    def __init__(self, file: Path) -> None:
        self._file = file
        self._taped: Taped | None = None
        self._truth: Truth | None = None

    def at(self, at: float | None, run: int | None) -> Moment:
        """Return the moment at a time of a run [s]; None: where the tape ends, and its last run.

        Raises:
            ConfigError: the file cannot be read, or is no tape, or the run has no such time.
        """
        taped, self._taped = self._taped, None  # a moment that fails is of no more use
        if taped is None or not _is_ahead(taped, at, run):
            taped = Taped(TapeFile(self._file))
        self._go(taped, at, run)
        self._taped = taped
        assert self._truth is not None
        return Moment(taped, self._truth)

    def _go(self, taped: Taped, at: float | None, run: int | None) -> None:
        """Run a moment on; note what listeners are told in its last tick."""
        timeline = taped.timeline
        lived = timeline.last(run, None if at is None else round(at / taped.world.dt))
        if taped.replay.done == lived:
            return
        run, tick = timeline.ticks[lived - 1]
        if tick and timeline.last(run, tick - 1) < lived:
            taped.run_through(run, tick - 1)

        def note() -> None:
            self._truth = truth(taped.world)

        taped.replay.when_sensed = note
        taped.run_through(run, tick)


def _is_ahead(taped: Taped, at: float | None, run: int | None) -> bool:
    """Return True if a moment can go on to a time of a run, by what was read of its tape."""
    if at is None or run is None:
        return False
    try:
        return taped.replay.done <= taped.timeline.last(run, round(at / taped.world.dt))
    except ConfigError:
        return False
