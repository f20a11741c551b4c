"""How long a robot has made no progress: its way has not become shorter, or it is still at one place."""

from swarm.geometry import distance
from swarm.maps.occupancy import Point


class ProgressChecker:
    """Counts ticks since a way last became shorter. A way that is ``longer`` [cells] than the shortest is a new way."""

    def __init__(self, longer: float) -> None:
        self._longer = longer
        self._fewest: int | None = None  # cells left of the way, the fewest so far
        self._ticks = 0

    def check(self, left: int, *, counts: bool, new: bool = False) -> int:
        """Return the ticks that counted since the way last became shorter, or since a ``new`` one; call it once a tick.

        ``left`` is the number of cells left. A tick ``counts`` if the robot could have got on in it.
        """
        if new or self._fewest is None or not self._fewest <= left <= self._fewest + self._longer:
            self._fewest, self._ticks = left, 0
        else:
            self._ticks += counts
        return self._ticks


class PlaceChecker:
    """Measures the time since a robot last moved farther than ``radius`` [m] from where it was, at first ``at`` [m]."""

    def __init__(self, radius: float, at: Point | None = None) -> None:
        self._radius = radius
        self._at = at
        self._since = 0.0  # s

    def check(self, here: Point, time: float) -> float:
        """Return that time [s]; call it once a tick."""
        if self._at is None or distance(here, self._at) > self._radius:
            self.restart(here, time)
        return time - self._since

    def restart(self, here: Point, time: float) -> None:
        """Count from now on, because the robot has a reason to be still here."""
        self._at, self._since = here, time

    def forget(self) -> None:
        """Count from the next check on."""
        self._at = None
