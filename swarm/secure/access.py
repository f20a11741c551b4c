"""The access list of a fleet's router: a table of what each role may do, in the form that Zenoh takes.

What is not listed is refused. Zenoh tells the refused process nothing: its message does not arrive.
"""

from collections.abc import Sequence
from typing import Any, Final, NamedTuple

from swarm.messages import (
    ACTION,
    BODY,
    CLOCK,
    COMMAND,
    EDIT,
    EVENT,
    EVENTS,
    JOIN,
    LEAVE,
    MAP,
    ORDER,
    PLACES,
    PLAN,
    POOL,
    RADIO,
    ROBOT_ACTION,
    SENSE,
    STATE,
    STATUS,
    TRUTH,
    Topic,
)
from swarm.messages.topic import key_prefix_of
from swarm.secure.names import BRIDGE, OPERATOR, ROUTER, WATCHER, WORLD

ROBOT: Final = "robot"  # the row of every robot
FLEET: Final = key_prefix_of("*")  # keys of whatever fleet: a router with an access list serves one fleet, of any name
SEND: Final = ("put",)
ANSWER: Final = ("declare_queryable", "reply")
HEAR: Final = ("declare_subscriber",)
ASK: Final = ("query",)
PRESENCE: Final = ("declare_liveliness_subscriber", "liveliness_query")
ALIVE: Final = ("liveliness_token",)
EVERYTHING: Final = (*SEND, *ANSWER, *HEAR, *ASK, *PRESENCE, *ALIVE)

Topics = tuple[Topic[Any], ...]


class Rights(NamedTuple):
    """What one role may do."""

    sends: Topics  # of robots' topics, the own ones only
    answers: Topics
    hears: Topics | None  # of `sense` and `cmd`, a robot's own only; None: every key of the fleet
    asks: Topics
    present_as: str | None  # the role in its liveliness token; None: it has none
    sees: str  # the role in liveliness tokens that it sees; *: all


LAST: Final = (CLOCK, STATE, PLAN, MAP, TRUTH, EVENT, EVENTS, STATUS)  # the world keeps their last messages
RIGHTS: Final = {
    WORLD: Rights(
        sends=(SENSE, TRUTH, CLOCK, EVENT, STATUS, MAP),
        answers=(ACTION, EDIT, JOIN, LEAVE, ORDER, ROBOT_ACTION, POOL, PLACES, *LAST),
        hears=(COMMAND, BODY, STATE, PLAN, RADIO),  # of robots of other code, for the tape
        asks=(CLOCK,),  # a second world finds out that it is one
        present_as="world",
        sees="*",
    ),
    ROBOT: Rights(
        sends=(RADIO, COMMAND, STATE, PLAN, BODY),  # the body of a robot has the keys of its robot
        answers=(),
        hears=(RADIO, SENSE, COMMAND, CLOCK),
        asks=(JOIN, LEAVE, MAP),
        present_as="robot",
        sees="world",
    ),
    WATCHER: Rights(sends=(), answers=(), hears=None, asks=LAST, present_as="dashboard", sees="*"),
    OPERATOR: Rights(
        sends=(),
        answers=(),
        hears=None,
        asks=(*LAST, ACTION, EDIT, ORDER, ROBOT_ACTION, POOL, PLACES),
        present_as=None,
        sees="*",
    ),
    BRIDGE: Rights(
        sends=(),
        answers=(),
        hears=(CLOCK, MAP, TRUTH, SENSE, PLAN, STATE, EVENT, STATUS, RADIO),
        asks=(*LAST, ORDER, ROBOT_ACTION),
        present_as=None,
        sees="world",
    ),
}


def access_list(robots: Sequence[str], *, several: bool = False) -> dict[str, Any]:
    """Return Zenoh's setting ``access_control`` for a fleet of these robots.

    A robot has rules of its own, since a rule cannot name the certificate's holder in a key. With ``several`` routers
    each takes what another one has let in.
    """
    rules: list[dict[str, Any]] = []
    policies: list[dict[str, Any]] = []
    members = (*(role for role in RIGHTS if role != ROBOT), *robots)
    for member in members:
        rights, robot = (RIGHTS[ROBOT], member) if member in robots else (RIGHTS[member], "*")
        own = [rule for rule in _rules(member, rights, robot) if rule["key_exprs"]]
        rules += own
        policies.append({"subjects": [member], "rules": [rule["id"] for rule in own]})
    # what the router sends out was let in by the rules above
    rules.append(_rule("out", EVERYTHING, [f"{FLEET}**"], "egress"))
    policies.append({"subjects": [*members, *([ROUTER] * several)], "rules": ["out"]})
    if several:
        rules.append(_rule("handed on", EVERYTHING, [f"{FLEET}**"]))
        policies.append({"subjects": [ROUTER], "rules": ["handed on"]})
    named = (*members, *([ROUTER] * several))
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": [{"id": member, "cert_common_names": [member]} for member in named],
        "policies": policies,
    }


def _rules(member: str, rights: Rights, robot: str) -> list[dict[str, Any]]:
    """Return the rules of one member; ``robot`` is its own name in keys, or ``*`` for all of them."""
    hears = [f"{FLEET}**"] if rights.hears is None else [_rules_to_hear(topic, robot) for topic in rights.hears]
    role = rights.present_as
    return [
        _rule(f"{member} sends", SEND, [_key(topic, robot) for topic in rights.sends]),
        _rule(f"{member} answers", ANSWER, [_key(topic, robot) for topic in rights.answers]),
        _rule(f"{member} hears", HEAR, hears),
        _rule(f"{member} asks", ASK, [_key(topic, "*") for topic in rights.asks]),
        _rule(f"{member} is present", ALIVE, [] if role is None else [f"{FLEET}alive/{role}/{_name(role, robot)}/*"]),
        _rule(f"{member} sees", PRESENCE, [f"{FLEET}alive/{rights.sees}/*/*"]),
    ]


def _rule(name: str, messages: Sequence[str], keys: list[str], flow: str = "ingress") -> dict[str, Any]:
    return {"id": name, "messages": [*messages], "flows": [flow], "permission": "allow", "key_exprs": keys}


def _key(topic: Topic[Any], robot: str) -> str:
    return FLEET + topic.key.format(robot=robot, zx="*", zy="*")


def _rules_to_hear(topic: Topic[Any], robot: str) -> str:
    return _key(topic, robot if topic in (SENSE, COMMAND) else "*")


def _name(role: str, robot: str) -> str:
    return robot if role == ROBOT else "*"
