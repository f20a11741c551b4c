"""What was said, heard and answered in a run up to a tick: what an explanation needs beside the state at the tick."""

from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from enum import StrEnum
from typing import Final, NamedTuple

from swarm.geometry import Pose, distance
from swarm.maps.occupancy import Point
from swarm.messages import Broadcast, Command, Sense
from swarm.settings import RadioSettings
from world.host.last_messages import Sent

BREAK: Final = 20  # ticks; a robot that was away for longer listens first (`gap` of traffic's constants)
KEPT: Final = 1200  # ticks, a minute: what is said again and again is in them, and a long run needs no more memory


class DatedNote(NamedTuple):
    """What a robot noted in one of its answers."""

    tick: int
    kind: str
    text: str


class TakenAnswer(NamedTuple):
    """An answer of a robot, as it came to the world."""

    robot: str
    command: Command
    heard: Sequence[Sent]  # broadcasts that it stepped with
    broadcast: Broadcast | None


class Next(NamedTuple):
    """What a robot does after a tick, by the tape of its run."""

    came: int | None  # tick in which its next answer comes; None: it does not answer again on the tape
    sensed: int = -1  # tick of the sense that this is the answer to
    new: bool = False  # of a process without memory


class Missed(StrEnum):
    """Why a robot has not heard a broadcast."""

    LOST = "lost by the radio"
    FAR = "out of range"
    HIDDEN = "behind a wall"
    UNDER_WAY = "still on its way through the network"


def _in_sight(here: Point, there: Point) -> bool:
    return True


class RecentPast:
    """The last minute of one run. Feed it every tick, in order; a world that was killed may go back to earlier ones."""

    def __init__(self, radio: RadioSettings, rate: float, sees: Callable[[Point, Point], bool] = _in_sight) -> None:
        self._radio, self._sees, self.rate = radio, sees, rate
        self.tick = -1  # the last one taken in
        self.commands: dict[str, Command] = {}  # the last answer of each robot
        self.came: dict[str, int] = {}  # tick in which it came
        self.since: dict[str, int] = {}  # first tick of the unbroken answers of each robot
        self.senses: Mapping[str, Sense] = {}  # of the last tick
        self.notes: dict[str, dict[str, DatedNote]] = defaultdict(dict)  # of each robot, the last one of each kind
        self.said: dict[str, list[Broadcast]] = defaultdict(list)  # of each robot, oldest first
        self.words: dict[Sent, Broadcast] = {}  # all that was said
        self._sent: dict[Sent, int] = {}  # tick in which a broadcast was on the air
        self._listed: dict[str, set[Sent]] = defaultdict(set)  # of each robot: what its senses say that it hears
        self._heard: dict[str, dict[Sent, int]] = defaultdict(dict)  # of each robot: broadcast, and when it was heard
        self._stood: dict[int, Mapping[str, Pose]] = {}  # by tick

    def take(
        self, tick: int, senses: Mapping[str, Sense], answers: Iterable[TakenAnswer], joined: Iterable[str] = ()
    ) -> None:
        """Take in a tick: what was sensed, answered and said in it, and which robots have ``joined`` without memory."""
        self._stood[tick] = {name: Pose(sense.x, sense.y, sense.yaw) for name, sense in senses.items()}
        self.senses = senses
        for name, sense in senses.items():
            self._listed[name].update(sense.hears)
        if tick <= self.tick:  # the world was started again: the answers of its first life do not count
            self.came.clear()
        for name in joined:
            self.since.pop(name, None)
            self.came.pop(name, None)
            self._heard[name].clear()
        for name, command, heard, words in answers:
            if name not in self.since or tick - self.came.get(name, tick) > BREAK:
                self.since[name] = tick
            self.commands[name], self.came[name] = command, tick
            for pair in heard:
                self._heard[name].setdefault(pair, tick)
            for kind, text in command.notes:
                self.notes[name][kind] = DatedNote(tick, kind, text)
            if words is not None and (name, words.tick) not in self.words:
                self.said[name].append(words)
                self.words[name, words.tick] = words
                self._sent[name, words.tick] = tick
        self.tick = tick
        if tick % (KEPT // 4) == 0:
            self._forget(tick - KEPT)

    def _forget(self, before: int) -> None:
        """Drop what was on the air before a tick."""
        self._stood = {tick: stood for tick, stood in self._stood.items() if tick >= before}
        for name, row in self.said.items():
            self.said[name] = [one for one in row if one.tick >= before] or row[-1:]  # the last one in any case
        self.words = {(words.robot, words.tick): words for row in self.said.values() for words in row}
        self._sent = {pair: self._sent[pair] for pair in self.words}
        for name, pairs in self._listed.items():
            self._listed[name] = {pair for pair in pairs if pair[1] >= before}
        for name, heard in self._heard.items():
            self._heard[name] = {pair: tick for pair, tick in heard.items() if pair[1] >= before}

    def clock(self, tick: int) -> str:
        """Return a tick as the time of the run.

        >>> RecentPast(RadioSettings(), 20.0).clock(241)
        '12.05 s'
        """
        return f"{tick / self.rate:.2f} s"

    def trail(self, name: str, ticks: int) -> list[Point]:
        """Return where a robot was in the last ticks [m], the oldest first."""
        stood = [self._stood.get(tick, {}) for tick in range(self.tick - ticks, self.tick + 1)]
        return [poses[name][:2] for poses in stood if name in poses]

    def answers(self, name: str) -> bool:
        """Return True if an answer of a robot came in the last tick."""
        return self.came.get(name, -1) == self.tick

    def has_heard(self, name: str, words: Broadcast) -> bool:
        """Return True if a robot has heard a broadcast, or a record at least as new of its sender, relayed."""
        heard = self._heard[name]
        if (words.robot, words.tick) in heard:
            return True
        later = (self.words[pair].traffic for pair in heard if pair[1] >= words.tick and pair in self.words)
        return any(
            relayed.record.robot == words.robot and relayed.record.stamp >= words.tick
            for traffic in later
            if traffic is not None
            for relayed in traffic.others
        )

    def broadcasts_heard(self, name: str, tick: int) -> list[Sent]:
        """Return the broadcasts that a robot heard first at a tick."""
        return [pair for pair, when in self._heard[name].items() if when == tick]

    def broadcasts_unheard(self, name: str, row: Iterable[Broadcast]) -> list[Broadcast]:
        """Return the broadcasts that a robot could have heard by now, and has not."""
        return [
            words for words in row
            if name in self.commands and self._sent[words.robot, words.tick] < self.commands[name].tick
            and not self.has_heard(name, words)
        ]  # fmt: skip

    def why_missed(self, name: str, words: Broadcast) -> Missed:
        """Return why a robot has not heard a broadcast."""
        pair = words.robot, words.tick
        if pair in self._listed[name]:
            return Missed.UNDER_WAY
        stood = self._stood.get(self._sent[pair], {})
        if name not in stood or words.robot not in stood:
            return Missed.LOST
        here, there = stood[name], stood[words.robot]
        if distance(here, there) > self._radio.range:
            return Missed.FAR
        return Missed.HIDDEN if self._radio.line_of_sight and not self._sees(here[:2], there[:2]) else Missed.LOST
