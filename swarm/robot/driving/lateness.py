"""Commands that reach the wheels late: how late they are, and the speeds with which the body stays in its cells."""

from collections import deque
from collections.abc import Collection
from typing import Final

import numpy as np
from numpy.typing import NDArray

from swarm.messages import COMMAND
from swarm.motion.drive import GRAZE, ramp
from swarm.planning.grid import Grid
from swarm.robot.driving.safety import STAND, DriveState, RimSpeeds, SafetyFilter, WheelSpeeds
from swarm.robot.tuning import PILOT
from swarm.settings import Settings
from swarm.traffic.lattice.cell_map import CellMap

BELIEVED: Final = 20.0  # s for which commands count as late after one was late
SPARE: Final = 0.02  # m from the body to the edge of its cells: wheels that obey and brake in turn roll further
DIFFERS: Final = 0.02  # m/s; a larger difference of rim speeds means a late command


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

    def expected_commands(self) -> tuple[RimSpeeds, ...]:
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


class LateLimiter:
    """Limits the speeds of a robot whose commands are late, so that its body stays in its cells however late."""

    def __init__(self, safety: SafetyFilter, settings: Settings) -> None:
        self._filter = safety
        self._radius = settings.robot.radius
        self._lasting = round(COMMAND.timeout * settings.rate) + 1  # ticks for which the wheels obey a command at most

    def limit(
        self,
        speeds: WheelSpeeds,
        body: DriveState,
        late: tuple[RimSpeeds, ...],
        grid: Grid,
        cells: CellMap,
        held: Collection[int],
    ) -> WheelSpeeds:
        """Return the speeds [m/s], or the largest share of them that keeps the body in the held cells; else stand.

        How late the next command will be can only be expected. The wheels may obey it at once or after all the
        ``late`` ones, and until it expires; then the body stops. A body that is beyond its cells already, or nearer to
        a wall than it should be, may go no further.
        """
        if not late or not any(speeds):
            return speeds
        held = set(held)
        inside = cells.room_in(held, body.pose.x, body.pose.y, self._radius + SPARE) - GRAZE
        for share in PILOT.shares:
            wanted = WheelSpeeds(share * speeds.left, share * speeds.right)
            lasting = (wanted,) * self._lasting
            ways = [self._filter.braking(body, under_way) for under_way in (lasting, (*late, *lasting))]
            points = np.concatenate(ways)
            if cells.swept_cells(points, inside) <= held and self._is_clear(points, body, grid):
                return wanted
        return STAND

    def _is_clear(self, points: NDArray[np.float64], body: DriveState, grid: Grid) -> bool:
        """Return True if the body touches no wall at the points (n, 2) [m]; a body nearer than that may stay so."""
        return grid.least_room(points) >= min(self._radius, grid.room_at(body.pose.x, body.pose.y))
