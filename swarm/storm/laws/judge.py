"""The laws that every run must keep. Each law is a function from a recorded run to its violations.

The laws use nothing of the planner: they know only cells, poses and the broadcasts on the radio.
"""

from collections.abc import Mapping
from typing import Final, NamedTuple

from swarm.storm.history.history import History
from swarm.storm.history.run_facts import Law
from swarm.storm.laws import claims, driving, fairness, floor, mission, orders, pool, wire


class Violation(NamedTuple):
    """A law that was broken."""

    law: str
    tick: int
    robots: tuple[str, ...]
    text: str


LAWS: Final[Mapping[str, Law]] = {
    "no exception": mission.no_exception,
    "no contact": floor.no_contact,
    "no overlap": floor.no_overlap,
    "no hold without a claim": floor.no_hold_without_claim,
    "claims numbered once": claims.claims_numbered_once,
    "no false agreement": claims.no_false_agreement,
    "listens first": claims.listens_first,
    "no claim while standing": claims.stands_without_claims,
    "takes only what is free": claims.takes_only_what_is_free,
    "no wait for the silent": claims.no_wait_for_the_silent,
    "no body outside": driving.no_body_outside,
    "room to brake": driving.room_to_brake,
    "flags stay": mission.flags_stay,
    "all arrive": mission.all_arrive,
    "it ends": mission.it_ends,
    "truthful": mission.truthful,
    "nobody stands unnamed": mission.nobody_stands_unnamed,
    "the report agrees": mission.report_agrees,
    "nobody is overtaken for ever": fairness.nobody_overtaken_for_ever,
    "passes the wire": wire.passes_the_wire,
    "broadcasts are heard": wire.broadcasts_are_heard,
    "orders are kept": orders.orders_are_kept,
    "the pool is kept": pool.pool_is_kept,
}

# laws about the scenario's own stops; in a run with orders or a pool, robots have others
OWN_STOPS: Final = frozenset(
    {
        "flags stay", "all arrive", "it ends", "truthful", "nobody stands unnamed", "the report agrees",
        "nobody is overtaken for ever",
    }
)  # fmt: skip


def judge(history: History, laws: Mapping[str, Law] = LAWS) -> list[Violation]:
    """Check a run against every law that fits it; return the first violation of each law by each robot."""
    found = []
    for law, function in laws.items():
        if (history.settings.orders or history.settings.pool) and law in OWN_STOPS:
            continue
        if not history.moments and function is not mission.no_exception:
            continue  # its first step has failed: there is nothing to judge
        blamed = set()
        for tick, robots, text in function(history):
            if robots not in blamed:
                blamed.add(robots)
                found.append(Violation(law, tick, robots, text))
    return found
