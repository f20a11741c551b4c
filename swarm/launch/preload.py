"""The imports of the fork server, made once before any fork, so that all processes share their memory pages.

This module opens no session and starts no thread: a fork would break them.
"""

import gc
import json
import os
import signal
from pathlib import Path

import world.process  # noqa: F401
from swarm import compiled
from swarm.bus.codec import decode, encode
from swarm.errors import SwarmError
from swarm.launch.fleet import SOURCE
from swarm.messages import CLOCK, COMMAND, RADIO, SENSE, STATE
from swarm.scenario.check import check
from swarm.scenario.source import Source
from world.simulate import Simulation

ROBOTS = 2
TICKS = 5


def rehearse(source: Source) -> None:
    """Drive a scenario for a few ticks: what its processes compute from the map, or on first use, is then shared."""
    scenario = source.read()
    robots = min(ROBOTS, scenario.settings.robots)
    check(scenario, robots, scenario.settings.seed)
    simulation = Simulation.of(scenario, robots, scenario.settings.seed)
    for _ in range(TICKS):
        tick = simulation.step()
        for topic, messages in ((SENSE, tick.senses), (COMMAND, tick.commands), (RADIO, tick.spoken)):
            for message in messages.values():
                decode(encode(message), topic.message, topic.limit)


signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches all processes; the launcher stops them in order

compiled.load()
if SOURCE in os.environ:
    file, scen, robots = json.loads(os.environ[SOURCE])
    try:
        rehearse(Source(Path(file), scen and Path(scen), robots))
    except SwarmError:
        pass  # the launcher reads the same files and says what is wrong with them
gc.collect()
gc.freeze()  # the garbage collector does not touch the shared pages again
