"""The processes of a fleet: what runs, and what it means when one ends before it is told to."""

from enum import StrEnum
from typing import Final, NamedTuple


class EarlyEnd(StrEnum):
    """What the launcher does about a process that ends by itself."""

    FINISH = "finish"  # the run is over
    RESTART = "restart"  # say so, and start another one
    REPORT = "report"  # say so, and go on without
    LEAVE = "leave"  # it was done


class Role(NamedTuple):
    """A kind of process."""

    name: str
    target: str  # module:function
    on_success: EarlyEnd  # it ended with exit status 0
    on_failure: EarlyEnd


# fmt: off
#                          name         target                           on success         on failure
ROUTER: Final    = Role("router",    "swarm.bus.router:serve",        EarlyEnd.RESTART,  EarlyEnd.RESTART)
WORLD: Final     = Role("world",     "world.process:run",             EarlyEnd.FINISH,   EarlyEnd.FINISH)
ROBOT: Final     = Role("robot",     "swarm.robot.process:run",       EarlyEnd.RESTART,  EarlyEnd.RESTART)
DASHBOARD: Final = Role("dashboard", "dashboard.process:run",         EarlyEnd.LEAVE,    EarlyEnd.REPORT)
# fmt: on

STOP_ORDER: Final = (WORLD, DASHBOARD, ROBOT, ROUTER)  # the world first: it writes the report
RESTARTS: Final = 3  # times that one process is started again
