"""What one robot knows of traffic in one step."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

from swarm.messages.traffic import Record
from swarm.traffic.lattice.cell_map import CellMap
from swarm.traffic.peers.sightings import Cleared


class Situation(NamedTuple):
    """Where the robot stands, where it wants to be, and what the others last said."""

    tick: int
    cells: CellMap
    head: int  # cell
    goal: int  # cell
    others: Mapping[str, Record]
    fresh: Mapping[str, Record]
    idle: bool = False  # it has no goal and only needs a place to stand
    moved: int = 0  # tick of its last progress
    blocked: frozenset[int] = frozenset()  # cells in which a robot saw an unexpected body
    cleared: Cleared = frozenset()  # cells of silent robots that a robot saw empty
    done: bool = False  # it has no stop left
    wants: int = 0  # tick since which it has had this goal
    bodies: Callable[[], frozenset[int]] = frozenset  # cells in which silent robots were last heard, and may stand
    mutes: frozenset[str] = frozenset()  # robots that are heard but say nothing of traffic
    stays: frozenset[int] = frozenset()  # cells that they have covered for long
