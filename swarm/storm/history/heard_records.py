"""What each robot of a recorded run has heard about each other robot, directly or relayed by others."""

from swarm.messages import Broadcast
from swarm.messages.traffic import Epoch, JointPlan, Record
from swarm.storm.history.history import History, Moment


class Told:
    """The newest record of each robot that each other robot has heard. Feed it every moment, in order."""

    def __init__(self, history: History) -> None:
        self._newest: dict[tuple[str, str], Record] = {}
        self._plans: dict[tuple[str, Epoch], JointPlan] = {}  # by who was told
        self._late = history.late
        self._said: dict[tuple[str, int], tuple[Record, ...]] = {}  # lately, by who said it at which tick
        self._coming = iter(history.moments)
        self._tick = -1  # all broadcasts up to this tick are heard

    def hear_until(self, tick: int) -> None:
        """Take in everything that arrives up to a tick, for a caller that does not call ``hear`` at every tick."""
        while self._tick < tick:
            moment = next(self._coming)
            self._tick = moment.tick
            self.hear(moment)

    def hear(self, moment: Moment) -> None:
        """Take in what arrives at a tick; a silent robot hears nothing."""
        for name in moment.commands:
            for pair in moment.senses[name].hears:
                for record in self._said.get(pair, ()):
                    known = self._newest.get((name, record.robot))
                    if record.plan is not None:
                        self._plans[name, record.plan.epoch] = record.plan
                    if known is None or record.stamp > known.stamp:
                        self._newest[name, record.robot] = record
        oldest = moment.tick - self._late - 1
        self._said = {pair: said for pair, said in self._said.items() if pair[1] >= oldest}
        self._said |= {(name, words.tick): _records(words) for name, words in moment.spoken.items()}

    def forget(self, listener: str) -> None:
        """Drop everything that a robot has heard, because a new process takes its place."""
        self._newest = {pair: record for pair, record in self._newest.items() if pair[0] != listener}

    def newest_records(self, listener: str) -> dict[str, Record]:
        """Return the newest record of each other robot that a robot has heard."""
        return {robot: record for (name, robot), record in self._newest.items() if name == listener != robot}

    def cells(self, listener: str, robot: str) -> frozenset[int]:
        """Return the cells that a robot holds or claims, as far as ``listener`` has heard."""
        record = self._newest.get((listener, robot))
        return frozenset((*record.held, *(claim.cell for claim in record.claims)) if record is not None else ())

    def way(self, listener: str, robot: str) -> frozenset[int]:
        """Return the cells that a robot holds, claims or will claim, as far as ``listener`` has heard.

        This includes its whole way in the joint plan that it follows: a member that falls silent keeps its turns.
        """
        record = self._newest.get((listener, robot))
        if record is None:
            return frozenset()
        plan = self._plans.get((listener, record.epoch)) if record.epoch is not None else None
        return self.cells(listener, robot).union(record.ahead, plan.ways.get(robot, ()) if plan is not None else ())


def _records(words: Broadcast) -> tuple[Record, ...]:
    traffic = words.traffic
    return (traffic.own, *[relayed.record for relayed in traffic.others]) if traffic is not None else ()
