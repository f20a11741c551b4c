"""A short drive of the scenario in the fork server, so that the processes forked from it share what it computes.

Shared are the planning grid, the cells and everything that is made on first use. A process asks for them as always and
gets the shared ones if its map is equal to the one that was driven here (``swarm.scenario.prepare``).
"""

from typing import Final

from swarm.bus.codec import decode, encode
from swarm.messages import COMMAND, RADIO, SENSE
from swarm.scenario.check import check
from swarm.scenario.load import Scenario
from swarm.scenario.source import Source
from world.simulate import Simulation

ROBOTS: Final = 2  # most that drive of each kind; two hear each other
TICKS: Final = 5  # all code of a tick has run; more ticks save no more memory


def rehearse_mission(source: Source) -> None:
    """Read a scenario, send it and all messages of a few ticks through the codec, and drive it for these ticks.

    Raises:
        SwarmError: the scenario cannot be read, or cannot be driven.
    """
    on_wire, packed = source.read().to_wire()
    scenario = Scenario.from_wire(on_wire, packed)
    settings, mix = scenario.settings, scenario.settings.robots
    if isinstance(mix, int):
        scenario, robots = scenario.with_robots(min(ROBOTS, mix))
    else:  # one of each kind, at least: each has its own grid and cells
        scenario, robots = scenario.with_robots({kind: min(ROBOTS, count) for kind, count in mix.items()})
    scenario = check(scenario, robots, settings.seed).scenario
    simulation = Simulation.of(scenario, robots, settings.seed)
    for _ in range(TICKS):
        tick = simulation.step()
        for topic, messages in ((SENSE, tick.senses), (COMMAND, tick.commands), (RADIO, tick.spoken)):
            for message in messages.values():
                decode(encode(message), topic.message, topic.limit)
