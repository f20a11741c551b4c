"""Whether a robot's wheels obey at once: what it commanded, held against what the wheels did."""

from collections import deque
from typing import Final

from swarm.motion.drive import ramp

LATEST: Final = 0.2  # s; an answer later than that is as good as none (decision 0010)
BELIEVED: Final = 20.0  # s for which commands are taken to come late once one did
DIFFERS: Final = 0.02  # m/s, of a rim speed

RimSpeeds = tuple[float, float]  # left, right [m/s]


class Lateness:
    """One robot's memory of its newest commands."""

    def __init__(self, acceleration: float, dt: float) -> None:
        self._most = acceleration * dt
        self._commands: deque[RimSpeeds] = deque(maxlen=max(1, round(LATEST / dt)))
        self._before: RimSpeeds | None = None
        self._tick = -1
        self._believed = round(BELIEVED / dt)
        self._ticks = 0

    def under_way(self, tick: int, now: RimSpeeds) -> tuple[RimSpeeds, ...]:
        """Return the newest commands that the wheels may not have carried out yet, oldest first.

        ``now`` are the rim speeds measured in this tick. () where the wheels obey at once, and after a pause in which
        all commands have run out.
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
        """Take down what the wheels are told in this tick."""
        self._commands.append(speeds)
