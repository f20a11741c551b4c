"""What a run was: poses, contacts, stops reached, who waited. The report is made from this alone."""

import hashlib
import struct
from collections import Counter
from collections.abc import Sequence
from itertools import chain
from typing import Final

from swarm.geometry import Pose, distance
from swarm.maps.occupancy import OccupancyMap, Point
from swarm.messages import Activity, Command
from swarm.scenario.load import Scenario
from world.clearance import ClearanceJudge
from world.physics import Contact

MOVES: Final = 0.01  # m/s of the faster rim: below that a robot stands
PARTED: Final = 1.0  # s; who touches the same again sooner has not let go of it: pressed bodies tremble
WAITING: Final = (Activity.GIVE_WAY, Activity.BLOCKED)


class Recorder:
    """Takes what the world did, tick by tick, and sums it up."""

    def __init__(self, scenario: Scenario, starts: Sequence[Pose], stops: list[tuple[Point, ...]], dt: float) -> None:
        robots = len(starts)
        self._dt = dt
        self._digest = hashlib.blake2b(digest_size=16)
        self._judge = ClearanceJudge(scenario.map, scenario.settings.robot.radius, robots)
        self._last: Sequence[Pose] = starts
        self._ticks = 0
        self._touched: dict[Contact, int] = {}  # the tick at which each contact was seen last
        self.path_length = [0.0] * robots  # m
        self.contact_counts = [Counter[str]() for _ in range(robots)]
        self.struck = [0] * robots  # contacts begun while the robot stood still: no stop could have prevented them
        self.begun: list[tuple[int, Contact, bool]] = []  # each contact: its tick, and whether the robot was struck
        self.reached_at: list[list[float | None]] = [[None] * len(row) for row in stops]  # s
        self.waiting = [0.0] * robots  # s
        self.replans = [0] * robots
        self.unreachable: list[list[int]] = [[] for _ in range(robots)]  # stops the robot gave up

    @property
    def digest(self) -> str:
        """A hash of every robot's pose at every tick: equal runs have equal digests."""
        return self._digest.hexdigest()

    @property
    def clearance_min(self) -> float:
        """The smallest gap seen [m], recomputed from the poses."""
        return self._judge.smallest

    @property
    def complete(self) -> bool:
        """Whether every robot has been at all its stops."""
        return all(time is not None for row in self.reached_at for time in row)

    def poses(self, poses: Sequence[Pose]) -> None:
        """Take where everybody stands at a tick."""
        self._ticks += 1
        self._digest.update(struct.pack(f"<{3 * len(poses)}d", *chain.from_iterable(poses)))
        for number, (before, pose) in enumerate(zip(self._last, poses, strict=True)):
            if pose != before:
                self.path_length[number] += distance(before, pose)
        self._judge.observe(poses)
        self._last = poses

    def set_floor(self, floor: OccupancyMap) -> None:
        """Take in that the floor is another from now on."""
        self._judge.set_floor(floor)

    def contacts(
        self, contacts: Sequence[Contact], touching: Sequence[Contact], wheels: Sequence[tuple[float, float]]
    ) -> list[Contact]:
        """Take the contacts that began in a tick, and how the wheels turned in it; give those that count.

        One that begins again within ``PARTED`` of its end is still the same; ``touching``: those that have not ended.
        """
        fresh = [c for c in contacts if self._ticks - self._touched.get(c, -PARTED / self._dt) >= PARTED / self._dt]
        self._touched |= dict.fromkeys((*contacts, *touching), self._ticks)
        for contact in fresh:
            self.contact_counts[contact.robot][contact.kind] += 1
            struck = abs(sum(wheels[contact.robot])) / 2 <= MOVES  # its round body was not going anywhere
            self.struck[contact.robot] += struck
            self.begun.append((self._ticks, contact, struck))
        return fresh

    def is_reached(self, robot: int, stop: int) -> bool:
        """Return True if a stop counts as reached."""
        return self.reached_at[robot][stop] is not None

    def reached(self, robot: int, stop: int, time: float) -> None:
        """Take that a robot has been at a stop."""
        self.reached_at[robot][stop] = time

    def doing(self, commands: Sequence[Command]) -> None:
        """Take what everybody was doing in a tick."""
        for number, command in enumerate(commands):
            self.replans[number] = command.replans
            self.unreachable[number] = command.unreachable
            if command.activity in WAITING:
                self.waiting[number] += self._dt
