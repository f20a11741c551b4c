"""The moments of a run that its tape has: the tape is run again up to the one that is asked for."""

from collections.abc import Iterator
from pathlib import Path
from typing import Final, NamedTuple

from msgspec.structs import replace

from dashboard.fold.overlays import KEPT
from swarm.blackbox.explain.tape_moment import Taped
from swarm.blackbox.replay.keyframes import make_keyframe_folder
from swarm.blackbox.replay.wire import Wire
from swarm.errors import ConfigError
from swarm.messages import Clock, Message, Point, Truth
from swarm.tape.reader import TapeFile
from world.views.truth import make_truth

TRAIL: Final = 16.0  # s of a robot's way that are shown
LATE: Final = 5  # ticks before the end of a tape that is written: robots may still answer them
APART: Final = 0.03  # m, at least, between two points of it


class PastMoment(NamedTuple):
    """The end of a tick of a run, and what its listeners were told then."""

    taped: Taped
    truth: Truth  # with what robots sensed in that tick

    def messages(self) -> Iterator[Message]:
        """Yield the messages that a page knows which looks at the run then: of each kind the last, of broadcasts more.

        The broadcasts are those of the last while: so long a page keeps what robots tell of the floor.
        """
        past, seen = self.taped.past, self.truth
        since = past.tick - KEPT * past.rate
        for message in Wire(self.taped.replay).messages_kept():
            match message:
                case Clock():
                    yield replace(message, tick=seen.tick, time=seen.time)
                    said = (words for row in past.said.values() for words in row if words.tick >= since)
                    yield from sorted(said, key=lambda words: words.tick)
                case Truth():
                    yield seen
                case _:
                    yield message

    def trails(self) -> dict[str, list[Point]]:
        """Return where each robot has been of late [m], the oldest point first."""
        past = self.taped.past
        return {name: _thin_out(past.trail(name, round(TRAIL * past.rate))) for name in self.taped.world.robots}


def _thin_out(trail: list[Point]) -> list[Point]:
    kept = trail[:1]
    for x, y in trail[1:]:
        if abs(x - kept[-1][0]) + abs(y - kept[-1][1]) > APART:
            kept.append((x, y))
    return [(round(x, 3), round(y, 3)) for x, y in kept]


class Moments:
    """A tape, and one moment of it that goes forward; for an earlier one the tape is opened again, at a keyframe.

    The tape of a run that goes on grows: it is opened again too for a tick that it did not have when it was read.
    """

    def __init__(self, file: Path) -> None:
        self._file = file
        self._taped: Taped | None = None
        self._truth: Truth | None = None

    def moment_at(self, at: float | None, run: int | None) -> PastMoment:
        """Return the moment at a time of a run [s]; None: shortly before the tape ends, and its last run.

        Raises:
            ConfigError: the file cannot be read, or is no tape, or the run has no such time.
        """
        taped, self._taped = self._taped, None  # a moment that fails is of no more use
        if taped is None or not _is_ahead(taped, at, run):
            taped = Taped(TapeFile(self._file), make_keyframe_folder())
        self._go(taped, at, run)
        self._taped = taped
        assert self._truth is not None
        return PastMoment(taped, self._truth)

    def _go(self, taped: Taped, at: float | None, run: int | None) -> None:
        """Run a moment on; note what listeners are told in its last tick."""
        timeline = taped.timeline
        lived = timeline.last(run, None if at is None else round(at / taped.world.dt))
        if at is None:
            run, newest = timeline.ticks[lived - 1]
            lived = timeline.last(run, max(0, newest - LATE))
        if taped.replay.done == lived:
            return
        if lived > 1 and timeline.last(*timeline.ticks[lived - 2]) == lived - 1:
            taped.run_through(*timeline.ticks[lived - 2])

        def note() -> None:
            self._truth = make_truth(taped.world)

        taped.replay.when_sensed = note
        while taped.replay.done < lived and taped.step():
            pass


def _is_ahead(taped: Taped, at: float | None, run: int | None) -> bool:
    """Return True if a moment can go on to a time of a run, by what was read of its tape."""
    if at is None or run is None:
        return False
    try:
        return taped.replay.done <= taped.timeline.last(run, round(at / taped.world.dt))
    except ConfigError:
        return False
