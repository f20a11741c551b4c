"""What is compiled: the kernels by numba, and in the package of `make compiled` other modules by mypyc."""

import importlib
import sys
from importlib.util import find_spec
from typing import Final

KERNELS: Final = (  # a test compares this list with the code
    "swarm.fuzzy.kernel",
    "swarm.motion.drive",
    "swarm.motion.sweep",
    "swarm.planning.distance",
    "swarm.planning.rays",
    "swarm.planning.search",
    "swarm.planning.steps",
    "swarm.planning.sweep",
    "swarm.robot.flight",
    "swarm.robot.rollout",
    "swarm.traffic.breadth_first",
    "swarm.traffic.duration",
    "swarm.traffic.fitting",
    "swarm.traffic.footprint",
    "swarm.traffic.hearing",
    "world.rays",
)


def load() -> None:
    """Import every kernel. The first import compiles, up to a minute for all; numba caches the result."""
    for name in KERNELS:
        importlib.import_module(name)


def by_mypyc() -> bool:
    """Return True if this is the package of `make compiled`."""
    found = find_spec("swarm.geometry")
    return found is not None and found.origin is not None and not found.origin.endswith(".py")


if __name__ == "__main__":
    print("compiling the numba kernels (once, under a minute)", file=sys.stderr)
    load()
