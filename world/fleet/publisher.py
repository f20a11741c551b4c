"""What the world sends to all listeners: the map, the clock, the truth, and events."""

from collections.abc import Callable, Iterable, Mapping
from time import monotonic
from typing import Final

from msgspec import UNSET
from msgspec.structs import replace

from swarm.bus import Bus
from swarm.messages import (
    CLOCK,
    EVENT,
    EVENTS,
    MAP,
    STATUS,
    TRUTH,
    Clock,
    Event,
    Events,
    Map,
    Phase,
    Seen,
    Status,
    Truth,
)
from swarm.scenario.load import Scenario
from world.world import World

EVENTS_KEPT: Final = 100  # the last ones, for processes that come late


def floor(scenario: Scenario, world: World) -> Map:
    """Return the map of a scenario with its settings and the start of each robot of a world."""
    settings, packed = scenario.to_wire()
    homes = dict(zip(world.robots, world.starts, strict=True))
    kinds = dict(zip(world.robots, world.roster.kinds, strict=True)) if world.settings.kinds else UNSET
    return Map(packed=packed, scenario=replace(settings, starts=homes, kinds=kinds), edits=world.bodies.edits)


class Publisher:
    """The sender of the world's messages; it keeps the fleet's current map and last events for those who come late.

    Both are replaced as a whole, never changed: other threads answer with them.
    """

    def __init__(self, bus: Bus, scenario: Scenario, world: World, log: Callable[[str], None]) -> None:
        self._bus, self._log = bus, log
        self.floor = floor(scenario, world)
        self.events: tuple[Event, ...] = ()
        self._clock_told = float("-inf")
        self._truth_every = max(1, round(scenario.settings.rate / TRUTH.rate))

    def answer(self) -> None:
        """Answer a `get` with the map, the last events, and the last one of them."""
        self._bus.keep(MAP, lambda: {MAP.key: self.floor})
        self._bus.keep(EVENTS, lambda: {EVENTS.key: Events(events=list(self.events))})
        self._bus.keep(EVENT, lambda: {EVENT.key: self.events[-1]} if self.events else {})

    def tell_map(self, scenario: Scenario, world: World) -> None:
        """Send the map, and keep it."""
        self.floor = floor(scenario, world)
        self._bus.send(MAP, self.floor)

    def clock(self, world: World, phase: Phase, present: list[str], seen: Mapping[str, Seen]) -> Clock:
        """Return the message with the time and phase of the run."""
        return Clock(
            run=world.run, tick=world.tick, time=world.time, phase=phase, robots=list(world.robots), present=present,
            presence=dict(seen), pool=world.tasks.pool.counts,
        )  # fmt: skip

    def tell_clock(self, clock: Clock) -> None:
        """Send the time and phase of the run."""
        self._clock_told = monotonic()
        self._bus.send(CLOCK, clock)

    @property
    def clock_is_due(self) -> bool:
        """True if it is time to send the clock again."""
        return monotonic() - self._clock_told >= 1.0 / CLOCK.rate

    def tell_truth(self, tick: int, truth: Callable[[], Truth]) -> None:
        """Send all true poses at the topic's rate, if anybody listens."""
        if tick % self._truth_every == 0 and self._bus.has_listener(TRUTH):
            self._bus.send(TRUTH, truth())

    def tell_status(self, truth: Truth, status: Status) -> None:
        """Send all true poses and the status, as at a change of the phase."""
        self._bus.send(TRUTH, truth)
        self._bus.send(STATUS, status)

    def tell(self, event: Event) -> None:
        """Keep, send and log an event."""
        self.keep([event])
        self.say([event])

    def keep(self, events: Iterable[Event]) -> None:
        """Keep events for those who come late."""
        self.events = (*self.events, *events)[-EVENTS_KEPT:]

    def say(self, events: Iterable[Event]) -> None:
        """Send and log events that were kept; a world that is killed must have saved them, or it tells them twice."""
        for event in events:
            self._bus.send(EVENT, event)
            self._log(f"{event.time:8.2f} s  {event.robot + ' ' if event.robot else ''}{event.text}")
