"""What a robot tells the others: its own record."""

from collections.abc import Mapping

from swarm.messages.traffic import Moving, Record, Sighting
from swarm.traffic.doing import Doing
from swarm.traffic.reservations import Acks, Reservations, acknowledged
from swarm.traffic.settings import TrafficSettings


class Telling:
    """Writes one robot's record. ``slot`` is its place in the round of broadcasts."""

    def __init__(self, me: str, settings: TrafficSettings, slot: int) -> None:
        self.me = me
        self._settings = settings
        self._slot = slot
        self._agreed_for: tuple[Reservations, Mapping[str, Record]] | None = None  # what ``_agreed`` depends on
        self._agreed: Acks = ()  # claims of others that it acknowledges

    def is_due(self, tick: int, *, often: bool) -> bool:
        """Return True if it is this robot's turn to broadcast."""
        return (tick + self._slot) % (self._settings.often if often else self._settings.every) == 0

    def record(self, doing: Doing, seen: tuple[Sighting, ...], moving: tuple[Moving, ...]) -> Record:
        """Return the record, but without the robot that is asked to lead: this depends on the record itself."""
        inputs, progress, joint = doing.inputs, doing.progress, doing.joint
        return Record(
            robot=self.me,
            stamp=inputs.tick,
            x=inputs.pose.x,
            y=inputs.pose.y,
            goal=doing.goal.cell,
            idle=inputs.goal is None,
            done=inputs.done,
            wants=doing.goal.since,
            held=progress.reservations.held,
            claims=progress.reservations.all_claims,
            acks=self._acks(progress.reservations, doing.situation.others),
            ahead=progress.route[: self._settings.ahead],
            waits=doing.waits,
            moved=doing.moved,
            epoch=joint.epoch,
            left=progress.left if joint.epoch is not None else 0,
            entered=max(0, progress.steps[-1]) if joint.epoch is not None else 0,
            frozen=joint.frozen,
            collect=joint.collect,
            plan=joint.carried(inputs.tick),
            refusal=joint.refused(inputs.tick),
            listens=doing.listens,
            seen=seen,
            moving=moving,
        )

    def _acks(self, reservations: Reservations, others: Mapping[str, Record]) -> Acks:
        """Return the claims of others that this robot acknowledges, cached until reservations or records change."""
        if self._agreed_for is None or self._agreed_for[0] is not reservations or self._agreed_for[1] is not others:
            self._agreed_for = (reservations, others)
            self._agreed = acknowledged(self.me, reservations, others)
        return self._agreed
