"""Following a joint plan: whose turn it is, and how long the robot stays in it."""

from collections.abc import Collection, Mapping
from typing import Final, NamedTuple

from swarm.messages.traffic import Entry, Epoch, JointPlan, Record
from swarm.traffic.peers.situation import Situation
from swarm.traffic.reservations.route import RouteProgress

SETTLE: Final = 20  # ticks after which a member that shows no sign of the plan is taken not to follow it


class Following(NamedTuple):
    """The joint plan that a robot follows."""

    me: str
    plan: JointPlan
    members: tuple[str, ...]  # all that take part in it
    adopted: int  # tick
    absent: int  # ticks of silence for which a member keeps its turns
    entries: Mapping[int, Entry]  # by the steps of my way

    @property
    def epoch(self) -> Epoch:
        """The plan's name."""
        return self.plan.epoch

    def keeps(self, progress: RouteProgress, situation: Situation) -> bool:
        """Return True if the robot still has to follow the plan, or to stay where the plan has led it."""
        if progress.route or progress.head == situation.goal:
            return True
        if self.makes_room(situation, under_way=len(progress.reservations.held) > 1):
            return True
        if self.first_at(situation.goal, situation.fresh) is not None:
            return True
        # it was sent aside: it makes no room if it turns back before it has left its cells
        return self.is_waited_for(progress.reservations.held[:-1], situation)

    def waits_for(self, step: int, situation: Situation) -> str | None:
        """Return the robot that must leave the ``step``-th cell of the way before this one enters it, else None."""
        entry = self.entries.get(step)
        if entry is None:
            return None
        record = situation.others.get(entry.robot)
        if record is None or situation.tick - record.stamp > self.absent:
            return None  # silent or out of reach: the reservations alone decide
        if record.epoch == self.epoch:
            return None if record.left > entry.place else entry.robot
        return entry.robot if self._about_to_follow(record) else None

    def next_after(self, step: int, situation: Situation) -> bool:
        """Return True if the robot waited for is in that very visit now: no other robot can come in between."""
        entry = self.entries[step]
        record = situation.fresh.get(entry.robot)
        return record is not None and record.epoch == self.epoch and record.left <= entry.place <= record.entered

    def first_at(self, cell: int, fresh: Mapping[str, Record]) -> str | None:
        """Return the member with the first turn in a cell: it still follows, and its way ends there, at its goal.

        One that is done and has arrived is not waited for: it never leaves by itself, only by another plan.
        """
        for robot in self.members:
            record = fresh.get(robot) if self.plan.ways[robot][-1] == cell and robot != self.me else None
            if record is None or record.idle or record.goal != cell:
                continue  # it was only sent there, or has been there already: its goal is elsewhere now
            if record.done and record.epoch == self.epoch and record.left >= len(self.plan.ways[robot]) - 1:
                continue
            if record.epoch == self.epoch or self._about_to_follow(record):
                return robot
        return None

    def makes_room(self, situation: Situation, *, under_way: bool) -> bool:
        """Return True if the robot still has to make room for others, in a plan that is for some members only.

        It has to while it is under way itself, or while one of those members has not arrived.
        """
        if not self.plan.until:
            return False
        if under_way:
            return True
        for robot in self.plan.until:
            record = situation.fresh.get(robot) if robot != self.me else None
            if record is None:
                continue
            if record.epoch == self.epoch and record.left < len(self.plan.ways[robot]) - 1:
                return True
            if record.epoch != self.epoch and self._about_to_follow(record):
                return True
        return False

    def is_waited_for(self, leaves: Collection[int], situation: Situation) -> bool:
        """Return True if a member has claimed a cell that this robot is about to leave."""
        return any(
            robot in self.plan.ways and any(claim.cell in leaves for claim in record.claims)
            for robot, record in situation.fresh.items()
        )

    def _about_to_follow(self, record: Record) -> bool:
        """Return True if a member may not have adopted the plan yet when it sent this record."""
        if record.epoch is not None and record.epoch > self.epoch:
            return False
        return record.stamp <= self.adopted + SETTLE or record.frozen == self.epoch
