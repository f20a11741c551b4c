"""The imports of the fork server, made once before any fork, so that all processes share their memory pages.

This module opens no session and starts no thread: a fork would break them.
"""

import gc
import signal

import world.process  # noqa: F401
from swarm import compiled

signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches all processes; the launcher stops them in order

compiled.load()
gc.collect()
gc.freeze()  # the garbage collector does not touch the shared pages again
