"""Imported once in the fork server, before any fork: every process of the fleet shares these pages.

No session may be opened and no thread started here.
"""

import gc
import importlib
import signal
from typing import Final

from swarm import compiled

signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole group; the launcher ends what it started

MODULES: Final = ("swarm.bus.router", "swarm.robot.process", "world.process")

for module in MODULES:
    importlib.import_module(module)
compiled.load()
gc.collect()
gc.freeze()  # the collector never touches again what is shared
