"""Imported once in the fork server, before any fork: every process of the fleet shares these pages.

No session may be opened and no thread started here.
"""

import gc
import signal

import world.process  # noqa: F401
from swarm import compiled

signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole group; the launcher ends what it started

compiled.load()
gc.collect()
gc.freeze()  # the collector never touches again what is shared
