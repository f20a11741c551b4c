"""What the world sends to all listeners: the map, the clock, the truth, and events."""

from collections.abc import Callable
from dataclasses import replace
from time import monotonic

from msgspec.structs import replace as replace_fields

from swarm.bus import Bus
from swarm.maps.occupancy import OccupancyMap
from swarm.messages import CLOCK, EVENT, MAP, TRUTH, Clock, Event, Map, Phase
from swarm.scenario.load import Scenario
from world.truth import truth
from world.world import World


class Speaker:
    """The sender of the world's messages; it keeps the fleet's current map."""

    def __init__(self, bus: Bus, scenario: Scenario, log: Callable[[str], None]) -> None:
        self._bus, self._log = bus, log
        self.scenario = scenario
        self.settings, self.packed = scenario.to_wire()
        self._clock_told = float("-inf")
        self._truth_every = max(1, round(scenario.settings.rate / TRUTH.rate))

    def take_map(self, floor: OccupancyMap) -> None:
        """Take over the current floor; robots that join or restart get this map."""
        self.scenario = replace(self.scenario, map=floor)
        self.settings, self.packed = self.scenario.to_wire()

    def floor(self, world: World) -> Map:
        """Return the map with the scenario's settings and the start of each robot."""
        homes = dict(zip(world.robots, world.starts, strict=True))
        return Map(packed=self.packed, scenario=replace_fields(self.settings, starts=homes), edits=world.edits)

    def tell_map(self, world: World) -> None:
        """Send the map."""
        self._bus.send(MAP, self.floor(world))

    def clock(self, world: World, phase: Phase, present: list[str]) -> Clock:
        """Return the message with the time and phase of the run."""
        return Clock(
            run=world.run, tick=world.tick, time=world.time, phase=phase, robots=list(world.robots), present=present
        )

    def tell_clock(self, clock: Clock) -> None:
        """Send the time and phase of the run."""
        self._clock_told = monotonic()
        self._bus.send(CLOCK, clock)

    @property
    def clock_is_due(self) -> bool:
        """True if it is time to send the clock again."""
        return monotonic() - self._clock_told >= 1.0 / CLOCK.rate

    def tell_truth(self, world: World) -> None:
        """Send all true poses at the topic's rate, if anybody listens."""
        if world.tick % self._truth_every == 0 and self._bus.wanted(TRUTH):
            self._bus.send(TRUTH, truth(world))

    def tell(self, event: Event) -> None:
        """Send and log an event."""
        self._bus.send(EVENT, event)
        self._log(f"{event.time:8.2f} s  {event.robot + ' ' if event.robot else ''}{event.text}")
