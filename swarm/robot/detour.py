"""A way out for a robot that gets nowhere: the tables are told of an aim to the freer side, until there is a way ahead.

Obstacle avoidance and goal seeking can pull to opposite sides, and hold a robot in a corner for good. This changes what
the tables are asked, and turns no wheel: tables that do not turn to a heading get out of nothing.
"""

from math import hypot, inf, pi
from typing import Final

from swarm.messages import Sense
from swarm.robot.safety import Constraints, SafetyFilter

PATIENCE: Final = 3.0  # s in which it gets nowhere: the tables have had the time to turn out of it
PROGRESS: Final = 0.1  # m in that time are some
ASIDE: Final = pi / 2  # rad, the heading told until there is a way straight ahead,
ENOUGH: Final = 0.4  # m, and driven along it
NOWHERE: Final = (inf, inf)


class Detour:
    """Of one robot. It remembers where the robot last got on, and the detour that it is in the middle of."""

    def __init__(self, safety: SafetyFilter) -> None:
        self._filter = safety
        self._got_on = NOWHERE  # m, where it last got on,
        self._since = 0.0  # s, and when
        self._from: tuple[float, float] | None = None  # m, where the detour began
        self._heading = 0.0  # rad, told; 0 once there is a way ahead

    def end(self) -> None:
        """Forget everything: the robot is not to drive on now."""
        self._got_on, self._from = NOWHERE, None

    def heading(self, sense: Sense, constraints: Constraints) -> float | None:
        """Return the heading error [rad] to tell the tables, None where there is no detour under way.

        One begins where the robot has got nowhere for long and has no way ahead. Who shall not drive on gets nowhere
        rightly.
        """
        if not constraints.may_drive or constraints.stop_within <= 0.0:
            self.end()
            return None
        here = (sense.x, sense.y)
        if self._from is None:
            self._watch(sense, constraints)
        if self._from is None:
            return None
        if self._heading and self._filter.way_ahead(sense, constraints):
            self._heading, self._since = 0.0, sense.time
        if sense.time - self._since > PATIENCE or _apart(here, self._from) > ENOUGH:
            self.end()
            return None
        return self._heading

    def _watch(self, sense: Sense, constraints: Constraints) -> None:
        here = (sense.x, sense.y)
        if _apart(here, self._got_on) > PROGRESS:
            self._got_on, self._since = here, sense.time
        elif sense.time - self._since > PATIENCE and not self._filter.way_ahead(sense, constraints):
            self._from, self._since = here, sense.time
            self._heading = ASIDE * self._filter.freer_side(sense, constraints)


def _apart(a: tuple[float, float], b: tuple[float, float]) -> float:
    return hypot(a[0] - b[0], a[1] - b[1])
