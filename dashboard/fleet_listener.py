"""What a dashboard hears of a fleet: its topics, what the world keeps for who comes late, and some of its radio."""

from collections.abc import Iterator
from typing import Any, Final

from swarm.bus import Bus
from swarm.messages import CLOCK, EVENT, EVENTS, MAP, PLAN, RADIO, STATE, TRUTH, Message, Topic

LISTEN: Final[tuple[Topic[Any], ...]] = (CLOCK, STATE, PLAN, EVENT, MAP, TRUTH)
KEPT: Final[tuple[Topic[Any], ...]] = (CLOCK, STATE, PLAN, MAP, EVENTS, TRUTH)


class FleetListener:
    """The ear of a dashboard; ``more`` are topics that the world keeps too."""

    def __init__(self, bus: Bus, *more: Topic[Any]) -> None:
        self._bus, self._more = bus, more
        self._heard: frozenset[str] = frozenset()
        for topic in (*LISTEN, *more):
            bus.listen(topic)

    def get_last_messages(self) -> Iterator[Message]:
        """Yield the last messages that the world keeps."""
        for topic in (*KEPT, *self._more):
            yield from self._bus.fetch(topic, timeout=1.0)

    def turn_to(self, robots: frozenset[str]) -> None:
        """Listen to the broadcasts of these robots only: relayed records are most of a fleet's bytes."""
        for name in self._heard - robots:
            self._bus.unlisten(RADIO, robot=name)
        for name in robots - self._heard:
            self._bus.listen(RADIO, robot=name)
        self._heard = robots
