"""The process table of a fleet: what each process runs, and what the launcher does if it ends by itself.

The code of a process is imported only in that process.
"""

from collections.abc import Callable
from enum import StrEnum
from typing import Final, NamedTuple


class EarlyEnd(StrEnum):
    """The launcher's reaction to a process that ends by itself."""

    FINISH = "finish"  # the run is over
    RESTART = "restart"  # report it and start the process again
    REPORT = "report"  # report it and go on without the process
    LEAVE = "leave"  # the process has done its work


class Role(NamedTuple):
    """A kind of process."""

    name: str
    load: Callable[[], Callable[..., int]]  # imports and returns the function to run, which returns the exit status
    on_success: EarlyEnd  # it ended with exit status 0
    on_failure: EarlyEnd


def router() -> Callable[..., int]:
    """`swarm.bus.router`."""
    from swarm.bus.router import serve

    return serve


def world() -> Callable[..., int]:
    """`world.process`."""
    from world.process import run

    return run


def robot() -> Callable[..., int]:
    """`swarm.robot.process`."""
    from swarm.robot.process import run

    return run


def dashboard() -> Callable[..., int]:
    """`dashboard.process`."""
    from dashboard.process import run

    return run


# fmt: off
#                          name       load         on success         on failure
ROUTER: Final    = Role("router",    router,      EarlyEnd.RESTART,  EarlyEnd.RESTART)
WORLD: Final     = Role("world",     world,       EarlyEnd.FINISH,   EarlyEnd.FINISH)
ROBOT: Final     = Role("robot",     robot,       EarlyEnd.RESTART,  EarlyEnd.RESTART)
DASHBOARD: Final = Role("dashboard", dashboard,   EarlyEnd.LEAVE,    EarlyEnd.REPORT)
# fmt: on

STOP_ORDER: Final = (WORLD, DASHBOARD, ROBOT, ROUTER)  # the world first: it writes the report
RESTARTS: Final = 3  # most restarts of one process
