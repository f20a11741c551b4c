"""Why no message comes on a key: what a person who listens there has to know. Pure: no I/O and no clock."""

from collections.abc import Sequence
from typing import Final

from swarm.cli.look.rates import topic_of
from swarm.errors import suggest
from swarm.messages import REPLIES, TOPICS, Clock, Phase

STANDS: Final = {
    Phase.WAITING: "the fleet waits, for its robots or for `swarm go`",
    Phase.PAUSED: "the run is paused",
    Phase.OVER: "the run is over",
}
SOME: Final = ("r1",)  # robots of a fleet that does not answer


def why(key: str, clock: Clock | None) -> str:
    """Return why nothing comes on a key below the fleet's; ``clock`` is the world's, None if it does not answer.

    >>> why("world/evnt", None)
    "it is in no row of the table of topics; did you mean 'world/event'?"
    >>> why("robot/r1/order", None)
    'it takes requests, and nobody publishes on it'
    """
    robots, topic = SOME if clock is None else clock.robots, topic_of(key)
    if "*" in key:
        if not any(keys_overlap(key, known) for known in list_keys(robots)):
            return "it stands for no key of the table of topics"
    elif topic is None:
        return f"it is in no row of the table of topics{_suggest_key(key, robots)}"
    elif topic.key in REPLIES:
        return "it takes requests, and nobody publishes on it"
    elif clock is not None and "{robot}" in topic.key:
        named = key.split("/")[topic.key.split("/").index("{robot}")]
        if named not in robots:
            return f"the fleet has no robot {named!r}; {suggest(named, robots)}"
    if clock is None:
        return "the fleet has no world that answers"
    on_change = topic is not None and topic.rate == 0.0
    return STANDS.get(clock.phase, "it comes on change only" if on_change else "nobody has sent one")


def list_keys(robots: Sequence[str]) -> list[str]:
    """Return the keys of a fleet with these robots, by the table of topics; its squares of the floor stay wild.

    >>> [key for key in list_keys(["r1"]) if key.startswith(("radio", "world/e"))]
    ['radio/*/*/r1', 'world/event', 'world/events', 'world/edit']
    """
    return list(dict.fromkeys(topic.key.format(robot=robot, zx="*", zy="*") for topic in TOPICS for robot in robots))


def keys_overlap(key: str, known: str) -> bool:
    """Return True if two keys with wildcards have a key in common, as far as whole chunks go.

    >>> keys_overlap("robot/*/state", "robot/r1/state"), keys_overlap("world/*", "world")
    (True, False)
    """
    return _match(key.split("/"), known.split("/"))


def _match(one: Sequence[str], other: Sequence[str]) -> bool:
    if not one or not other:
        return all(chunk == "**" for chunk in (*one, *other))
    if one[0] == "**":
        return _match(one[1:], other) or _match(one, other[1:])
    same = one[0] == other[0] or "*" in one[0] or "*" in other[0]
    return same and _match(one[1:], other[1:])


def _suggest_key(key: str, robots: Sequence[str]) -> str:
    """Return a clause with the key that is probably meant; "" if none is like it."""
    known = list_keys(robots)
    ends = [one for one in known if one.rsplit("/", 1)[-1] == key.strip("/").rsplit("/", 1)[-1]]
    said = suggest(key, ends or known)
    if said.startswith("did you mean"):
        return f"; {said}"
    return f"; did you mean {ends[0]!r}?" if ends else ""
