"""The delay of a robot's wheels: its commands compared with what the wheels did."""

from collections import deque
from typing import Final

from swarm.messages import COMMAND
from swarm.motion.drive import ramp

BELIEVED: Final = 20.0  # s for which commands count as late after one was late
DIFFERS: Final = 0.02  # m/s; a larger difference of rim speeds means a late command

RimSpeeds = tuple[float, float]  # left, right [m/s]


class Lateness:
    """One robot's newest commands, and whether they reach the wheels late."""

    def __init__(self, acceleration: float, dt: float) -> None:
        self._most = acceleration * dt
        self._commands: deque[RimSpeeds] = deque(maxlen=max(1, round(COMMAND.timeout / dt)))
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
        if tick - self._tick > len(self._commands) + 1:
            self._commands.clear()
        self._tick = tick
        before, self._before = self._before, now
        self._ticks = max(0, self._ticks - 1)
        if before is not None and self._commands:
            for was, wanted, seen in zip(before, self._commands[-1], now, strict=True):
                if abs(seen - ramp(was, wanted, self._most)) > DIFFERS:
                    self._ticks = self._believed
        return tuple(self._commands) if self._ticks else ()

    def command(self, speeds: RimSpeeds) -> None:
        """Record the rim speeds [m/s] commanded at this tick."""
        self._commands.append(speeds)
