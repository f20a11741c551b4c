"""Turns an item of the inbox into a checked arrival: it splits the key into its parts and decodes the payload."""

import re
from collections.abc import Mapping
from functools import lru_cache
from typing import Any, Final

import zenoh

from swarm.bus.arrivals import Arrival, Link, Presence, Request
from swarm.bus.codec import decode
from swarm.bus.losses import Gaps
from swarm.errors import PeerError, SwarmError
from swarm.messages import Topic

ID: Final = re.compile(r"^[A-Za-z0-9_.:-]{1,64}\Z")
KEYS: Final = 4096  # whose parts are remembered: a process hears the same keys all the time

Item = tuple[Any, ...]  # "sample", "query", "token" or "link", and what Zenoh gave


def inbox_item(topic: Topic[Any], gaps: Gaps, sample: zenoh.Sample) -> Item:
    """Return the inbox item of a sample. If the payload is too large, the item has its size instead."""
    payload, attached = sample.payload, sample.attachment
    size = len(payload)
    return (
        "sample",
        topic,
        str(sample.key_expr),
        payload.to_bytes() if size <= topic.limit else size,
        gaps,
        None if attached is None else attached.to_bytes(),
    )


def count_lost_before(item: Item) -> int:
    """Return how many messages of the same sender on the same key were lost right before a sample.

    Raises:
        PeerError: what is attached to the sample is no ``Sequence``.
    """
    _, _, key, _, gaps, attached = item
    count: int = gaps.count_lost(key, attached)
    return count


def is_browsing(query: zenoh.Query, *, kept: bool = False) -> bool:
    """Return True if a query asks only for last messages, which ``Bus.keep`` answers. Then it is no request.

    Such a query has no payload. Its key has wildcards, or last messages are ``kept`` under it.
    """
    return query.payload is None and (kept or "*" in str(query.key_expr))


def decode_item(prefix: str, item: Item) -> Arrival | Presence | Link | Request:
    """Return the arrival that an item of the inbox stands for. ``prefix`` begins every key of the fleet.

    Call ``count_lost_before`` with a sample first: it notes who sent it.

    Raises:
        PeerError: the key or the payload is not what the topic says. If it is a request, it has been refused already.
    """
    match item:
        case ("sample", topic, key, payload, *counted):
            ids = _ids(prefix, topic, key)
            if isinstance(payload, int):
                raise PeerError(f"{key}: expected at most {topic.limit} bytes, got {payload}")
            message = decode(payload, topic.message, topic.limit, topic.json)
            claimed = getattr(message, "robot", None)
            if "robot" in ids and claimed is not None and claimed != ids["robot"]:
                raise PeerError(f"{key}: expected a message of {ids['robot']!r}, got one of {claimed!r}")
            return Arrival(topic, ids, message, counted[0].sender(key, counted[1]) if counted else None)
        case ("query", topic, query):
            key = str(query.key_expr)
            try:
                if "*" in key:
                    raise PeerError(f"{key}: expected the exact key {prefix}{topic.key} of a request, got wildcards")
                if query.payload is None:
                    raise PeerError(f"{key}: expected a payload, got none")
                ids = _ids(prefix, topic, key) if "{" in topic.key else {}
                message = decode(query.payload.to_bytes(), topic.message, topic.limit)
            except PeerError as fault:
                query.reply_err(str(fault).encode())
                query.drop()
                raise
            return Request(topic, message, query, prefix + topic.key.format(**ids), ids)
        case ("token", key, alive):
            return parse_presence(prefix, key, alive=alive)
        case ("link", up):
            return Link(up)
    raise SwarmError(f"inbox: unknown item {item!r}")


def parse_presence(prefix: str, key: str, *, alive: bool) -> Presence:
    """Return what a token says.

    Raises:
        PeerError: its key is not that of a token.
    """
    parts = key.removeprefix(prefix).split("/")
    if len(parts) != 4 or not all(ID.match(part) for part in parts):
        raise PeerError(f"{key}: expected alive/<role>/<id>/<session>")
    return Presence(parts[1], parts[2], parts[3], alive)


def _ids(prefix: str, topic: Topic[Any], key: str) -> dict[str, str]:
    """Return the variable parts of a topic's key.

    Raises:
        PeerError: the key is none of that topic.
    """
    return dict(_parts(prefix, topic.key, key))


@lru_cache(KEYS)
def _parts(prefix: str, pattern: str, key: str) -> Mapping[str, str]:
    names, chunks = pattern.split("/"), key.removeprefix(prefix).split("/")
    if len(names) != len(chunks):
        raise PeerError(f"{key}: expected the key {prefix}{pattern}")
    ids = {}
    for name, chunk in zip(names, chunks, strict=True):
        if not name.startswith("{"):
            if name != chunk:
                raise PeerError(f"{key}: expected the key {prefix}{pattern}")
        elif not ID.match(chunk):
            raise PeerError(f"{key}: expected an id of letters, digits and _ . : -, got {chunk!r}")
        else:
            ids[name[1:-1]] = chunk
    return ids
