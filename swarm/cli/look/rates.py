"""What a tap has heard, as numbers: rates, sizes, ages and gaps. No I/O and no clock: times are passed in."""

from collections import deque
from dataclasses import dataclass
from itertools import pairwise
from math import sqrt
from typing import Any, Final, NamedTuple

from swarm.bus.tap import Sample
from swarm.messages import REPLIES, TOPICS, Topic
from swarm.secure.access import RIGHTS, ROBOT

UNKNOWN: Final = "?"  # the sender on a key that is in no row of the table of topics
WINDOW: Final = 1000  # newest samples of which `swarm hz` takes its numbers


def topic_of(key: str) -> Topic[Any] | None:
    """Return the row of the table of topics to which a key below the fleet's belongs.

    >>> topic_of("robot/r1/state").message.__name__, topic_of("robot/r1/nothing")
    ('State', None)
    """
    chunks = key.split("/")
    for topic in TOPICS:
        names = topic.key.split("/")
        if len(names) == len(chunks) and all(a == b or a[0] == "{" for a, b in zip(names, chunks, strict=True)):
            return topic
    return None


def sender(key: str) -> str:
    """Return who sends on a key: the robot that it names, or the role that may, by the table of rights.

    >>> sender("robot/r1/state"), sender("robot/r1/sense"), sender("robot/r1/nothing"), sender("world/events")
    ('r1', 'world', '?', 'world')
    """
    topic = topic_of(key)
    for role, rights in RIGHTS.items():
        if topic in rights.sends:
            return key.split("/")[topic.key.split("/").index("{robot}")] if role == ROBOT and topic else role
    asked = topic is None or topic.key in REPLIES
    return UNKNOWN if asked else next(role for role, rights in RIGHTS.items() if topic in rights.answers)


def format_dropped_samples(dropped: int) -> str:
    """Return what to tell people when a tap has dropped samples."""
    return (
        f"{dropped} messages came faster than this tool takes them: all rates are too low; "
        "`swarm hz` with one key listens to less"
    )


class KeyRow(NamedTuple):
    """One key of `swarm topics`."""

    key: str
    rate: float  # Hz
    usual: float | None  # Hz, by the table of topics; 0: on change; None: the key is in no row of it
    size: float  # bytes of a message, mean
    bytes: float  # bytes/s
    age: float | None  # s, since the newest message; None: none has come, and the last one is kept
    lost: int  # messages, by the gaps between their numbers
    who: str


@dataclass(slots=True)
class KeyHeard:
    """What was heard on one key."""

    messages: int = 0
    bytes: int = 0
    newest: float = 0.0  # s
    lost: int = 0


class KeyTraffic:
    """The messages of all keys since a time."""

    def __init__(self, since: float) -> None:
        self._since = since
        self._heard: dict[str, KeyHeard] = {}
        self._kept: dict[str, KeyRow] = {}

    def take(self, sample: Sample) -> None:
        """Count a sample."""
        heard = self._heard.setdefault(sample.key, KeyHeard())
        heard.messages += 1
        heard.bytes += len(sample.payload)
        heard.newest = sample.at
        heard.lost += sample.lost

    def keep(self, sample: Sample) -> None:
        """Note the last message that is kept on a key; it has not come now."""
        self._kept[sample.key] = KeyRow(
            sample.key, 0.0, _usual(sample.key), len(sample.payload), 0.0, None, 0, sender(sample.key)
        )

    def rows(self, now: float) -> list[KeyRow]:
        """Return a row for each key, by name; rates are means since the beginning."""
        lasted = max(now - self._since, 1e-9)
        heard = {
            key: KeyRow(
                key,
                heard.messages / lasted,
                _usual(key),
                heard.bytes / heard.messages,
                heard.bytes / lasted,
                now - heard.newest,
                heard.lost,
                sender(key),
            )
            for key, heard in self._heard.items()
        }
        return [row for _, row in sorted((self._kept | heard).items())]


def _usual(key: str) -> float | None:
    topic = topic_of(key)
    return None if topic is None else topic.rate


class Pace(NamedTuple):
    """The numbers of `swarm hz`, of the newest messages."""

    messages: int
    rate: float  # Hz
    bytes: float  # bytes/s
    gap_min: float  # s, between two messages
    gap_max: float  # s
    gap_deviation: float  # s, standard deviation
    lost: int  # messages since the beginning, by the gaps between their numbers


class Beat:
    """The times and sizes of the newest messages on a key."""

    def __init__(self, window: int = WINDOW) -> None:
        self._newest: deque[tuple[float, int]] = deque(maxlen=window)
        self._lost = 0

    def take(self, sample: Sample) -> None:
        """Count a sample."""
        self._newest.append((sample.at, len(sample.payload)))
        self._lost += sample.lost

    def pace(self) -> Pace | None:
        """Return the numbers, or None before two messages have come at different times."""
        times = [at for at, _ in self._newest]
        if len(times) < 2 or times[-1] <= times[0]:
            return None
        gaps = [after - before for before, after in pairwise(times)]
        lasted = times[-1] - times[0]
        mean = lasted / len(gaps)
        return Pace(
            messages=len(times),
            rate=len(gaps) / lasted,
            bytes=sum(size for _, size in list(self._newest)[1:]) / lasted,
            gap_min=min(gaps),
            gap_max=max(gaps),
            gap_deviation=sqrt(sum((gap - mean) ** 2 for gap in gaps) / len(gaps)),
            lost=self._lost,
        )
