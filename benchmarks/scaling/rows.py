"""The fleets that are measured, and their bars."""

from typing import Final, NamedTuple

from benchmarks.measure import DATA

RATE: Final = 20  # Hz of all rows but in real time


class Row(NamedTuple):
    """A fleet, and its bars; without a bar for the cost it runs in one process only."""

    name: str
    robots: int
    where: tuple[str, ...]  # arguments of ``swarm run``
    today: float | None = None  # ms of CPU per robot-tick, before the work on it began: shared/notes/fleet-cost.md
    cost: float | None = None  # ms of CPU per robot-tick
    pace: float | None = None  # times real time
    rate: float = RATE  # Hz, in real time
    length: int | None = None  # mean bytes of a broadcast
    memory: float = 0.0  # MB, own memory of a robot
    start: float = 0.0  # s, from the command to the first tick
    robot_seconds: int = 300  # a second, in one process

    @property
    def title(self) -> str:
        """The name of the row."""
        return f"{self.name} {self.robots}"


def _map(name: str) -> tuple[str, ...]:
    return str(DATA / f"{name}.map"), "--scen", str(DATA / f"{name}-random-1.scen")


RANDOM: Final = _map("random-32-32-20")
WAREHOUSE: Final = _map("warehouse-10-20-10-2-1")
# fmt: off
ROWS: Final = (  #                                  today  cost  pace  rate length memory start
    Row("paper",           8,   ("paper",), 1.40, 0.60, 15.0, 20.0, 250, 15.0, 2.0),
    Row("random-32-32-20", 16,  RANDOM,     1.65, 0.65, 8.0,  20.0, 400, 15.0, 2.5),
    Row("random-32-32-20", 32,  RANDOM,     3.50, 0.80, 3.0,  20.0, 900, 17.0, 3.0),
    Row("warehouse",       64,  WAREHOUSE,  1.50, 0.70, None, 20.0, 320, 20.0, 5.0),
    Row("warehouse",       128, WAREHOUSE,  2.50, 0.80, None, 10.0, 450, 20.0, 8.0),
    Row("warehouse",       256, WAREHOUSE,  None, 0.90, None, 5.0,  450, 20.0, 12.0),
    Row("warehouse",       1000, WAREHOUSE, robot_seconds=200),
)
# fmt: on
DENSITIES: Final = ("random-32-32-20 32", "warehouse 64")  # robots stand so dense in the table of messages
