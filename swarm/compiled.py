"""Imports every module with numba kernels. The first import compiles them, which can take up to a minute."""

import importlib
import sys
from typing import Final

KERNELS: Final = (
    "swarm.planning.grid",
    "swarm.planning.path",
    "swarm.planning.rays",
    "swarm.fuzzy",
    "swarm.motion.sweep",
    "swarm.robot.rollout",
    "world.rays",
)


def load() -> None:
    """Import every kernel, compiling where needed; numba caches the result beside the code."""
    for name in KERNELS:
        importlib.import_module(name)


if __name__ == "__main__":
    print("compiling the numba kernels (once, under a minute)", file=sys.stderr)
    load()
