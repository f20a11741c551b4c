"""A line on what happened at a tick, before it is an event of a run."""

from typing import NamedTuple

from swarm.maps.occupancy import Point


class EventLine(NamedTuple):
    """What happened."""

    kind: str
    text: str
    robot: str | None = None
    at: Point | None = None  # m, where it happened
