"""Makes the tables of traffic-contract.md from the rules, the transitions and the constants of traffic."""

import inspect
import re
from typing import Final

from docs.markdown import rows, said
from swarm.traffic.joint.protocol import ANY_CALL, CALLS, PLANS, Types
from swarm.traffic.reservations.rules import ASK, GRANT, TAKE, Rule
from swarm.traffic.settings import TrafficConstants

CONSTANT: Final = re.compile(r"^    (\w+): (?:int|float) = (\S+)(?:  # (.*))?$")
# those that robots must agree on, or that tell when others answer
AGREED: Final = (
    "margin", "horizon", "ripe", "listen", "often", "fresh", "gap", "absent", "surmise", "obstacle", "emptied",
    "hops", "relay", "relay_silent", "keep", "relayed",
    "ahead", "stuck", "calm", "gather", "gather_longest", "freeze", "carry", "unanswered", "pass_over",
)  # fmt: skip


def rules() -> str:
    """Return the three tables of reservations."""
    parts = []
    tables: tuple[tuple[str, dict[str, Rule]], ...] = (
        ("I acknowledge another's claim", GRANT),
        ("I claim a cell", ASK),
        ("my claim becomes a hold", TAKE),
    )
    for what, table in tables:
        parts.append(rows((f"{what}, unless",), *((name,) for name in table)))
    return "\n\n".join(parts)


def transitions() -> str:
    """Return the two tables of a robot's part in joint plans, as one."""
    body = [(_names(one.of), said(one.happens).rstrip("."), _names(one.to)) for one in (*CALLS, *PLANS)]
    return rows(("in", "what happens", "then"), *body)


def _names(states: Types) -> str:
    if states == ANY_CALL:
        return "any state"
    every = states if isinstance(states, tuple) else (states,)
    return ", ".join("no plan" if one is type(None) else f"`{one.__name__}`" for one in every)


def constants() -> str:
    """Return the table of the constants that robots must agree on, with their comments in the code."""
    found, comment = {}, ""
    for line in inspect.getsource(TrafficConstants).splitlines():
        if match := CONSTANT.match(line):
            found[match[1]] = match[2], match[3] or comment.strip()
        comment = f"{comment} {line.strip()[2:]}" if line.strip().startswith("# ") else ""
    return rows(("constant", "value", "unit and meaning"), *((f"`{name}`", *found[name]) for name in AGREED))
