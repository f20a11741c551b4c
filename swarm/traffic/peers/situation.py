"""What one robot knows of traffic in one step."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

from swarm.messages.traffic import Record
from swarm.traffic.lattice.cell_map import OUTSIDE, CellMap
from swarm.traffic.peers.sightings import Cleared


def cells_needed_at_stop(record: Record) -> tuple[int, ...]:
    """Return the cells beside its own that a robot needs at its stop, where it stands; () elsewhere."""
    here = bool(record.held) and record.held[-1] == record.goal and record.then == OUTSIDE
    return record.ahead if here and not (record.done or record.idle) and record.goal not in record.ahead else ()


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
    then: int = OUTSIDE  # cell of the stop after its goal; OUTSIDE: there is none
    done: bool = False  # it has no stop left
    wants: int = 0  # tick since which it has had this goal
    bodies: Callable[[], frozenset[int]] = frozenset  # cells in which silent robots were last heard, and may stand
    mutes: frozenset[str] = frozenset()  # robots that are heard but say nothing of traffic
    stays: frozenset[int] = frozenset()  # cells that they have covered for long
    by_dock: bool = False  # it comes to its stop over cells beside its own, and only once a plan has led it to its cell
    docking: tuple[int, ...] = ()  # cells beside its own that it needs at its stop, those that others hold first

    @property
    def stop_to_visit(self) -> int:
        """The cell that the robot has to drive over, whatever comes then: that of its stop; OUTSIDE: none."""
        return OUTSIDE if self.done or self.idle or self.by_dock else self.goal
