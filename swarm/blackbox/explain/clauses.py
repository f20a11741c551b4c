"""The causes that an explanation names, and the sentence of each."""

from enum import StrEnum
from typing import NamedTuple


class Clause(StrEnum):
    """One cause of what a robot does."""

    GONE = "gone"  # it does not answer
    LATE = "late"  # it answers too late: its wheels stand
    FOREIGN = "foreign"  # it runs other code
    MUTE = "mute"  # it says nothing of traffic
    ORDER = "order"  # it was told to stop
    POSE = "pose"  # it knows its pose too badly to drive
    OBSTACLE = "obstacle"  # something unexpected is ahead
    LISTENS = "listens"  # it has just started or woken
    STANDS = "stands"  # for a joint plan to come
    CALLS = "calls"  # it leads, and waits until the members stand
    SEARCHES = "searches"  # it leads, and searches
    ASKED = "asked"  # who asked for the joint plan
    ALSO = "also"  # it waits for others too
    TURN = "turn"  # in a joint plan, another robot goes first
    HELD = "held"  # another robot holds the cell
    CLAIMED = "claimed"  # another robot has claimed the cell, and goes first
    LACKS = "lacks"  # the claim is not acknowledged yet
    YOUNG = "young"  # the claim is acknowledged, and does not count yet
    WHEELS = "wheels"  # it may drive on, and its tables or its safety filter turn no wheel
    LOST = "lost"  # a broadcast that would end it was lost
    FAR = "far"  # a broadcast that would end it was out of range
    COMING = "coming"  # what ends it is under way
    SILENT = "silent"  # nothing was heard of another robot for long
    CIRCLE = "circle"  # the chain comes back to a robot in it
    LOOKS = "looks"  # it checks if the cell of a silent robot is empty
    ARRIVED = "arrived"
    REACHES = "reaches"  # it is in the cell of its stop, and drives to the place
    ASIDE = "aside"  # a joint plan sent it there, and others have to pass
    CUT_OFF = "cut_off"  # no way leads to its stop
    DRIVES = "drives"
    UNKNOWN = "unknown"  # no clause fits


class Cause(NamedTuple):
    """One line of an explanation."""

    depth: int  # in the chain; 0: about the robot asked for
    robot: str
    clause: Clause
    text: str
    other: str | None = None  # the robot that it names as the reason
    cell: int | None = None  # that it is about


def as_text(causes: list[Cause]) -> str:
    """Return the lines of an explanation, each indented by its depth."""
    return "\n".join(f"{'  ' * cause.depth}{cause.text}" for cause in causes)
