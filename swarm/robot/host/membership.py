"""What a robot's process knows of its world: when to ask for a place, whether it is seen there, what an end means."""

from typing import Final

from swarm.messages import Clock, Phase, Welcome

FIRST, LONGEST = 0.1, 5.0  # s between two attempts to join; each pause is twice the one before
UNSEEN: Final = 3.0  # s for which the clock may leave out a robot that has joined, before that joins once more
AWAY: Final = 30.0  # s; a world that its launcher starts again is back within 10 s, on a busy machine too


class SeatRequest:
    """One robot of the process, and when it asks to join."""

    def __init__(self, asked: str | None) -> None:
        self.name = asked
        self.session: str | None = None  # of the world that welcomed it; None: it is to ask
        self._last: str | None = None  # the session that welcomed it last
        self._next = 0.0  # s
        self._pause = FIRST
        self._named: set[str] = set()
        self._seen = False  # the clock has had it, since that world welcomed it
        self._unseen: float | None = None  # s; since when the clock leaves it out
        self._patience = UNSEEN  # s; each time twice the one before, until the clock has it

    def due(self, now: float) -> bool:
        """Return True if it is time to ask."""
        return now >= self._next

    def take_refusal(self, reason: str, now: float) -> bool:
        """Wait, longer each time; return True if the reason is new."""
        self._next, self._pause = now + self._pause, min(LONGEST, 2 * self._pause)
        new = reason not in self._named
        self._named.add(reason)
        return new

    def ask_at_once(self) -> None:
        """Ask at once: a world has come."""
        self._next, self._pause = 0.0, FIRST

    def take_welcome(self, session: str) -> None:
        """Take in that the world of a session has given it the place."""
        self._seen = self._seen and session == self._last
        self.session = self._last = session
        self._unseen = None

    def hear(self, clock: Clock, now: float) -> None:
        """Take in at ``now`` [s] whether its world counts it as present."""
        if self.name in clock.present:
            self._seen, self._unseen, self._patience = True, None, UNSEEN
        elif self._seen and self._unseen is None:  # a world that many join at once sees some of them late
            self._unseen = now

    def is_left_out(self, now: float) -> bool:
        """Return True if its world has left it out for long: the token was lost on its way to the world."""
        return self._unseen is not None and now - self._unseen > self._patience

    def join_again(self) -> None:
        """Ask for the place once more, and be more patient with the clock the next time."""
        self._patience *= 2
        self.session = None


class Ending:
    """What becomes of the run that the robots of a process are in: it is over, or its world has gone."""

    def __init__(self, *, once: bool = False) -> None:
        self._then = "" if once else "; waiting for the next"
        self.over = False
        self._gone: float | None = None  # s; since when

    def format_join(self, welcome: Welcome) -> str:
        """Take in that a world has welcomed a robot; return a line on it."""
        self.over, self._gone = False, None
        where = "a run that has not begun" if welcome.state is None else f"run {welcome.state.run}"
        return f"joined as {welcome.robot}: {welcome.scenario.settings.name}, {where}"

    def hear(self, clock: Clock) -> str:
        """Take in a clock of the world; return a line if the run is over now, "" else."""
        before, self.over = self.over, clock.phase is Phase.OVER
        return f"the run is over after {clock.time:.1f} s{self._then}" if self.over and not before else ""

    def look(self, alive: bool, now: float) -> str:
        """Take in at ``now`` [s] that the world has gone or is back; return a line if that is worth one, "" else."""
        self._gone = None if alive else now
        return "" if alive or self.over else "the world has gone without an end of the run; waiting for it"

    def done(self, now: float) -> bool:
        """Return True if nothing is left to do for robots that were there for one run."""
        return self.over or (self._gone is not None and now - self._gone > AWAY)
