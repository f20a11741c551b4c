"""The words that fields may hold. The comment beside each is its meaning in the documentation."""

from enum import StrEnum


class Activity(StrEnum):
    """What a robot is doing, in one word."""

    READY = "ready"  # nothing to do yet
    DRIVE = "drive"  # under way to its target
    GIVE_WAY = "give_way"  # stands for another robot
    BLOCKED = "blocked"  # no path just now; it asks for one again and again
    DONE = "done"  # the whole sequence, and home where that is asked for


class Steering(StrEnum):
    """What became of the fuzzy tables' wheel speeds, as the world works it out; the report gives the share of each."""

    BRAKED = "braked"  # the wheels stand, though the tables would move
    TABLES = "tables"  # unaltered, or slower in the same ratio
    TIGHTENED = "tightened"  # the same yaw rate with less forward speed
    TURNED = "turned"  # a turn on the spot at another rate
    BLENDED = "blended"  # anything else


class Phase(StrEnum):
    """Where the world's run stands."""

    WAITING = "waiting"  # robots are still missing, or nobody said go
    RUNNING = "running"  # the clock runs
    PAUSED = "paused"  # the clock stands until somebody says resume
    OVER = "over"  # complete, given up or stopped


class Do(StrEnum):
    """The paper's buttons, and those beside them."""

    GO = "go"  # begin
    PAUSE = "pause"  # let the clock stand
    RESUME = "resume"  # let it run again
    RESTART = "restart"  # all back to their starts, progress cleared
    STOP = "stop"  # end the run


class Kind(StrEnum):
    """What an edit puts on the floor."""

    WALL = "wall"  # a wall
    OBSTACLE = "obstacle"  # an obstacle: drawn in another colour, driven round like a wall
    FREE = "free"  # free floor
