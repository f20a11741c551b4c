"""What goes wrong with robots in a drill: held up, suspended, killed, slow to answer; drawn with its own seed."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from math import inf
from random import Random

LASTS = 5.0  # s, a hold-up or a suspension


@dataclass(frozen=True)
class Faults:
    """How often what happens. Times in simulated s."""

    held_up: float = 0.0  # each robot's motors stand for 5 s, on average this often; 0: never
    suspended: float = 0.0  # the same for the whole process: brain, radio and motors
    kill_leader_at: float = inf  # the first robot that leads a joint plan from then on dies
    killed: Mapping[str, float] | None = None  # robot: when it dies
    late: float = 0.0  # what robots answer, wheels and radio, comes so much later


class Health(Enum):
    """What works in a robot at a tick."""

    WELL = "well"
    HELD_UP = "held up"  # it thinks and speaks, but its wheels stand
    SUSPENDED = "suspended"  # nothing runs; it comes back
    DEAD = "dead"


class Drill:
    """Draws the faults of one run."""

    def __init__(self, faults: Faults, seed: int, dt: float) -> None:
        self.dead: dict[str, float] = {}  # when each died [s]
        self.struck: set[str] = set()  # those ever suspended or killed
        self.late = round(faults.late / dt)  # ticks between what robots sense and what they answer to it
        self._faults = faults
        self._chance = Random(f"faults {seed}")
        self._dt = dt
        self._until: dict[str, tuple[Health, float]] = {}

    def health(self, robot: str, time: float, *, leads: bool) -> Health:
        """Tell how a robot is; ask once a tick. ``leads``: it is making a joint plan, or its plan is still news."""
        faults = self._faults
        if robot in self.dead:
            return Health.DEAD
        named = faults.killed is not None and time >= faults.killed.get(robot, inf)
        if named or (leads and not self.dead and time >= faults.kill_leader_at):
            self.dead[robot] = time
            self.struck.add(robot)
            return Health.DEAD
        health, until = self._until.get(robot, (Health.WELL, 0.0))
        if time < until:
            return health
        for health, often in ((Health.SUSPENDED, faults.suspended), (Health.HELD_UP, faults.held_up)):
            if often and self._chance.random() < self._dt / often:
                self._until[robot] = (health, time + LASTS)
                self.struck |= {robot} if health is Health.SUSPENDED else set()
                return health
        return Health.WELL
