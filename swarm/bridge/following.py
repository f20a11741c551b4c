"""A bridge's side of the fleet: an ordinary client of the wire that has the newest of all and never lags behind."""

from collections.abc import Callable, Iterable
from typing import Any, Final

from swarm.bridge.folding import FLEET, Fold
from swarm.bus import Arrival, Bus, Link
from swarm.messages import CLOCK, EVENT, MAP, PLAN, RADIO, SENSE, STATE, TRUTH, Topic

LISTEN: Final[tuple[Topic[Any], ...]] = (CLOCK, MAP, TRUTH, SENSE, PLAN, STATE, EVENT)
KEPT: Final[tuple[Topic[Any], ...]] = (CLOCK, MAP, TRUTH, PLAN, STATE)  # the world answers with the last ones
LOOK: Final = 0.05  # s, the longest time between two looks at the other side: a period of the usual senses
MOST: Final = 1000  # arrivals that are taken in before what they say goes out: a run may be faster than this process


class Follower:
    """What one process knows of a fleet that it follows: ``fold`` has the newest messages."""

    def __init__(self, bus: Bus, log: Callable[[str], None], listen: Iterable[Topic[Any]] = LISTEN) -> None:
        self._bus, self._log = bus, log
        self._topics = tuple(listen)
        self._run: int | None = None  # whose last messages have been asked for
        self.fold = Fold()
        for topic in self._topics:
            bus.listen(topic)

    def take_in(self, patience: float = LOOK) -> None:
        """Take in what has come; wait at most ``patience`` [s] if nothing has."""
        if self.fold.settings is None or self._run != self.fold.run:  # the map of another run may be another
            self._catch_up()
            self._run = self.fold.run
        if self.fold.settings is not None and not self.fold.settings.map.known:
            self._bus.listen(RADIO)  # robots tell each other what they learn of the floor
        arrived, room = self._bus.receive(patience), MOST
        while arrived is not None:
            match arrived:
                case Arrival(ids=ids, message=message):
                    self.fold.take(message, ids.get("robot", FLEET))
                case Link(up=False):
                    self._log("the fleet's router is away; waiting for it")
            room -= 1
            arrived = self._bus.receive(0.0) if room else None

    def _catch_up(self) -> None:
        for topic in KEPT:
            if topic in self._topics:
                for message in self._bus.fetch(topic, timeout=1.0):
                    self.fold.take(message)
