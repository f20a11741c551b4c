"""Loads everything that numba compiles; the first time ever it compiles, which takes a while, and says so."""

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
    """Have every kernel ready; compiled ones are kept beside the code for the next time."""
    for name in KERNELS:
        importlib.import_module(name)


if __name__ == "__main__":
    print("compiling the controller and the planner (once; under a minute)", file=sys.stderr)
    load()
