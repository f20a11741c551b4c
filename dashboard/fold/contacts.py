"""Where robots have touched something, from the fleet's events."""

from collections.abc import Iterable
from typing import Final, NamedTuple

from swarm.maps.occupancy import Point
from swarm.messages import Event

CONTACT: Final = "contact"  # the kind of event


class Touch(NamedTuple):
    """A contact that has begun."""

    time: float  # s, since the run began
    at: Point  # m
    text: str  # for people


def touches(events: Iterable[Event]) -> list[Touch]:
    """Return the contacts among events whose place is known; a contact of two robots, told of both, is one."""
    found: dict[tuple[float, Point], Touch] = {}
    for event in events:
        if event.kind == CONTACT and event.at is not None:
            text = f"{event.time:.1f} s: {event.robot} {event.text}"
            found.setdefault((event.time, event.at), Touch(event.time, event.at, text))
    return list(found.values())
