"""Imports every module with numba kernels. The first import compiles them, which can take up to a minute."""

import importlib
import sys
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
    "swarm.traffic.fitting",
    "swarm.traffic.footprint",
    "world.rays",
)


def load() -> None:
    """Import every kernel, compiling where needed; numba caches the result beside the code."""
    for name in KERNELS:
        importlib.import_module(name)


if __name__ == "__main__":
    print("compiling the numba kernels (once, under a minute)", file=sys.stderr)
    load()
