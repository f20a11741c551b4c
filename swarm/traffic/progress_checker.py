"""How long a robot's way has not become shorter."""


class ProgressChecker:
    """Counts ticks since a way last became shorter. A way that is ``longer`` [cells] than the shortest is a new way."""

    def __init__(self, longer: int) -> None:
        self._longer = longer
        self._fewest: int | None = None  # cells left of the way, the fewest so far
        self._ticks = 0

    def look(self, left: int, *, counts: bool, new: bool = False) -> int:
        """Return the ticks that counted since the way last became shorter, or since a ``new`` one; call it once a tick.

        ``left`` is the number of cells left. A tick ``counts`` if the robot could have got on in it.
        """
        if new or self._fewest is None or not self._fewest <= left <= self._fewest + self._longer:
            self._fewest, self._ticks = left, 0
        else:
            self._ticks += counts
        return self._ticks
