"""The law of the wire: what robots say in one process must be what processes would accept of each other."""

from typing import Any, Final

from swarm.bus.codec import decode, encode
from swarm.errors import PeerError
from swarm.messages import COMMAND, RADIO, Message, Topic
from world.storm.history import History
from world.storm.seen import Found

COMMANDS: Final = 4  # ticks between two commands of one robot that are looked at
BROADCASTS: Final = 20  # the same of broadcasts: they are long


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


def _refusal(topic: Topic[Any], message: Message) -> str:
    """Return why a receiver would drop a message; nothing where it would not."""
    try:
        decode(encode(message), topic.message, topic.limit)
    except PeerError as fault:
        return str(fault)
    return ""
