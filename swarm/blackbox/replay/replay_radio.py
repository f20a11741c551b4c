"""What a robot of a replay hears by, in place of the radio of its process."""

from collections.abc import Iterable

from swarm.messages import Broadcast
from swarm.robot.host.radio import Pair, Zone


class Ear:
    """What a robot of a replay hears by: the caller says what it has heard."""

    def __init__(self) -> None:
        self.heard: list[Broadcast] = []

    def tune(self, x: float, y: float) -> Zone:
        """Return any zone: nothing is sent from here."""
        return 0, 0

    def close(self) -> None:
        """Do nothing."""

    def begin(self, run: int) -> None:
        """Do nothing."""

    def misses_broadcast(self, hears: Iterable[Pair]) -> bool:
        """Return True if it went on without a broadcast that the sense lists."""
        known = {(one.robot, one.tick) for one in self.heard}
        return any(pair not in known for pair in hears)

    def listed_broadcasts(self, hears: Iterable[Pair], now: int) -> list[Broadcast]:
        """Return what it has heard."""
        return self.heard

    what_came = listed_broadcasts
