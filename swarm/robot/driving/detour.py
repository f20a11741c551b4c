"""A detour for a robot that gets nowhere: the tables get an aim on the freer side until the way ahead is clear.

Obstacle avoidance and goal seeking can pull to opposite sides and hold a robot in a corner for ever. A detour changes
only the inputs of the tables. It commands no wheel, so it does not help tables that do not turn to a heading.
"""

from swarm.geometry import distance
from swarm.messages import Sense
from swarm.robot.driving.safety import Constraints, SafetyFilter
from swarm.robot.tuning import DETOUR
from swarm.traffic.progress_checker import PlaceChecker


class Detour:
    """The detours of one robot: where it last made progress, and the detour under way."""

    def __init__(self, safety: SafetyFilter) -> None:
        self._filter = safety
        self._progress = PlaceChecker(DETOUR.progress)
        self._since = 0.0  # s, time of the detour's last phase
        self._from: tuple[float, float] | None = None  # m, where the detour began
        self._heading = 0.0  # rad, given to the tables; 0 once the way ahead is clear

    def end(self) -> None:
        """Forget progress and detour, because the robot must not drive on now."""
        self._progress.forget()
        self._from = None

    def heading(self, sense: Sense, constraints: Constraints) -> float | None:
        """Return the heading error [rad] for the tables; None: no detour is under way.

        A detour begins when the robot makes no progress for ``DETOUR.patience`` and has no way ahead. A robot before a
        body also begins one, because the body may stay. A robot that has no cells to drive on has to wait and begins
        none.
        """
        if constraints.stop_within <= 0.0:
            self.end()
            return None
        here = (sense.x, sense.y)
        if self._from is None:
            self._watch(sense, constraints)
        if self._from is None:
            return None
        if self._heading and self._filter.way_ahead(sense, constraints):
            self._heading, self._since = 0.0, sense.time
        if sense.time - self._since > DETOUR.patience or distance(here, self._from) > DETOUR.done:
            self.end()
            return None
        return self._heading

    def _watch(self, sense: Sense, constraints: Constraints) -> None:
        here = (sense.x, sense.y)
        still = self._progress.check(here, sense.time)
        if still > DETOUR.patience and not self._filter.way_ahead(sense, constraints):
            self._from, self._since = here, sense.time
            self._heading = DETOUR.aside * self._filter.freer_side(sense, constraints)
