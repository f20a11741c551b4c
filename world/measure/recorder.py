"""The record of a run, from which the report is made: poses, contacts, waiting times. It decides nothing."""

import hashlib
import struct
from collections import Counter
from collections.abc import Sequence
from itertools import chain
from typing import Final

import msgspec

from swarm.geometry import Pose, distance
from swarm.messages import Activity, Command, Message
from swarm.scenario.load import Scenario
from world.bodies.roster import Roster
from world.bodies.shapes import Contact
from world.measure.clearance import ClearanceJudge
from world.measure.contact_cause import MOVES, Blame, stands
from world.measure.state import RecorderState

PARTED: Final = 1.0  # s; a contact that begins again sooner is still the same: bodies under pressure tremble
WAITING: Final = (Activity.GIVE_WAY, Activity.BLOCKED)


class Recorder:
    """The record of one run. The world feeds it tick by tick."""

    def __init__(self, scenario: Scenario, roster: Roster, starts: Sequence[Pose], dt: float) -> None:
        self._dt, self._roster = dt, roster
        self.judge = ClearanceJudge(scenario.map, roster.radii())
        self.counts = RecorderState(last=starts)
        self.blame = Blame(scenario.settings.movers, roster, self.counts, dt)
        for _ in starts:
            self._add_row()

    def add_robot(self, start: Pose) -> None:
        """Record one more robot of the roster from now on."""
        self.judge.set_radii(self._roster.radii())
        self.blame.add_robot(start)
        self.counts.last = [*self.counts.last, start]
        self._add_row()

    def _add_row(self) -> None:
        counts = self.counts
        counts.path_length.append(0.0)
        counts.contact_counts.append(Counter())
        counts.struck.append(0)
        counts.waiting.append(0.0)
        counts.standing.append(0.0)
        counts.waits_for.append({})

    @property
    def state(self) -> RecorderState:
        """The state, which shares its values with this object."""
        self.counts.smallest = self.judge.smallest
        return self.counts

    def restore(self, state: RecorderState) -> None:
        """Continue from a state."""
        self.counts = self.blame.state = state
        self.judge.restore(state.smallest)

    @property
    def digest(self) -> str:
        """A hash of every robot's pose at every tick and of all requests to robots: equal runs have equal digests."""
        return self.counts.digest.hex()

    @property
    def avoidable(self) -> int:
        """Number of contacts that a robot could have avoided by stopping; one of two robots counts once."""
        return len(
            {(tick, c.kind, frozenset((c.robot, c.other))) for tick, c, avoidable in self.counts.begun if avoidable}
        )

    def poses(self, poses: Sequence[Pose]) -> None:
        """Record the poses of all robots at a tick."""
        counts = self.counts
        counts.ticks += 1
        self._digest(struct.pack(f"<{3 * len(poses)}d", *chain.from_iterable(poses)))
        for number, (before, pose) in enumerate(zip(counts.last, poses, strict=True)):
            if pose != before:
                counts.path_length[number] += distance(before, pose)
        self.judge.observe(poses)
        counts.last = poses

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
        counts, kept = self.counts, PARTED / self._dt
        tick, seen = counts.ticks, counts.touched
        fresh = [c for c in contacts if c not in seen or tick - seen[c] >= kept]
        counts.touched |= dict.fromkeys((*contacts, *touching), tick)
        verdicts = self.blame.look(tick, fresh, touching, wheels, poses)
        for contact, avoidable in zip(fresh, verdicts, strict=True):
            counts.contact_counts[contact.robot][contact.kind] += 1
            counts.struck[contact.robot] += stands(wheels[contact.robot])
            counts.begun.append((tick, contact, avoidable))
        return fresh

    def request(self, robot: int, request: Message) -> None:
        """Record a request to a robot that has changed something."""
        self._digest(msgspec.msgpack.encode((robot, request)))

    def _digest(self, packed: bytes) -> None:
        self.counts.digest = hashlib.blake2b(self.counts.digest + packed, digest_size=16).digest()

    def record_activities(self, commands: Sequence[Command]) -> None:
        """Record what every robot did in a tick."""
        for number, command in enumerate(commands):
            if command.activity in WAITING:
                self.counts.waiting[number] += self._dt
                row = self.counts.waits_for[number]
                for other in set(command.waits):
                    row[other] = row.get(other, 0.0) + self._dt

    def record_standing(self, stops: Sequence[int | None], wheels: Sequence[tuple[float, float]]) -> None:
        """Record who stood in a tick with a stop left, by the rim speeds [m/s]; it does not depend on what they say."""
        for number, (stop, (left, right)) in enumerate(zip(stops, wheels, strict=True)):
            if stop is not None and abs(left) <= MOVES and abs(right) <= MOVES:
                self.counts.standing[number] += self._dt
