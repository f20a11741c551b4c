"""The access list as a table: each topic has its senders, and nobody has a right that the processes do not use."""

from itertools import product

import pytest
import zenoh

from swarm.messages import ACTION, EDIT, REPLIES, SETUP, TOPICS, Topic
from swarm.secure.access import RIGHTS, access_list
from tests.secure.shared import ROBOTS

LIST = access_list(ROBOTS)
RULES = {rule["id"]: rule for rule in LIST["rules"]}
EVERYBODY = ("world", "operator", "watcher", "bridge", *ROBOTS)


def may(member: str, message: str, key: str) -> bool:
    """Decide like Zenoh: a rule allows what its keys include."""
    names = [name for policy in LIST["policies"] if member in policy["subjects"] for name in policy["rules"]]
    wanted = zenoh.KeyExpr(f"swarm/v1/f/{key}")
    return any(
        zenoh.KeyExpr(allowed).includes(wanted)
        for name in names
        if message in RULES[name]["messages"] and "ingress" in RULES[name]["flows"]
        for allowed in RULES[name]["key_exprs"]
    )


@pytest.mark.parametrize("topic", TOPICS, ids=lambda topic: topic.key)
def test_every_topic_has_one_role_that_sends_or_answers_it(topic: Topic) -> None:  # type: ignore[type-arg]
    senders = [role for role, rights in RIGHTS.items() if topic in rights.sends]
    answering = [role for role, rights in RIGHTS.items() if topic in rights.answers]
    if topic.key in REPLIES:
        served = [] if topic is SETUP else ["world"]  # with keys, the launcher is a watcher and answers nothing
        assert (senders, answering) == ([], served)
    else:
        assert len(senders) == 1 or (senders, answering) == ([], ["world"]), (
            "give a new topic its row in swarm/secure/access.py"
        )


# fmt: off
ALLOWED = [
    ("r1", "put", "robot/r1/cmd"), ("r1", "put", "robot/r1/state"), ("r1", "put", "robot/r1/plan"), ("r1", "put", "radio/-3/4/r1"),
    ("r1", "put", "robot/r1/body"), ("r1", "declare_subscriber", "robot/r1/cmd"), ("world", "declare_subscriber", "robot/*/body"),
    ("r1", "declare_subscriber", "robot/r1/sense"), ("r1", "declare_subscriber", "radio/3/4/*"), ("r1", "query", "world/join"),
    ("r1", "query", "world/map"), ("r1", "liveliness_token", "alive/robot/r1/ab12"), ("r1", "declare_liveliness_subscriber", "alive/world/*/*"),
    ("world", "put", "robot/r1/sense"), ("world", "put", "world/truth"), ("world", "reply", "robot/r1/state"), ("world", "declare_queryable", "world/edit"),
    ("world", "declare_subscriber", "robot/*/cmd"), ("world", "liveliness_token", "alive/world/world/ab12"),
    ("operator", "query", "world/edit"), ("operator", "query", "world/action"),
    ("operator", "query", "world/pool"), ("world", "declare_queryable", "world/pool"),
    ("operator", "query", "robot/r1/order"), ("operator", "query", "robot/r1/action"), ("world", "declare_queryable", "robot/*/order"),
    ("watcher", "declare_subscriber", "**"), ("watcher", "query", "robot/*/state"), ("watcher", "liveliness_token", "alive/dashboard/dashboard/ab12"),
    ("bridge", "query", "robot/r1/order"), ("bridge", "query", "robot/r1/action"), ("bridge", "query", "world/map"),
    ("bridge", "declare_subscriber", "robot/*/sense"), ("bridge", "declare_subscriber", "world/truth"),
]
REFUSED = [
    ("r1", "put", "robot/r2/body"), ("world", "put", "robot/r1/body"), ("r1", "declare_subscriber", "robot/r2/cmd"),
    ("r1", "put", "robot/r2/cmd"), ("r1", "put", "robot/*/cmd"), ("r1", "put", "radio/*/*/*"), ("r1", "put", "**"), ("r1", "put", "robot/r1/sense"),
    ("r1", "put", "radio/3/4/r2"), ("r1", "put", "world/truth"), ("r1", "put", "robot/r1/**"), ("r1", "delete", "robot/r1/state"),
    ("r1", "declare_subscriber", "robot/r2/sense"), ("r1", "declare_subscriber", "world/truth"), ("r1", "declare_subscriber", "robot/*/cmd"),
    ("r1", "declare_queryable", "world/edit"), ("r1", "liveliness_token", "alive/robot/r2/ab12"), ("r1", "liveliness_token", "alive/world/world/ab12"),
    ("world", "put", "robot/r1/cmd"), ("world", "put", "radio/3/4/r1"), ("world", "query", "world/edit"),
    ("operator", "put", "world/clock"), ("operator", "declare_queryable", "world/action"), ("operator", "query", "world/join"),
    ("r1", "query", "world/pool"), ("watcher", "query", "world/pool"), ("r1", "declare_queryable", "world/pool"),
    ("r1", "query", "robot/r1/order"), ("r1", "query", "robot/r2/order"), ("r1", "query", "robot/r2/action"),
    ("r1", "declare_queryable", "robot/r1/order"), ("watcher", "query", "robot/r1/order"), ("watcher", "query", "robot/r1/action"),
    ("operator", "query", "robot/r1/cmd"),
    ("watcher", "query", "world/join"), ("watcher", "liveliness_token", "alive/robot/r1/ab12"),
    ("bridge", "query", "world/pool"), ("bridge", "query", "world/join"), ("bridge", "put", "robot/r1/cmd"),
    ("bridge", "put", "robot/r1/body"), ("bridge", "declare_subscriber", "robot/*/cmd"), ("bridge", "declare_subscriber", "**"),
    ("bridge", "liveliness_token", "alive/robot/r1/ab12"),
    ("router", "put", "world/clock"), ("stranger", "declare_subscriber", "world/clock"),
]
# fmt: on


@pytest.mark.parametrize(("member", "message", "key"), ALLOWED)
def test_what_a_process_does_is_allowed(member: str, message: str, key: str) -> None:
    assert may(member, message, key)


@pytest.mark.parametrize(("member", "message", "key"), REFUSED)
def test_what_a_process_does_not_do_is_refused(member: str, message: str, key: str) -> None:
    assert not may(member, message, key)


@pytest.mark.parametrize(("member", "topic"), list(product(EVERYBODY, (ACTION, EDIT))))
def test_only_the_operator_orders(member: str, topic: Topic) -> None:  # type: ignore[type-arg]
    assert may(member, "query", topic.key) == (member == "operator")


def test_no_tool_sends_anything() -> None:
    assert [
        rule
        for rule in LIST["rules"]
        if "put" in rule["messages"] and rule["id"].split()[0] in {"operator", "watcher", "bridge"}
    ] == []
