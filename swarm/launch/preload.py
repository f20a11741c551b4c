"""What the fork server does once before any fork, so that all processes share its memory pages: imports, a rehearsal.

This module opens no session and starts no thread: a fork would break them.
"""

import gc
import json
import os
import signal
from contextlib import suppress
from pathlib import Path

import world.process  # noqa: F401
from swarm import compiled
from swarm.errors import SwarmError
from swarm.launch.fleet import SOURCE
from swarm.launch.rehearsal import rehearse
from swarm.scenario.source import Source

signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches all processes; the launcher stops them in order

compiled.load()
if SOURCE in os.environ:
    file, scen, robots = json.loads(os.environ.pop(SOURCE))
    with suppress(SwarmError):  # the launcher reads the same files and says what is wrong with them
        rehearse(Source(Path(file), None if scen is None else Path(scen), robots))
gc.collect()
gc.freeze()  # the garbage collector does not touch the shared pages again
