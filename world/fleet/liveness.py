"""Which robots are alive, stale, gone or lost, since when, and what of that is worth an event."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from contextlib import suppress
from enum import Enum, auto
from pathlib import Path
from typing import Final

from swarm.messages import STATE, Liveness, Seen
from world.fleet.membership import Note
from world.tasks.standstill import LOST

AWAY: Final = 90.0  # s of absence after which the run ends without a robot if all others are finished
STEP: Final = 1.0  # s; a longer time between two looks is one in which the world itself stood


class Fact(Enum):
    """What the world observes of a robot at one look."""

    SPEAKS = auto()  # present, and heard lately
    SILENT = auto()  # present, and not heard while the clock ran for longer than its state is valid
    ABSENT = auto()  # not present
    MISSING = auto()  # not present for ``LOST`` of running time


ALIVE, STALE, GONE, MISSED = Liveness.ALIVE, Liveness.STALE, Liveness.GONE, Liveness.LOST
# fmt: off
# what is observed ->      what the robot is then, by what it was
NEXT: Final = {
    Fact.SPEAKS:  {ALIVE: ALIVE, STALE: ALIVE, GONE: ALIVE,  MISSED: ALIVE},
    Fact.SILENT:  {ALIVE: STALE, STALE: STALE, GONE: STALE,  MISSED: STALE},
    Fact.ABSENT:  {ALIVE: GONE,  STALE: GONE,  GONE: GONE,   MISSED: MISSED},
    Fact.MISSING: {ALIVE: MISSED, STALE: MISSED, GONE: MISSED, MISSED: MISSED},
}
# what it was and is -> event. That a robot has gone is the membership's to tell.
SILENCE: Final = ("stale", f"is present, but has said nothing for {STATE.timeout:g} s")
BACK: Final = ("back", "is back")
TOLD: Final = {
    (ALIVE, STALE):  SILENCE,
    (STALE, ALIVE):  ("back", "speaks again"),
    (ALIVE, MISSED): ("lost", f"has been away for {LOST:g} s and counts as lost"),
    (STALE, MISSED): ("lost", f"has been away for {LOST:g} s and counts as lost"),
    (GONE, MISSED):  ("lost", f"has been away for {LOST:g} s and counts as lost"),
    (GONE, ALIVE):   BACK,
    (MISSED, ALIVE): BACK,
    (GONE, STALE):   BACK,
    (MISSED, STALE): BACK,
}
# fmt: on


class Liveliness:
    """The liveliness. The caller passes ``now`` [s, of one clock] and ``time`` [s, of the run]."""

    def __init__(self, robots: Sequence[str], now: float) -> None:
        self.seen: Mapping[str, Seen] = dict.fromkeys(robots, Seen(GONE, 0.0))  # replaced as a whole, never changed
        self.left: set[str] = set()  # robots whose going was told, and whose return is not told yet
        self._silent = dict.fromkeys(robots, 0.0)  # s of the clock's running since each robot was heard
        self._looked_at = now

    def restore(self, seen: Mapping[str, Seen], left: Collection[str]) -> None:
        """Go on with the liveliness of a world that was killed."""
        self.seen, self.left = dict(seen), set(left)

    def add(self, robots: Iterable[str], time: float) -> None:
        """Have more robots on the liveliness, which are not here yet, from a time [s] of the run on."""
        self.seen = {**self.seen, **dict.fromkeys(robots, Seen(GONE, time))}
        self._silent = dict.fromkeys(self.seen, 0.0) | self._silent

    def begin(self) -> None:
        """Begin a new run: the present liveness counts from its time 0."""
        self.seen = {name: Seen(seen.liveness, 0.0) for name, seen in self.seen.items()}
        self._silent = dict.fromkeys(self._silent, 0.0)

    def note_message(self, robot: str) -> None:
        """Take in that a robot has sent a message."""
        self._silent[robot] = 0.0

    def look(
        self,
        now: float,
        time: float,
        away: Mapping[str, float],
        *,
        running: bool,
        gone: Iterable[str] = (),
        expected: Collection[str] = (),
    ) -> list[Note]:
        """Return notes about robots that have changed.

        ``away`` has for each absent robot how long [s] it has been so while the clock ran. ``gone`` are robots whose
        going was told just now, even if they are back already. ``expected`` are robots that are waited for after the
        router or the world was away: nothing is said about them until they are back or given up.
        """
        passed, self._looked_at = min(STEP, now - self._looked_at), now
        fresh, notes = dict(self.seen), list[Note]()
        for name in gone:
            self.left.add(name)
            fresh[name] = Seen(GONE, time)
        for name, (was, _) in fresh.items():
            if name in expected:
                continue
            if name in away:
                self._silent[name] = 0.0
            elif running:
                self._silent[name] += passed
            then = NEXT[self._fact(name, away)][was]
            if then is was:
                continue
            fresh[name] = Seen(then, time)
            told = TOLD.get((was, then))
            if told == BACK and name not in self.left:
                told = None  # it has come for the first time, or nobody was told that it had gone
            if then in (ALIVE, STALE):
                self.left.discard(name)
            if told is not None:
                notes.append(Note(*told, name))
        if fresh != self.seen:
            self.seen = fresh
        return notes

    def _fact(self, name: str, away: Mapping[str, float]) -> Fact:
        if name in away:
            return Fact.MISSING if away[name] >= LOST else Fact.ABSENT
        return Fact.SILENT if self._silent[name] > STATE.timeout else Fact.SPEAKS


def is_lost(away: Mapping[str, float], given_up: Path | None) -> bool:
    """Return True if robots have all been ``away`` [s] for too long; that is sooner for those that nobody starts again.

    The launcher writes their names to the file ``given_up``.
    """
    if any(time < LOST for time in away.values()):
        return False
    hopeless: list[str] = []
    if given_up is not None:
        with suppress(OSError, ValueError):
            hopeless = given_up.read_text(encoding="utf-8").split()
    return all(time >= AWAY or name in hopeless for name, time in away.items())
