"""The enumerations of fields. The documentation shows the comment beside each value as its meaning."""

from enum import StrEnum


class Activity(StrEnum):
    """What a robot is doing, in one word."""

    READY = "ready"  # waits for its first task
    DRIVE = "drive"  # drives to its target, or has targets left and none of the following is true
    GIVE_WAY = "give_way"  # waits for another robot: for a cell, or in the call for a joint plan
    BLOCKED = "blocked"  # has no way to its target now: walls, obstacles, silent or stopped robots shut it; it retries
    STOPPED = "stopped"  # was told to stop; it waits for the action `go_on`
    DONE = "done"  # all targets are finished, home included if the mission returns


class Steering(StrEnum):
    """How a command differs from the fuzzy tables' wheel speeds, computed by the world; the report has the shares."""

    BRAKED = "braked"  # the wheels stand, although the tables would move
    TABLES = "tables"  # unchanged, or slower in the same ratio
    TIGHTENED = "tightened"  # the same yaw rate with less forward speed
    TURNED = "turned"  # a turn in place at another rate
    BLENDED = "blended"  # anything else


class Phase(StrEnum):
    """The phase of a run."""

    WAITING = "waiting"  # robots are missing, or the action `go` has not come
    RUNNING = "running"  # the clock runs
    PAUSED = "paused"  # the clock stands until the action `resume`
    OVER = "over"  # complete, given up or stopped


class Liveness(StrEnum):
    """Whether a robot's process is there and speaks, as the world sees it."""

    ALIVE = "alive"  # its process is present, and has spoken lately or is not asked to
    STALE = "stale"  # its process is present, but has said nothing for longer than `state` is valid while the clock ran
    GONE = "gone"  # its process is not present
    LOST = "lost"  # its process has been absent for so long that the run may end without it


class Do(StrEnum):
    """The actions that a user can request: the paper's buttons and some more."""

    GO = "go"  # start the run
    PAUSE = "pause"  # stop the clock
    RESUME = "resume"  # start the clock again
    RESTART = "restart"  # put all robots back to their starts, clear their progress, and drive at once if `go` has come
    STOP = "stop"  # end the run


class RobotDo(StrEnum):
    """The actions that a user can request of one robot."""

    STOP = "stop"  # brake and stand until the action `go_on`, whatever the robot says
    GO_ON = "go_on"  # end the stop
    HOME = "home"  # drop the targets that are left, and drive home
    CANCEL = "cancel"  # drop the targets that are left, and stay
    LOAD = "load"  # take up a load that makes it as wide as `radius` says, or put its load down


class Kind(StrEnum):
    """What the cells of an edit become."""

    WALL = "wall"  # a wall
    OBSTACLE = "obstacle"  # an obstacle: as solid as a wall, but drawn and counted separately
    FREE = "free"  # free floor
