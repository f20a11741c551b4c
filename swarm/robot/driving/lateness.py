"""The delay of a robot's wheels: its commands compared with what the wheels did."""

from collections import deque
from typing import Final

from swarm.messages import COMMAND
from swarm.motion.drive import ramp

BELIEVED: Final = 20.0  # s for which commands count as late after one was late
DIFFERS: Final = 0.02  # m/s; a larger difference of rim speeds means a late command

RimSpeeds = tuple[float, float]  # left, right [m/s]


class Lateness:
    """One robot's newest commands, and how late they reach the wheels."""

    def __init__(self, acceleration: float, dt: float) -> None:
        self._most = acceleration * dt
        self._longest = max(1, round(COMMAND.timeout / dt))
        self._commands: deque[RimSpeeds] = deque(maxlen=self._longest + 1)
        self._delay = 0  # ticks by which the wheels obeyed late when that was last seen
        self._before: RimSpeeds | None = None
        self._tick = -1
        self._believed = round(BELIEVED / dt)
        self._ticks = 0

    def compare(self, tick: int, now: RimSpeeds) -> tuple[RimSpeeds, ...]:
        """Compare the last command with what the wheels did; call it once a tick.

        Return the newest commands that the wheels may not have carried out yet, oldest first.

        ``now`` are the rim speeds [m/s] measured at this tick. The result is empty if the wheels obey at once, or
        after a pause in which all commands expired.
        """
        if tick - self._tick > min(len(self._commands), self._longest) + 1:
            self._commands.clear()
        self._tick = tick
        before, self._before = self._before, now
        self._ticks = max(0, self._ticks - 1)
        if before is not None and self._commands:
            if not self._are_obeyed(self._commands[-1], before, now):
                self._ticks = self._believed
            if self._ticks:
                newest = enumerate(reversed(self._commands))
                delays = [delay for delay, wanted in newest if self._are_obeyed(wanted, before, now)]
                self._delay = delays[0] if delays and self._delay not in delays else self._delay
        return tuple(self._commands)[-self._longest :] if self._ticks else ()

    def expected(self) -> tuple[RimSpeeds, ...]:
        """Return the commands that the wheels carry out before the next one if they stay as late as they were."""
        return tuple(self._commands)[len(self._commands) - self._delay :] if self._ticks else ()

    def _are_obeyed(self, wanted: RimSpeeds, before: RimSpeeds, now: RimSpeeds) -> bool:
        """Return True if the wheels got from the speeds ``before`` to those of ``now`` by a command."""
        return all(
            abs(seen - ramp(was, speed, self._most)) <= DIFFERS
            for was, speed, seen in zip(before, wanted, now, strict=True)
        )

    def command(self, speeds: RimSpeeds) -> None:
        """Record the rim speeds [m/s] commanded at this tick."""
        self._commands.append(speeds)
