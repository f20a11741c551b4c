"""Faults of robots in a simulation: held up, suspended, killed, late to answer; listed, or drawn with a seed."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import Enum
from math import inf
from random import Random
from typing import Final, NamedTuple

LASTS = 5.0  # s, length of a drawn hold-up or suspension
LASTS_TICKS: Final = 60  # ticks for which a drawn delay holds at most: three seconds
CHANGES: Final = 0.5  # chance that a delay changes from tick to tick for that long, as on a busy machine


class Health(Enum):
    """The health of a robot at a tick."""

    WELL = "well"
    HELD_UP = "held_up"  # it decides and broadcasts, but its wheels stand
    SUSPENDED = "suspended"  # nothing runs; it comes back
    AWAY = "away"  # its process has ended; a new one will take over its place and its mission
    DEAD = "dead"


SILENT: Final = frozenset({Health.SUSPENDED, Health.AWAY, Health.DEAD})  # it neither decides nor broadcasts


class Spell(NamedTuple):
    """One fault of one robot: its first tick and its length in ticks."""

    robot: str
    health: Health
    tick: int
    ticks: int


@dataclass(frozen=True)
class Faults:
    """The faults of a run. All times are simulated seconds."""

    held_up: float = 0.0  # mean time until the motors of a robot stand for 5 s; 0: never
    suspended: float = 0.0  # mean time until brain, radio and motors of a robot stop for 5 s; 0: never
    kill_leader_at: float = inf  # the first robot that leads a joint plan at or after this time dies
    killed: Mapping[str, float] | None = None  # robot -> time of its death
    spells: tuple[Spell, ...] = ()
    late: float = 0.0  # delay of what robots answer: commands and broadcasts
    slow: float = 0.0  # the most by which answers are late besides; the delay of each robot changes


class Drill:
    """The faults of one run as they happen, listed or drawn."""

    def __init__(self, faults: Faults, seed: int, dt: float) -> None:
        self.dead: dict[str, float] = {}  # when each died [s]
        self.struck: set[str] = set()  # robots that were ever suspended, away or killed
        self.late = round(faults.late / dt)  # ticks between what robots sense and what they answer to it
        self.slowest = self.late + round(faults.slow / dt)  # ticks by which an answer is late at most
        self._faults = faults
        self._seed = seed
        self._delays: dict[str, Iterator[int]] = {}
        self._chance = Random(f"faults {seed}")
        self._dt = dt
        self._until: dict[str, tuple[Health, float]] = {}
        often = ((Health.SUSPENDED, faults.suspended), (Health.HELD_UP, faults.held_up))
        self._often = [(health, seconds) for health, seconds in often if seconds]
        self._spells: dict[str, list[Spell]] = {}
        for spell in faults.spells:
            self._spells.setdefault(spell.robot, []).append(spell)

    def delay(self, robot: str) -> int:
        """Return by how many ticks a robot's answer comes late; call it once for each answer."""
        if self.slowest == self.late:
            return self.late
        if robot not in self._delays:
            self._delays[robot] = _changing_delays(self.slowest - self.late, Random(f"slow {self._seed} {robot}"))
        return self.late + next(self._delays[robot])

    def health(self, robot: str, time: float, *, leads: bool) -> Health:
        """Return the health of a robot at a time [s]; call it once per tick.

        ``leads`` says that the robot is making a joint plan or still broadcasts its plan.
        """
        faults = self._faults
        if robot in self.dead:
            return Health.DEAD
        named = faults.killed is not None and time >= faults.killed.get(robot, inf)
        if named or (leads and not self.dead and time >= faults.kill_leader_at):
            self.dead[robot] = time
            self.struck.add(robot)
            return Health.DEAD
        tick = round(time / self._dt)
        for spell in self._spells.get(robot, ()):
            if spell.tick <= tick < spell.tick + spell.ticks:
                self.struck |= {robot} if spell.health in SILENT else set()
                return spell.health
        health, until = self._until.get(robot, (Health.WELL, 0.0))
        if time < until:
            return health
        for health, often in self._often:
            if self._chance.random() < self._dt / often:
                self._until[robot] = (health, time + LASTS)
                self.struck |= {robot} if health is Health.SUSPENDED else set()
                return health
        return Health.WELL


def _changing_delays(most: int, chance: Random) -> Iterator[int]:
    """Yield delays of 0 to ``most`` ticks: each holds for a while, or all change from tick to tick for a while."""
    while True:
        changes, delay = chance.random() < CHANGES, chance.randint(0, most)
        for _ in range(chance.randint(1, LASTS_TICKS)):
            yield chance.randint(0, most) if changes else delay
