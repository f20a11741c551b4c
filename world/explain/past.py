"""What was said, heard and answered in a run up to a tick: what an explanation needs beside the state at the tick."""

from collections import defaultdict
from collections.abc import Iterable, Mapping
from typing import NamedTuple

from swarm.geometry import Pose, distance
from swarm.messages import Broadcast, Command, Sense
from swarm.settings import RadioSettings

Pair = tuple[str, int]  # a robot and the tick of its broadcast


class Note(NamedTuple):
    """What a robot noted in one of its answers."""

    tick: int
    kind: str
    text: str


class Past:
    """The past of one run. Feed it every tick, in order."""

    def __init__(self, radio: RadioSettings, rate: float) -> None:
        self._radio, self._rate = radio, rate
        self.tick = -1  # the last one taken in
        self.commands: dict[str, Command] = {}  # the last answer of each robot
        self.since: dict[str, int] = {}  # first tick of the unbroken answers of each robot
        self.senses: Mapping[str, Sense] = {}  # of the last tick
        self.notes: dict[str, dict[str, Note]] = defaultdict(dict)  # of each robot, the last one of each kind
        self.said: dict[str, list[Broadcast]] = defaultdict(list)  # of each robot, oldest first
        self._words: dict[Pair, Broadcast] = {}
        self._heard: dict[str, dict[Pair, int]] = defaultdict(dict)  # of each robot: broadcast, and when it was heard
        self._stood: list[Mapping[str, Pose]] = []  # at each tick

    def take(
        self,
        tick: int,
        senses: Mapping[str, Sense],
        commands: Mapping[str, Command],
        spoken: Mapping[str, Broadcast],
        heard: Mapping[str, Iterable[Pair]],
    ) -> None:
        """Take in a tick: what was sensed, answered and said in it, and which broadcasts each robot had heard."""
        self._stood.append({name: Pose(sense.x, sense.y, sense.yaw) for name, sense in senses.items()})
        self.senses = senses
        for name, command in commands.items():
            if name not in self.commands or self.commands[name].tick != self.tick:
                self.since[name] = tick
            self.commands[name] = command
            for pair in heard[name]:
                self._heard[name].setdefault(pair, tick)
            for kind, text in command.notes:
                self.notes[name][kind] = Note(tick, kind, text)
        for name, words in spoken.items():
            self.said[name].append(words)
            self._words[name, words.tick] = words
        self.tick = tick

    def clock(self, tick: int) -> str:
        """Return a tick as the time of the run.

        >>> Past(RadioSettings(), 20.0).clock(241)
        '12.05 s'
        """
        return f"{tick / self._rate:.2f} s"

    def has_heard(self, name: str, words: Broadcast) -> bool:
        """Return True if a robot has heard a broadcast, or a record at least as new of its sender, relayed."""
        heard = self._heard[name]
        if (words.robot, words.tick) in heard:
            return True
        later = (self._words[pair].traffic for pair in heard if pair[1] >= words.tick and pair in self._words)
        return any(
            relayed.record.robot == words.robot and relayed.record.stamp >= words.tick
            for traffic in later
            if traffic is not None
            for relayed in traffic.others
        )

    def heard_at(self, name: str, tick: int) -> list[Pair]:
        """Return the broadcasts that a robot heard first at a tick."""
        return [pair for pair, when in self._heard[name].items() if when == tick]

    def unheard(self, name: str, row: Iterable[Broadcast]) -> list[Broadcast]:
        """Return the broadcasts that a robot could have heard by now, and has not."""
        return [words for words in row if words.tick < self.tick and not self.has_heard(name, words)]

    def is_far(self, name: str, words: Broadcast) -> bool:
        """Return True if a robot was out of the sender's radio range when that spoke."""
        here = self._stood[words.tick].get(name)
        return here is not None and distance(here, (words.x, words.y)) > self._radio.range
