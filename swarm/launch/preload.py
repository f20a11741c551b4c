"""Imported once in the fork server, before any fork: every process of the fleet shares these pages.

No session may be opened and no thread started here.
"""

import gc

import msgpack
import msgspec
import zenoh

import swarm.compiled
import swarm.robot.process
import swarm.bus.router  # noqa: I001

swarm.compiled.load()
gc.collect()
gc.freeze()  # what is shared is never touched by the collector again

__all__ = ["msgpack", "msgspec", "zenoh"]
