"""The record of a run, from which the report is made: poses, contacts, waiting times. It decides nothing."""

import hashlib
import struct
from collections import Counter
from collections.abc import Sequence
from itertools import chain
from typing import Final, NamedTuple

import msgspec

from swarm.geometry import Pose, distance
from swarm.maps.occupancy import OccupancyMap
from swarm.messages import Activity, Command, Message
from swarm.scenario.load import Scenario
from world.bodies.shapes import Contact
from world.measure.clearance import ClearanceJudge
from world.measure.contact_cause import MOVES, Blame, stands

PARTED: Final = 1.0  # s; a contact that begins again sooner is still the same: bodies under pressure tremble
WAITING: Final = (Activity.GIVE_WAY, Activity.BLOCKED)


class RecorderState(NamedTuple):
    """The state of `Recorder`."""

    digest: bytes
    last: Sequence[Pose]
    ticks: int
    touched: dict[Contact, int]
    path_length: list[float]
    contact_counts: list[Counter[str]]
    struck: list[int]
    begun: list[tuple[int, Contact, bool]]
    waiting: list[float]
    standing: list[float]
    waits_for: list[dict[str, float]]
    before: list[Sequence[Pose]]  # of `Blame`
    pushed: set[int]
    smallest: float  # m, of `ClearanceJudge`


class Recorder:
    """The record of one run. The world feeds it tick by tick."""

    def __init__(self, scenario: Scenario, starts: Sequence[Pose], dt: float) -> None:
        robots = len(starts)
        self._dt = dt
        self._digest = bytes(16)
        self.judge = ClearanceJudge(scenario.map, scenario.settings.robot.radius)
        self.blame = Blame(scenario.settings.movers, scenario.settings.robot.radius, starts, dt)
        self._last: Sequence[Pose] = starts
        self._ticks = 0
        self._touched: dict[Contact, int] = {}  # the tick at which each contact was seen last
        self.path_length = [0.0] * robots  # m
        self.contact_counts = [Counter[str]() for _ in range(robots)]
        self.struck = [0] * robots  # contacts while the robot stood still: no braking could have prevented them
        self.begun: list[tuple[int, Contact, bool]] = []  # each contact: its tick, could the robot have avoided it
        self.waiting = [0.0] * robots  # s
        self.standing = [0.0] * robots  # s, with a stop left
        self.waits_for: list[dict[str, float]] = [{} for _ in range(robots)]  # s, for each robot waited for

    def add_robot(self, start: Pose) -> None:
        """Record one more robot from now on."""
        self.judge.settle()  # it judges ticks with equally many robots at once
        self._last = [*self._last, start]
        self.path_length.append(0.0)
        self.contact_counts.append(Counter())
        self.struck.append(0)
        self.blame.add_robot(start)
        self.waiting.append(0.0)
        self.standing.append(0.0)
        self.waits_for.append({})

    @property
    def state(self) -> RecorderState:
        """The state, which shares its values with this object."""
        return RecorderState(
            self._digest, self._last, self._ticks, self._touched, self.path_length, self.contact_counts, self.struck,
            self.begun, self.waiting, self.standing, self.waits_for,
            self.blame.before, self.blame.pushed, self.clearance_min,
        )  # fmt: skip

    def restore(self, state: RecorderState) -> None:
        """Continue from a state."""
        (
            self._digest, self._last, self._ticks, self._touched, self.path_length, self.contact_counts, self.struck,
            self.begun, self.waiting, self.standing, self.waits_for,
            self.blame.before, self.blame.pushed, smallest,
        ) = state  # fmt: skip
        self.judge.restore(smallest)

    @property
    def digest(self) -> str:
        """A hash of every robot's pose at every tick and of all requests to robots: equal runs have equal digests."""
        return self._digest.hex()

    @property
    def clearance_min(self) -> float:
        """The smallest gap seen [m], recomputed from the poses."""
        return self.judge.smallest

    @property
    def avoidable(self) -> int:
        """Number of contacts that a robot could have avoided by stopping; one of two robots counts once."""
        return len({(tick, c.kind, frozenset((c.robot, c.other))) for tick, c, avoidable in self.begun if avoidable})

    def poses(self, poses: Sequence[Pose]) -> None:
        """Record the poses of all robots at a tick."""
        self._ticks += 1
        packed = struct.pack(f"<{3 * len(poses)}d", *chain.from_iterable(poses))
        self._digest = hashlib.blake2b(self._digest + packed, digest_size=16).digest()
        for number, (before, pose) in enumerate(zip(self._last, poses, strict=True)):
            if pose != before:
                self.path_length[number] += distance(before, pose)
        self.judge.observe(poses)
        self._last = poses

    def set_floor(self, floor: OccupancyMap) -> None:
        """Judge gaps against this floor from now on."""
        self.judge.set_floor(floor)

    def contacts(
        self,
        contacts: Sequence[Contact],
        touching: Sequence[Contact],
        wheels: Sequence[tuple[float, float]],
        poses: Sequence[Pose],
    ) -> list[Contact]:
        """Record the contacts that began in a tick, with the rim speeds [m/s] in it; return those that count.

        A contact that begins again within ``PARTED`` of its end does not count: it is still the same. ``touching`` are
        the contacts that have not ended, and ``poses`` those at the tick's end.
        """
        kept, seen = PARTED / self._dt, self._touched
        fresh = [c for c in contacts if c not in seen or self._ticks - seen[c] >= kept]
        self._touched |= dict.fromkeys((*contacts, *touching), self._ticks)
        verdicts = self.blame.look(self._ticks, fresh, touching, wheels, poses)
        for contact, avoidable in zip(fresh, verdicts, strict=True):
            self.contact_counts[contact.robot][contact.kind] += 1
            self.struck[contact.robot] += stands(wheels[contact.robot])
            self.begun.append((self._ticks, contact, avoidable))
        return fresh

    def request(self, robot: int, request: Message) -> None:
        """Record a request to a robot that has changed something."""
        packed = msgspec.msgpack.encode((robot, request))
        self._digest = hashlib.blake2b(self._digest + packed, digest_size=16).digest()

    def doing(self, commands: Sequence[Command]) -> None:
        """Record what every robot did in a tick."""
        for number, command in enumerate(commands):
            if command.activity in WAITING:
                self.waiting[number] += self._dt
                row = self.waits_for[number]
                for other in set(command.waits):
                    row[other] = row.get(other, 0.0) + self._dt

    def stood(self, stops: Sequence[int | None], wheels: Sequence[tuple[float, float]]) -> None:
        """Record who stood in a tick with a stop left, by the rim speeds [m/s]; it does not depend on what they say."""
        for number, (stop, (left, right)) in enumerate(zip(stops, wheels, strict=True)):
            if stop is not None and abs(left) <= MOVES and abs(right) <= MOVES:
                self.standing[number] += self._dt
