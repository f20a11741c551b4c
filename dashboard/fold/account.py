"""The account in a recording: what the world has measured so far, and how many messages the dashboard has heard.

It is written every few seconds and at the end of a run, so a recording that is cut has an account too.
"""

import json
from collections.abc import Mapping
from typing import Annotated, Literal

import msgspec

from swarm.errors import ConfigError
from swarm.messages import Account, Id, Phase, Status

Number = Annotated[int, msgspec.Meta(ge=0)]
Known = Annotated[float, msgspec.Meta(ge=0)]


class Saved(msgspec.Struct, frozen=True, kw_only=True):
    """One account, as it is in a recording."""

    version: Literal[1] = 1
    scenario: str
    world: Id | None  # identity of the world whose run it is
    run: Number
    time: Known  # s, since the run began
    phase: Phase
    complete: bool
    reason: str
    contacts: dict[Id, Number]
    clearance_min: float | None  # m
    robots: dict[Id, Account]
    heard: dict[str, Number]  # messages that came to the dashboard, by topic
    lost: dict[str, Number]  # messages that did not


def saved(status: Status, heard: Mapping[str, int], lost: Mapping[str, int]) -> Saved | None:
    """Return the account of a status, or None if its world is older than this and has measured nothing."""
    robots = {row.robot: row.account for row in status.robots if row.account is not None}
    if len(robots) < len(status.robots):
        return None
    return Saved(
        scenario=status.scenario, world=status.world, run=status.run, time=status.time, phase=status.phase,
        complete=status.complete, reason=status.reason, contacts=status.contacts, clearance_min=status.clearance_min,
        robots=robots, heard=dict(heard), lost={topic: count for topic, count in lost.items() if count},
    )  # fmt: skip


def is_earlier(account: Saved, later: Saved) -> bool:
    """Return True if an account is of the same run as another one, and not later."""
    same = (account.world, account.run) == (later.world, later.run) and account.world is not None
    return same and account.time <= later.time


def written(account: Saved) -> str:
    """Return an account as JSON in ASCII; each number is read back as the same number."""
    return json.dumps(msgspec.to_builtins(account))


def read(text: str) -> Saved:
    """Return the account that ``written`` has written.

    Raises:
        ConfigError: the text is none.
    """
    try:
        return msgspec.json.decode(text, type=Saved)
    except (msgspec.DecodeError, UnicodeError) as fault:
        raise ConfigError(f"expected an account of this version of the project, got: {fault}") from None
