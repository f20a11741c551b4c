"""The laws of claims on the radio: when robots make them, who acknowledges them, and which cells they take.

Two robots hold one cell only if several rules of the protocol fail together, so a run rarely shows that a single rule
is broken. The broadcasts show it at once.
"""

from collections.abc import Collection
from typing import Final

from swarm.messages.traffic import Claim, Record, Sighting
from swarm.storm.history.heard_records import Told
from swarm.storm.history.history import History, Moment
from swarm.storm.history.run_facts import AWAY, Found, claims_of, has_new_process, iterate_new_cells
from swarm.traffic.lattice.placement import traffic_settings
from world.faults import SILENT

LISTENS: Final = 1.0  # s after a robot begins or wakes in which it claims nothing
MARGIN: Final = 1.0  # s beyond the silence after which a member of a plan loses its turns

Said = dict[tuple[str, int], Claim]  # (robot, claim number) -> claim


def claims_numbered_once(history: History) -> Found:
    """Check that a robot uses each claim number for one claim only: one cell at one time."""
    said: Said = {}
    for moment in history.moments:
        for name, own in _records(moment):
            for claim in own.claims:
                known = said.setdefault((name, claim.number), claim)
                if known != claim:
                    text = f"{name} claims cell {claim.cell} as number {claim.number}, used for cell {known.cell}"
                    yield moment.tick, (name,), text


def no_false_agreement(history: History) -> Found:
    """Check that no robot acknowledges a claim for a cell that it holds itself or claimed before."""
    said: Said = {}
    for moment in history.moments:
        for name, own in _records(moment):
            said.update({(name, claim.number): claim for claim in own.claims})
            older = {cell: (claim.stamp, name) for cell, claim in claims_of(own).items()}
            for other, number in own.acks:
                claim = said.get((other, number))
                if claim is None:
                    continue
                agrees = f"{name} acknowledges the claim of {other} for cell {claim.cell}"
                if claim.cell in own.held:
                    yield moment.tick, (name, other), f"{agrees} but holds the cell"
                elif older.get(claim.cell, (claim.stamp, other)) < (claim.stamp, other):
                    yield moment.tick, (name, other), f"{agrees} but has an older claim"


def listens_first(history: History) -> Found:
    """Check that a robot that begins or wakes claims nothing before it has listened."""
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
    """Check that a robot that stands for a joint plan claims nothing: the leader plans with the cells held."""
    for moment in history.moments:
        for name, own in _records(moment):
            if own.frozen is not None and own.claims:
                yield moment.tick, (name,), f"{name} stands for a joint plan but claims cell {own.claims[0].cell}"


def takes_only_what_is_free(history: History) -> Found:
    """Check that no robot takes a cell that, as it has heard, another robot holds or claimed before.

    A cell of a silent robot is excepted if a look has found it empty since.
    """
    seen = {sighting for moment in history.moments for _, own in _records(moment) for sighting in own.seen}
    told = Told(history)
    claims: dict[str, dict[int, Claim]] = {}  # from the newest record
    for moment, grown in iterate_new_cells(history):
        for name in history.robots:
            if has_new_process(history, moment, name):
                told.forget(name)
        told.hear(moment)
        for name, new in grown.items():
            for cell in sorted(new):
                claim = claims.get(name, {}).get(cell)
                for other, record in told.newest_records(name).items():
                    if _keeps(record, cell, name, claim) and not _find_empty(seen, cell, record.stamp, moment.tick):
                        yield moment.tick, (name, other), f"{name} took cell {cell}, known to be kept by {other}"
        claims |= {name: claims_of(own) for name, own in _records(moment)}


def _keeps(record: Record, cell: int, taker: str, claim: Claim | None) -> bool:
    """Return True if a robot's record holds a cell, or has an older claim for it than the taker's."""
    right = (claim.stamp, taker) if claim is not None else None
    return cell in record.held or any(
        one.cell == cell and (right is None or (one.stamp, record.robot) < right) for one in record.claims
    )


def _find_empty(seen: Collection[Sighting], cell: int, since: int, until: int) -> bool:
    return any(one.cell == cell and one.empty and since < one.tick <= until for one in seen)


def no_wait_for_the_silent(history: History) -> Found:
    """Check that no robot waits for a robot long silent, unless it heard that that robot keeps the next cell.

    How long is long is one of traffic's settings: where walls stop the radio, silence is common and means less.
    """
    told = Told(history)
    longest = traffic_settings(history.settings).absent * history.dt + MARGIN
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
                if silence > longest and not told.way(name, other).intersection(own.ahead[:1]):
                    yield moment.tick, (name, other), f"{name} waits for {other}, silent for {silence:.0f} s"


def _records(moment: Moment) -> list[tuple[str, Record]]:
    """Return each robot's own record in the broadcasts of a tick."""
    return [(name, words.traffic.own) for name, words in moment.spoken.items() if words.traffic is not None]
