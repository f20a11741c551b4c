"""The process table of a fleet: what each process runs, and what the launcher does if it ends by itself.

The code of a process is imported only in that process.
"""

from collections.abc import Callable
from enum import StrEnum
from pathlib import Path
from typing import Any, Final, NamedTuple


class EarlyEnd(StrEnum):
    """The launcher's reaction to a process that ends by itself."""

    FINISH = "finish"  # the run is over
    RESTART = "restart"  # report it and start the process again
    REPORT = "report"  # report it and go on without the process
    LOSE = "lose"  # report it and go on without its robots, which the summary names
    LEAVE = "leave"  # the process has done its work


class Role(NamedTuple):
    """A kind of process."""

    name: str
    run: str  # module:function that it runs, which returns the exit status
    on_success: EarlyEnd  # it ended with exit status 0
    on_failure: EarlyEnd  # it ended with another one
    on_kill: EarlyEnd  # a signal or a crash ended it
    too_often: EarlyEnd  # it has ended more than RESTARTS times within WITHIN
    again: Callable[[dict[str, Any], int], dict[str, Any]] = lambda arguments, number: (
        arguments
    )  # those of start `number`
    grace: float = 5.0  # s between SIGTERM and SIGKILL


def without_window(arguments: dict[str, Any], number: int) -> dict[str, Any]:
    """Return the arguments of a box that is started again: the page that is open connects by itself."""
    return arguments if number == 1 else arguments | {"open_page": False}


def arguments_for_next_file(arguments: dict[str, Any], number: int) -> dict[str, Any]:
    """Return the arguments of a dashboard or a recorder that is started again: it records in another file."""
    record: Path | None = arguments["record"]
    return arguments if record is None else arguments | {"record": numbered_file(record, number)}


def numbered_file(record: Path, number: int) -> Path:
    """Return the file in which start ``number`` of a process records, if the first one records in ``record``.

    >>> numbered_file(Path("run.rrd"), 2).name
    'run.2.rrd'
    """
    return record if number == 1 else record.with_stem(f"{record.stem}.{number}")


FINISH, RESTART, REPORT, LOSE, LEAVE = EarlyEnd
REPORTS: Final = 20.0  # s in which a world that was told to end writes its report, also at a load of 10 for each core

# fmt: off
#                          name         module:function                 on success  on failure  killed    too often
ROUTER: Final    = Role("router",    "swarm.bus.router:serve",         RESTART,    RESTART,    RESTART,  FINISH)
PROXY: Final     = Role("proxy",     "swarm.launch.proxy:serve",       RESTART,    RESTART,    RESTART,  FINISH)
WORLD: Final     = Role("world",     "world.host.process:run",         FINISH,     FINISH,     RESTART,  FINISH,
                        grace=REPORTS)
ROBOT: Final     = Role("robot",     "swarm.robot.host.process:run",   LEAVE,      RESTART,    RESTART,  LOSE)
DASHBOARD: Final = Role("dashboard", "dashboard.process:run",          LEAVE,      REPORT,     RESTART,  REPORT,
                        again=arguments_for_next_file)
RECORDER: Final  = Role("recorder",  "swarm.bridge.foxglove.process:record", LEAVE,  REPORT,     RESTART,  REPORT,
                        again=arguments_for_next_file)
BOX: Final       = Role("box",       "dashboard.box.process:run",      RESTART,    REPORT,     RESTART,  REPORT,
                        again=without_window)
ROS2: Final      = Role("ros2",      "swarm.bridge.ros2.process:run",  LEAVE,      REPORT,     RESTART,  REPORT)
# fmt: on

CRASHED: Final = 70  # exit status of a process that ended with a traceback (EX_SOFTWARE of sysexits.h)
BRIDGES: Final = (ROS2,)  # that the launcher starts for `--bridge`, by their names
STOP_ORDER: Final = (
    WORLD,
    DASHBOARD,
    RECORDER,
    BOX,
    *BRIDGES,
    ROBOT,
    PROXY,
    ROUTER,
)  # the world first: it writes the report
RESTARTS: Final = 3  # most restarts of one process within WITHIN
WITHIN: Final = 60.0  # s
