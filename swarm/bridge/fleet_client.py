"""A bridge's side of the fleet: an ordinary client of the wire that has the newest of all and never lags behind."""

from collections.abc import Callable, Iterable
from time import monotonic
from typing import Any, Final

from swarm.bridge.errand import OrderEnd, OrderErrand
from swarm.bridge.errands import Errands
from swarm.bridge.fleet_view import FLEET, FleetView
from swarm.bus import Arrival, Bus, Link, Presence
from swarm.messages import CLOCK, EVENT, EVENTS, MAP, PLAN, RADIO, SENSE, STATE, STATUS, TRUTH, Message, Status, Topic
from swarm.robot.host.membership import AWAY

LISTEN: Final[tuple[Topic[Any], ...]] = (CLOCK, MAP, TRUTH, SENSE, PLAN, STATE, EVENT)
ORDERED: Final[tuple[Topic[Any], ...]] = (STATUS,)  # the ends of orders are seen from this too
KEPT: Final[tuple[Topic[Any], ...]] = (CLOCK, MAP, TRUTH, PLAN, STATE)  # the world answers with the last ones
LOOK: Final = 0.05  # s, the longest time between two looks at the other side: a period of the usual senses
MOST: Final = 1000  # arrivals that are taken in before what they say goes out: a run may be faster than this process
ANSWER: Final = 1.0  # s to wait for what the world keeps
REPLY: Final = 2.0  # s to wait for the world's answer to a request; meanwhile a bridge says nothing


class FleetClient:
    """What one process knows of a fleet that it follows: ``fold`` has the newest messages.

    Whoever gives orders listens to ``ORDERED`` too, and adds an ``Errand`` for each to ``errands``.
    """

    def __init__(self, bus: Bus, log: Callable[[str], None], listen: Iterable[Topic[Any]] = LISTEN) -> None:
        self._bus, self._log = bus, log
        self._topics = tuple(listen)
        self._run: int | None = None  # whose last messages have been asked for
        self._worlds: set[str] = set()  # their sessions
        self._last = ""  # the session of the world that came last
        self._seen = monotonic()  # s, when there was a world
        self.fold = FleetView()
        self.errands = Errands()
        for topic in self._topics:
            bus.listen(topic)
        bus.watch_presence("world")

    @property
    def has_lost_world(self) -> bool:
        """True if the fleet has had no world for so long that none will come back."""
        return not self._worlds and monotonic() - self._seen > AWAY

    def receive_messages(self, patience: float = LOOK) -> list[tuple[OrderErrand, OrderEnd]]:
        """Take in what has come; wait at most ``patience`` [s] if nothing has. Return the errands that have ended."""
        if self.fold.settings is None or self._run != self.fold.run:  # the map of another run may be another
            self._fetch_last_messages()
            self._run = self.fold.run
        if self.fold.settings is not None and not self.fold.settings.shared.map.known:
            self._bus.listen(RADIO)  # robots tell each other what they learn of the floor
        messages: list[Message] = []
        arrived, room = self._bus.receive(patience), MOST
        while arrived is not None:
            match arrived:
                case Arrival(message=Status() as message):
                    messages.append(message)
                case Arrival(ids=ids, message=message):
                    messages.append(message)
                    self.fold.apply_message(message, ids.get("robot", FLEET))
                case Presence(session=session, alive=alive):
                    if alive and self._last not in {"", session}:
                        self.fold.accept_next_run()
                        self._run = None  # its map may be another
                    self._last = session if alive else self._last
                    (self._worlds.add if alive else self._worlds.discard)(session)
                    self.errands.mark_all_unsure()
                case Link(up=up):
                    self.errands.mark_all_unsure()
                    if not up:
                        self._log("the fleet's router is away; waiting for it")
            room -= 1
            arrived = self._bus.receive(0.0) if room else None
        self._seen = monotonic() if self._worlds else self._seen
        ended = self.errands.apply_messages(messages)
        if self.errands.has_to_ask and self._worlds and (answers := fetch_order_evidence(self._bus)):
            ended += self.errands.apply_answers(answers)
        return [*ended, *self.errands.end_all_without_world(AWAY)] if self.has_lost_world else ended

    def _fetch_last_messages(self) -> None:
        for topic in KEPT:
            if topic in self._topics:
                for message in self._bus.fetch(topic, timeout=ANSWER):
                    self.fold.apply_message(message)
        if STATUS in self._topics:
            told = self._bus.fetch(STATUS, timeout=ANSWER)
            self.errands.apply_messages(told)  # whose world this is


def fetch_order_evidence(bus: Bus) -> list[Message]:
    """Ask the world for all that the end of an order can be seen from; return nothing if it does not answer all."""
    status, events = bus.fetch(STATUS, timeout=ANSWER), bus.fetch(EVENTS, timeout=ANSWER)
    if not status or not events:
        return []
    return [*status, *(event for one in events for event in one.events), *bus.fetch(CLOCK, timeout=ANSWER)]
