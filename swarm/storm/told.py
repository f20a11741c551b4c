"""What each robot of a recorded run has been told of each other one, over the radio or by who passed it on."""

from collections import deque

from swarm.messages import Broadcast
from swarm.messages.traffic import Record
from swarm.storm.history import History, Moment


class Told:
    """The newest record of each robot that reached each other one. Feed it every moment, in order."""

    def __init__(self, history: History) -> None:
        self._newest: dict[tuple[str, str], Record] = {}
        self._air: deque[dict[str, Broadcast]] = deque([{}] * (history.late + 1))  # words under way, oldest first
        self._coming = iter(history.moments)
        self._tick = -1  # up to which all was heard

    def hear_until(self, tick: int) -> None:
        """Take in all that arrives up to a tick, for who asks only now and then."""
        while self._tick < tick:
            moment = next(self._coming)
            self._tick = moment.tick
            self.hear(moment)

    def hear(self, moment: Moment) -> None:
        """Take in what arrives at a tick; who is silent hears nothing."""
        arriving = {sender: _records(words) for sender, words in self._air.popleft().items()}
        self._air.append(dict(moment.spoken))
        for name in moment.commands:
            for sender, _ in moment.senses[name].hears:
                for record in arriving.get(sender, ()):
                    known = self._newest.get((name, record.robot))
                    if known is None or record.stamp > known.stamp:
                        self._newest[name, record.robot] = record

    def forget(self, listener: str) -> None:
        """Drop what a robot was told: a new process takes its place."""
        self._newest = {pair: record for pair, record in self._newest.items() if pair[0] != listener}

    def of(self, listener: str) -> dict[str, Record]:
        """Return the newest records of the others that a robot was told."""
        return {robot: record for (name, robot), record in self._newest.items() if name == listener != robot}

    def cells(self, listener: str, robot: str) -> frozenset[int]:
        """Return the cells that a robot holds or claims, as far as ``listener`` was told."""
        record = self._newest.get((listener, robot))
        return frozenset((*record.held, *(claim.cell for claim in record.claims)) if record is not None else ())

    def way(self, listener: str, robot: str) -> frozenset[int]:
        """Return the cells that a robot holds, claims or will claim, as far as ``listener`` was told."""
        record = self._newest.get((listener, robot))
        return self.cells(listener, robot).union(record.ahead if record is not None else ())


def _records(words: Broadcast) -> tuple[Record, ...]:
    traffic = words.traffic
    return (traffic.own, *[relayed.record for relayed in traffic.others]) if traffic is not None else ()
