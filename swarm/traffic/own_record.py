"""What a robot tells the others: its own record."""

from collections.abc import Mapping
from math import hypot
from typing import Final

from swarm.geometry import Pose
from swarm.messages.traffic import Moving, Record, Sighting
from swarm.traffic.reservations.rules import Acks, Reservations, acknowledged
from swarm.traffic.result import StepResult
from swarm.traffic.settings import TrafficConstants

SLACK: Final = 2.0  # m; the place of a robot whose newest record was not heard, for as long as it counts as fresh


class RecordWriter:
    """Writes one robot's record. ``slot`` is its place in the round of broadcasts, ``side`` [m] that of a cell."""

    def __init__(self, me: str, settings: TrafficConstants, slot: int, side: float) -> None:
        self.me = me
        self._settings = settings
        self._slot = slot
        self._answers = settings.asking_distance(side) + SLACK  # m

    def is_due(self, tick: int, *, often: bool) -> bool:
        """Return True if it is this robot's turn to broadcast."""
        return (tick + self._slot) % (self._settings.often if often else self._settings.every) == 0

    def record(self, result: StepResult, seen: tuple[Sighting, ...], moving: tuple[Moving, ...]) -> Record:
        """Return the record of what was decided."""
        inputs, situation, progress, joint = result.inputs, result.situation, result.progress, result.joint
        return Record(
            robot=self.me,
            stamp=inputs.tick,
            x=inputs.pose.x,
            y=inputs.pose.y,
            speed=inputs.speed,
            goal=result.goal.cell,
            idle=situation.idle,
            done=situation.done,
            wants=result.goal.since,
            held=progress.reservations.held,
            claims=progress.reservations.all_claims,
            acks=self._acks(progress.reservations, situation.others, inputs.pose),
            ahead=progress.route[: self._settings.ahead],
            waits=result.waits,
            moved=result.moved,
            epoch=joint.epoch,
            left=progress.left if joint.epoch is not None else 0,
            entered=max(0, progress.steps[-1]) if joint.epoch is not None else 0,
            frozen=joint.frozen,
            need=None if inputs.stands else joint.need,
            collect=joint.collect,
            plan=joint.carried(situation),
            refusal=joint.refused(inputs.tick),
            stands=inputs.stands,
            listens=result.listens,
            seen=seen,
            moving=moving,
        )

    def _acks(self, reservations: Reservations, others: Mapping[str, Record], pose: Pose) -> Acks:
        """Return the claims that this robot acknowledges, of all that may ask it: those far off ask others."""
        x, y, _ = pose
        near = {
            robot: record
            for robot, record in others.items()
            if record.claims and hypot(record.x - x, record.y - y) <= self._answers
        }
        return acknowledged(self.me, reservations, near)
