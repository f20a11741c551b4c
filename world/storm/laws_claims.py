"""The laws of what robots say aloud of claims: numbered once, and agreed to only by who has no better right.

Cells are held by two only where several of these rules fail together, so a run shows seldom that one of them is gone.
What is said shows it at once.
"""

from swarm.traffic.record import Claim
from world.storm.history import History
from world.storm.seen import Found

Said = dict[tuple[str, int], Claim]  # (robot, number): what it claimed under it


def claims_numbered_once(history: History) -> Found:
    """Check that a robot claims one cell at one time under a number, and never anything else under it again."""
    said: Said = {}
    for moment in history.moments:
        for name, broadcast in moment.spoken.items():
            for claim in broadcast.traffic.own.claims if broadcast.traffic is not None else ():
                known = said.setdefault((name, claim.number), claim)
                if known != claim:
                    text = f"{name} claims cell {claim.cell} under number {claim.number}, as it did cell {known.cell}"
                    yield moment.tick, (name,), text


def no_false_agreement(history: History) -> Found:
    """Check that nobody agrees to a claim for a cell that it holds itself, or claims with the older right."""
    said: Said = {}
    for moment in history.moments:
        for name, broadcast in moment.spoken.items():
            if broadcast.traffic is None:
                continue
            own = broadcast.traffic.own
            said.update({(name, claim.number): claim for claim in own.claims})
            older = {claim.cell: (claim.stamp, name) for claim in own.claims}
            for other, number in own.acks:
                claim = said.get((other, number))
                if claim is None:
                    continue
                agrees = f"{name} agrees that {other} takes cell {claim.cell}"
                if claim.cell in own.held:
                    yield moment.tick, (name, other), f"{agrees}, and holds it"
                elif older.get(claim.cell, (claim.stamp, other)) < (claim.stamp, other):
                    yield moment.tick, (name, other), f"{agrees}, and has claimed it before"
