"""The laws of the wire: processes would accept what robots say, and who is in reach of a broadcast hears it."""

from collections import Counter
from math import sqrt
from typing import Any, Final

from swarm.bus.codec import decode, encode
from swarm.errors import PeerError
from swarm.geometry import distance
from swarm.messages import COMMAND, RADIO, Message, Topic
from swarm.storm.history.history import History
from swarm.storm.history.run_facts import EXACT, Found

COMMANDS: Final = 4  # ticks between two commands of one robot that are looked at
BROADCASTS: Final = 20  # the same of broadcasts: they are long
UNLIKELY: Final = 5.0  # standard deviations by which the share of lost broadcasts may be off


def passes_the_wire(history: History) -> Found:
    """Check that commands and broadcasts pass the codec; not all of them are looked at, but each robot's in turn."""
    for moment in history.moments:
        for number, name in enumerate(history.robots):
            said: list[tuple[Topic[Any], Message | None]] = []
            if (moment.tick + number) % COMMANDS == 0:
                said.append((COMMAND, moment.commands.get(name)))
            if (moment.tick // COMMANDS + number) % (BROADCASTS // COMMANDS) == 0:
                said.append((RADIO, moment.spoken.get(name)))
            for topic, message in said:
                if message is not None and (fault := _refusal(topic, message)):
                    yield moment.tick, (name,), f"{topic.key}: {fault}"


def broadcasts_are_heard(history: History) -> Found:
    """Check that each broadcast is heard once, as what it was, by each robot in reach, but for losses that are drawn.

    In reach is who is within the radio's range from the tick of the broadcast until the last at which it can arrive.
    With loss, only the share of what was heard is held against the drawn one.
    """
    radio, last = history.settings.radio, len(history.moments) - 1
    heard = Counter(
        (name, *pair) for moment in history.moments for name, sense in moment.senses.items() for pair in sense.hears
    )
    said = {(name, moment.tick) for moment in history.moments for name in moment.spoken}
    for name, sender, tick in heard:
        if (sender, tick) not in said or heard[name, sender, tick] > 1:
            yield tick, (name, sender), f"{name} hears {sender} as of a tick at which it sent nothing, or twice"
    if radio.line_of_sight:
        return  # walls stop some of them
    expected = missed = 0
    for sender, tick in sorted(said, key=lambda pair: pair[1]):
        way = history.moments[tick : tick + history.late + 2]
        if not all(moment.senses for moment in way):
            continue  # the run ended before all of them could sense it
        number, poses = history.robots.index(sender), [moment.poses for moment in way]
        for listener, name in enumerate(history.robots):
            if listener == number or any(distance(at[listener], at[number]) > radio.range - EXACT for at in poses):
                continue
            expected += 1
            if (name, sender, tick) not in heard:
                missed += 1
                if not radio.loss:
                    yield tick, (name, sender), f"{name} did not hear the broadcast of {sender}, though it was in reach"
    spread = UNLIKELY * sqrt(expected * radio.loss * (1.0 - radio.loss)) + 1.0
    if radio.loss and abs(missed - expected * radio.loss) > spread:
        share = f"{missed} of {expected} broadcasts in reach were not heard, with a loss of {radio.loss:g}"
        yield last, (), share


def _refusal(topic: Topic[Any], message: Message) -> str:
    """Return why a receiver would drop a message; nothing where it would not."""
    try:
        decode(encode(message), topic.message, topic.limit)
    except PeerError as fault:
        return str(fault)
    return ""
