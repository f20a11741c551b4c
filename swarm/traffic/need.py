"""When a robot asks for a joint plan: its way is shut by somebody who will not open it without one."""

from swarm.traffic.joint import JointPlanning
from swarm.traffic.record import Record
from swarm.traffic.settings import TrafficSettings
from swarm.traffic.situation import Situation

AT_REST = 20  # ticks somebody has stood at its goal before it counts as resting there


class Needs:
    """The reasons, judged each time the robot broadcasts."""

    def __init__(self, me: str, settings: TrafficSettings) -> None:
        self.me = me
        self._settings = settings

    def joint_plan(self, own: Record, situation: Situation, joint: JointPlanning) -> str | None:
        """Give the reason for a joint plan, if there is one."""
        if not own.ahead:
            return None
        if situation.tick - joint.adopted < self._settings.calm:
            return None
        strangers = [
            robot for robot in own.waits if robot in situation.fresh and not self._same_plan(robot, own, situation)
        ]
        for robot in strangers:
            record = situation.fresh[robot]
            if record.frozen is not None:
                continue
            if own.ahead[0] in record.held and self._rests(record, situation.tick):
                return "rest"
            if record.ahead and own.ahead[0] in record.held and record.ahead[0] in own.held:
                return "head-on"
            if self._circle(own, robot, situation):
                return "circle"
        if joint.epoch is None:
            return "stuck" if own.waits and situation.tick - own.moved > self._patience(own, situation) else None
        return "plan stuck" if self._plan_stands(own, situation) else None

    def _patience(self, own: Record, situation: Situation) -> int:
        """Return how long to stand before it is stuck [ticks]: where all waited for are silent, until it has looked.

        No plan makes a dead robot move; but a look may show that the cell which it keeps is empty.
        """
        looks = not any(robot in situation.fresh for robot in own.waits)
        return self._settings.stuck + (self._settings.surmise if looks else 0)

    @staticmethod
    def _same_plan(robot: str, own: Record, situation: Situation) -> bool:
        return own.epoch is not None and situation.fresh[robot].epoch == own.epoch

    def _rests(self, record: Record, tick: int) -> bool:
        """Return True if a robot stands where it wants to be; one that has stops left may go on by itself soon."""
        lasts = AT_REST if record.done or record.idle else self._settings.stuck
        return not record.ahead and not record.claims and tick - record.moved > lasts

    def _circle(self, own: Record, robot: str, situation: Situation) -> bool:
        """Follow who waits for whom from ``robot`` on: does it come back to me?"""
        seen, front = {robot}, [robot]
        while front:
            record = situation.fresh.get(front.pop())
            for other in record.waits if record is not None else ():
                if other == self.me:
                    return True
                if other not in seen:
                    seen.add(other)
                    front.append(other)
        return False

    def _plan_stands(self, own: Record, situation: Situation) -> bool:
        """Tell whether I have waited long and nobody of my plan, as far as I hear, has got on."""
        limit = situation.tick - self._settings.plan_stuck
        members = [record for record in situation.fresh.values() if record.epoch == own.epoch]
        return own.moved < limit and all(record.moved < limit for record in members)
