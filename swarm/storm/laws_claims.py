"""The laws of what robots say aloud of claims: when they are made, who agrees to them, and what is taken by them.

Cells are held by two only where several of these rules fail together, so a run shows seldom that one of them is gone.
What is said shows it at once.
"""

from collections.abc import Collection
from typing import Final

from swarm.messages.traffic import Claim, Record, Sighting
from swarm.storm.growth import AWAY, growth, has_new_process
from swarm.storm.history import History, Moment
from swarm.storm.seen import Found, claims_of
from swarm.storm.told import Told
from world.faults import SILENT

LISTENS: Final = 1.0  # s after it begins or wakes, in which a robot claims nothing
NO_ANSWER: Final = 8.0  # s of silence, after which nobody waits for an answer any more

Said = dict[tuple[str, int], Claim]  # (robot, number): what it claimed under it


def claims_numbered_once(history: History) -> Found:
    """Check that a robot claims one cell at one time under a number, and never anything else under it again."""
    said: Said = {}
    for moment in history.moments:
        for name, own in _records(moment):
            for claim in own.claims:
                known = said.setdefault((name, claim.number), claim)
                if known != claim:
                    text = f"{name} claims cell {claim.cell} under number {claim.number}, as it did cell {known.cell}"
                    yield moment.tick, (name,), text


def no_false_agreement(history: History) -> Found:
    """Check that nobody agrees to a claim for a cell that it holds itself, or claims with the older right."""
    said: Said = {}
    for moment in history.moments:
        for name, own in _records(moment):
            said.update({(name, claim.number): claim for claim in own.claims})
            older = {cell: (claim.stamp, name) for cell, claim in claims_of(own).items()}
            for other, number in own.acks:
                claim = said.get((other, number))
                if claim is None:
                    continue
                agrees = f"{name} agrees that {other} takes cell {claim.cell}"
                if claim.cell in own.held:
                    yield moment.tick, (name, other), f"{agrees}, and holds it"
                elif older.get(claim.cell, (claim.stamp, other)) < (claim.stamp, other):
                    yield moment.tick, (name, other), f"{agrees}, and has claimed it before"


def listens_first(history: History) -> Found:
    """Check that a robot which begins or wakes claims nothing before it has listened."""
    last: dict[str, int] = {}
    began: dict[str, int] = {}
    for moment in history.moments:
        for name in moment.commands:
            if moment.tick - last.get(name, -AWAY - 1) > AWAY or has_new_process(history, moment, name):
                began[name] = moment.tick
            last[name] = moment.tick
        for name, own in _records(moment):
            silent = (moment.tick - began[name]) * history.dt
            if own.claims and silent < LISTENS:
                yield moment.tick, (name,), f"{name} claims cell {own.claims[0].cell} {silent:g} s after it began"


def stands_without_claims(history: History) -> Found:
    """Check that who stands for a joint plan claims nothing: the leader plans with what is held."""
    for moment in history.moments:
        for name, own in _records(moment):
            if own.frozen is not None and own.claims:
                yield moment.tick, (name,), f"{name} stands for a plan and claims cell {own.claims[0].cell}"


def takes_only_what_is_free(history: History) -> Found:
    """Check that nobody takes a cell which it was told that another holds, or claims with the older right.

    Excepted is a cell of a silent robot that a look has found empty since.
    """
    seen = {sighting for moment in history.moments for _, own in _records(moment) for sighting in own.seen}
    told = Told(history)
    claims: dict[str, dict[int, Claim]] = {}  # of the newest record
    for moment, grown in growth(history):
        for name in history.robots:
            if has_new_process(history, moment, name):
                told.forget(name)
        told.hear(moment)
        for name, new in grown.items():
            for cell in sorted(new):
                claim = claims.get(name, {}).get(cell)
                for other, record in told.of(name).items():
                    if _keeps(record, cell, name, claim) and not _found_empty(seen, cell, record.stamp, moment.tick):
                        yield moment.tick, (name, other), f"{name} took cell {cell}, which {other} had told it keeps"
        claims |= {name: claims_of(own) for name, own in _records(moment)}


def _keeps(record: Record, cell: int, taker: str, claim: Claim | None) -> bool:
    """Return True if a robot says it holds a cell, or claims it with an older right than the taker's claim."""
    right = (claim.stamp, taker) if claim is not None else None
    return cell in record.held or any(
        one.cell == cell and (right is None or (one.stamp, record.robot) < right) for one in record.claims
    )


def _found_empty(seen: Collection[Sighting], cell: int, since: int, until: int) -> bool:
    return any(one.cell == cell and one.empty and since < one.tick <= until for one in seen)


def no_wait_for_the_silent(history: History) -> Found:
    """Check that nobody waits for the answer of a robot long silent, but only for cells that it was told it keeps."""
    told = Told(history)
    silent_since: dict[str, int] = {}
    for moment in history.moments:
        told.hear(moment)
        for name, health in moment.health.items():
            if health in SILENT:
                silent_since.setdefault(name, moment.tick)
            else:
                silent_since.pop(name, None)
        for name, own in _records(moment):
            for other in own.waits:
                silence = (moment.tick - silent_since.get(other, moment.tick)) * history.dt
                if silence > NO_ANSWER and not told.way(name, other).intersection(own.ahead[:1]):
                    yield moment.tick, (name, other), f"{name} waits for {other}, silent for {silence:.0f} s"


def _records(moment: Moment) -> list[tuple[str, Record]]:
    """List what each robot says of itself at a tick."""
    return [(name, words.traffic.own) for name, words in moment.spoken.items() if words.traffic is not None]
