"""What one robot knows of traffic in one step."""

from collections.abc import Mapping
from typing import NamedTuple

from swarm.messages.traffic import Record
from swarm.traffic.sightings import Cleared


class Situation(NamedTuple):
    """Where it stands, where it wants to be, and what the others last said."""

    tick: int
    head: int  # cell
    goal: int  # cell
    idle: bool  # stands there only because it has to stand somewhere
    moved: int  # tick at which it last got on
    blocked: frozenset[int]  # cells in which somebody saw a body that nobody speaks for
    cleared: Cleared  # silent robots' cells that somebody saw empty
    others: Mapping[str, Record]
    fresh: Mapping[str, Record]
    done: bool = False  # has no stop left
    wants: int = 0  # tick since which it has had this goal
    bodies: frozenset[int] = frozenset()  # cells in which silent robots were heard last, and may still stand
