"""The laws that every run must keep. Each law is a function from a recorded run to its violations.

The laws use nothing of the planner: they know only cells, poses and the broadcasts on the radio.
"""

from collections.abc import Mapping
from typing import Final, NamedTuple

from world.storm.history.history import History
from world.storm.history.seen import Law
from world.storm.laws.claims import (
    claims_numbered_once,
    listens_first,
    no_false_agreement,
    no_wait_for_the_silent,
    stands_without_claims,
    takes_only_what_is_free,
)
from world.storm.laws.driving import no_body_outside, room_to_brake
from world.storm.laws.floor import no_contact, no_hold_without_claim, no_overlap
from world.storm.laws.mission import (
    all_arrive,
    flags_stay,
    it_ends,
    no_exception,
    nobody_stands_unnamed,
    report_agrees,
    truthful,
)
from world.storm.laws.orders import orders_are_kept
from world.storm.laws.pool import pool_is_kept
from world.storm.laws.wire import broadcasts_are_heard, passes_the_wire


class Violation(NamedTuple):
    """A law that was broken."""

    law: str
    tick: int
    robots: tuple[str, ...]
    text: str


LAWS: Final[Mapping[str, Law]] = {
    "no exception": no_exception,
    "no contact": no_contact,
    "no overlap": no_overlap,
    "no hold without a claim": no_hold_without_claim,
    "claims numbered once": claims_numbered_once,
    "no false agreement": no_false_agreement,
    "listens first": listens_first,
    "no claim while standing": stands_without_claims,
    "takes only what is free": takes_only_what_is_free,
    "no wait for the silent": no_wait_for_the_silent,
    "no body outside": no_body_outside,
    "room to brake": room_to_brake,
    "flags stay": flags_stay,
    "all arrive": all_arrive,
    "it ends": it_ends,
    "truthful": truthful,
    "nobody stands unnamed": nobody_stands_unnamed,
    "the report agrees": report_agrees,
    "passes the wire": passes_the_wire,
    "broadcasts are heard": broadcasts_are_heard,
    "orders are kept": orders_are_kept,
    "the pool is kept": pool_is_kept,
}

# laws about the scenario's own stops; in a run with orders or a pool, robots have others
OWN_STOPS: Final = frozenset(
    {"flags stay", "all arrive", "it ends", "truthful", "nobody stands unnamed", "the report agrees"}
)


def judge(history: History) -> list[Violation]:
    """Check a run against every law that fits it; return the first violation of each law by each robot."""
    found = []
    for law, function in LAWS.items():
        if (history.settings.orders or history.settings.pool) and law in OWN_STOPS:
            continue
        blamed = set()
        for tick, robots, text in function(history):
            if robots not in blamed:
                blamed.add(robots)
                found.append(Violation(law, tick, robots, text))
    return found
