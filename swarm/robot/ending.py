"""How a robot's process tells a run that is over from a world that has gone, which may come back."""

from typing import Final

from swarm.messages import Clock, Phase, Welcome

AWAY: Final = 30.0  # s; a world that its launcher starts again is back within 10 s, on a busy machine too


class Ending:
    """What becomes of the run that the robots of a process are in: it is over, or its world has gone."""

    def __init__(self, *, once: bool = False) -> None:
        self._then = "" if once else "; waiting for the next"
        self.over = False
        self._gone: float | None = None  # s; since when

    def joined(self, welcome: Welcome) -> str:
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
