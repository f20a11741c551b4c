"""Following a joint plan: whose turn it is, and how long the robot stays in it."""

from collections.abc import Collection, Mapping
from typing import Final, NamedTuple

from swarm.messages.traffic import Entry, Epoch, JointPlan, Record
from swarm.traffic.route_progress import RouteProgress
from swarm.traffic.situation import Situation

SETTLE: Final = 20  # ticks after which a member that shows no sign of the plan is taken to go without it


class Following(NamedTuple):
    """The joint plan that a robot follows."""

    me: str
    plan: JointPlan
    members: tuple[str, ...]  # all that have a part in it
    adopted: int  # tick
    absent: int  # ticks of silence for which a member keeps its turns
    entries: Mapping[int, Entry]  # by the steps of my way

    @property
    def epoch(self) -> Epoch:
        """The plan's name."""
        return self.plan.epoch

    def keeps(self, progress: RouteProgress, situation: Situation) -> bool:
        """Return True if a progress still has to follow the plan, or to stay where the plan has led."""
        if progress.route or progress.head == situation.goal:
            return True
        if self.makes_room(situation, under_way=len(progress.reservations.held) > 1):
            return True
        if self.first_at(situation.goal, situation.fresh) is not None:
            return True
        # it was sent aside: to turn back before it has left would make room for nobody
        return self.is_waited_for(progress.reservations.held[:-1], situation)

    def waits_for(self, step: int, situation: Situation) -> str | None:
        """Name the robot that must first leave the ``step``-th cell of the way, if it has not."""
        entry = self.entries.get(step)
        if entry is None:
            return None
        record = situation.others.get(entry.robot)
        if record is None or situation.tick - record.stamp > self.absent:
            return None  # silent or out of reach: the holds alone decide
        if record.epoch == self.epoch:
            return None if record.left > entry.place else entry.robot
        return entry.robot if self._about_to_follow(record) else None

    def next_after(self, step: int, situation: Situation) -> bool:
        """Return True if the robot waited for is in that very visit now, so that nobody else comes in between."""
        entry = self.entries[step]
        record = situation.fresh.get(entry.robot)
        return record is not None and record.epoch == self.epoch and record.left <= entry.place <= record.entered

    def first_at(self, cell: int, fresh: Mapping[str, Record]) -> str | None:
        """Name the member, still following, whose way ends in a cell it is not just put into: it has the first turn."""
        for robot in self.members:
            record = fresh.get(robot) if self.plan.ways[robot][-1] == cell and robot != self.me else None
            if record is None or record.idle or record.goal != cell:
                continue  # it was only put there, or has been there: it wants to be elsewhere now
            if record.epoch == self.epoch or self._about_to_follow(record):
                return robot
        return None

    def makes_room(self, situation: Situation, *, under_way: bool) -> bool:
        """Return True if the plan is for some only, and one of them has still to arrive, or this robot to make room."""
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
        """Return True if a member may not have adopted the plan yet when it said this."""
        if record.epoch is not None and record.epoch > self.epoch:
            return False
        return record.stamp <= self.adopted + SETTLE or record.frozen == self.epoch
