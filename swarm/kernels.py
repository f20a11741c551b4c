"""The kernels that numba compiles, and the announcement that it does."""

import importlib
import sys
from collections.abc import Sequence
from typing import Final

from swarm.errors import ConfigError, SwarmError
from swarm.installation import ROBOT, check

KERNELS: Final = (  # a test compares this list with the code
    "swarm.fuzzy.kernel",
    "swarm.motion.drive",
    "swarm.planning.astar",
    "swarm.planning.distance",
    "swarm.planning.rays",
    "swarm.planning.steps",
    "swarm.planning.sweep",
    "swarm.robot.driving.evasion",
    "swarm.robot.driving.tables",
    "swarm.traffic.lattice.discs",
    "swarm.traffic.lattice.distances",
    "swarm.traffic.mapf.schedule",
    "swarm.traffic.peers.radio_range",
    "world.bodies.rays",
)
COMPILING: Final = "compiling the kernels of planning, steering and traffic for this processor (once, under a minute)"


def announce_compilation() -> None:
    """Say it on stderr, once, if this process compiles kernels that are in no cache; call it before they are imported.

    Raises:
        ConfigError: there is no folder for the cache.
    """
    from numba.core.event import Event, Listener, register

    class Teller(Listener):
        said = False

        def on_start(self, event: Event) -> None:
            if not self.said:
                self.said = True
                print(COMPILING, file=sys.stderr, flush=True)

        def on_end(self, event: Event) -> None:
            """Do nothing."""

    register("numba:compile", Teller())  # type: ignore[no-untyped-call]  # numba declares no types here
    load(KERNELS[:1])


def load(kernels: Sequence[str] = KERNELS) -> None:
    """Import every kernel. The first import compiles, up to a minute for all; numba caches the result.

    Raises:
        ConfigError: there is no folder for the cache.
    """
    try:
        for name in kernels:
            importlib.import_module(name)
    except RuntimeError as fault:
        if "no locator available" not in str(fault):  # numba's words, for which it has no class
            raise
        raise ConfigError(
            "kernels: expected a folder for compiled code that can be written, neither that of the package nor the "
            "user's cache can; set NUMBA_CACHE_DIR to one"
        ) from None


if __name__ == "__main__":
    try:
        check(ROBOT)  # the image of a robot has no others
        announce_compilation()
        load()
    except SwarmError as fault:
        sys.exit(str(fault))
