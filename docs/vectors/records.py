"""The test vectors of what robots say: records, and what a robot that hears them acknowledges, claims and takes."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, NamedTuple

import msgpack

from docs.vectors.floors import squares
from docs.vectors.writing import Json
from swarm.bus.codec import decode, encode
from swarm.errors import PeerError
from swarm.geometry import Pose
from swarm.messages import RADIO, Activity, Broadcast
from swarm.messages.traffic import Claim, Record, Relayed, Sighting, TrafficBroadcast
from swarm.traffic.lattice.placement import traffic_settings
from swarm.traffic.outputs import RecordWriter
from swarm.traffic.peers.records import PeerRecords
from swarm.traffic.peers.sightings import Sightings
from swarm.traffic.peers.situation import Situation
from swarm.traffic.reservations.claims import CellClaimer
from swarm.traffic.reservations.route import ALONE, Footprint, RouteProgress
from swarm.traffic.reservations.rules import Reservations

NOW: Final = 1000  # tick
CELLS, WIRE_SETTINGS = squares()
SETTINGS: Final = traffic_settings(WIRE_SETTINGS)
TELLING: Final = RecordWriter("r2", SETTINGS, 1, CELLS.side)


def record(robot: str, *held: int, stamp: int = NOW, **fields: Any) -> Record:  # noqa: ANN401
    """Return the record of a robot that stands in the middle of the first cell that it holds."""
    x, y = CELLS.centre(held[0])
    told = {"goal": held[-1], **fields}
    return Record(robot=robot, stamp=stamp, held=held, **{"x": round(x, 9), "y": round(y, 9), **told})


def said(own: Record, *others: Relayed) -> Broadcast:
    """Return the broadcast that has a record."""
    return Broadcast(
        robot=own.robot, run=1, tick=own.stamp, x=own.x, y=own.y, yaw=0.0, activity=Activity.DRIVE, target=0,
        distance=1.0, reached=[False], traffic=TrafficBroadcast(own=own, others=others),
    )  # fmt: skip


def heard(broadcast: Broadcast | bytes) -> tuple[TrafficBroadcast, Json]:
    """Return the traffic of a broadcast as it comes over the wire, and the vector of both."""
    packed = broadcast if isinstance(broadcast, bytes) else encode(broadcast)
    came = decode(packed, Broadcast, RADIO.limit).traffic
    assert came is not None
    return came, {"hex": packed.hex(), "traffic": msgpack.unpackb(packed)["traffic"]}


def situation(tick: int, head: int, others: Mapping[str, Record], **known: Any) -> Situation:  # noqa: ANN401
    """Return what a robot knows whose head is a cell."""
    fresh = {robot: one for robot, one in others.items() if one.stamp >= tick - SETTINGS.fresh}
    plain = Situation(tick, CELLS, head, -1, others, fresh)
    return plain._replace(**known)


class Case(NamedTuple):
    """What r2 hears, and what it holds, claims and wants next."""

    heard: Sequence[Broadcast]
    held: tuple[int, ...] = (0,)
    claims: tuple[Claim, ...] = ()
    wish: tuple[int, ...] = ()  # the cell of its way after those that it claims


MINE: Final = (Claim(1, 7, NOW - 10),)
ACK: Final = (("r2", 7),)
ALL_ACK: Final = said(record("r1", 2, acks=ACK))


def claims(robot: str, stamp: int, cell: int = 1, **fields: Any) -> Broadcast:  # noqa: ANN401
    """Return what a robot in cell 12 says that claims a cell."""
    return said(record(robot, 12, claims=(Claim(cell, 5, stamp),), **fields))


def seen(robot: str, cell: int, empty: bool, tick: int, **fields: Any) -> Broadcast:  # noqa: ANN401
    """Return what a robot in a cell says that has seen cell 1."""
    return said(record(robot, cell, seen=(Sighting(1, empty, tick),), **fields))


def silent(*sightings: Sighting) -> list[Broadcast]:
    """Return what r3 said from cell 1 long ago, and r1 now."""
    return [said(record("r3", 1, stamp=NOW - 41)), said(record("r1", 2, acks=ACK, seen=sightings))]


def far(cell: int) -> Relayed:
    """Return the record of a robot that is too far to hear, which has acknowledged nothing."""
    return Relayed(1, record("r9", cell, stamp=NOW - 4))


# fmt: off
CASES: Final[dict[str, Case]] = {
    # I acknowledge
    "A claim to a cell that I neither hold nor claim: I acknowledge it.":  Case([claims("r1", 998, 3)]),
    "A claim to a cell that I hold: I do not acknowledge it.":             Case([claims("r1", 900)], held=(0, 1)),
    "A claim older than mine: I acknowledge it, and must not take the cell, although r1 has acknowledged my claim.":
        Case([claims("r1", 989, acks=ACK)], claims=MINE),
    "A claim younger than mine: I do not acknowledge it. r3 has acknowledged mine: I take the cell.":
        Case([claims("r3", 991, acks=ACK)], claims=MINE),
    "A claim of the same tick by r1: the lower id goes first, so I acknowledge it and wait.":
        Case([claims("r1", 990, acks=ACK)], claims=MINE),
    "A claim of the same tick by r10: ids are compared as text, r10 is lower than r2.":
        Case([claims("r10", 990, acks=ACK)], claims=MINE),
    "A claim of the same tick by r3: mine goes first.":
        Case([claims("r3", 990, acks=ACK)], claims=MINE),
    "The claims of a silent robot are acknowledged too, and its older claim counts.":
        Case([said(record("r3", 12, stamp=950, claims=(Claim(1, 5, 940),))), ALL_ACK], claims=MINE),
    # my claim becomes a hold
    "All near have acknowledged my claim: I take the cell.":               Case([ALL_ACK], claims=MINE),
    "My claim is of 8 ticks ago: old enough.":
        Case([ALL_ACK], claims=(Claim(1, 7, NOW - 8),)),
    "My claim is of 7 ticks ago: too young.":
        Case([ALL_ACK], claims=(Claim(1, 7, NOW - 7),)),
    "Another number is acknowledged: nothing.":     Case([said(record("r1", 2, acks=(("r2", 6),)))], claims=MINE),
    "One of two near has not acknowledged: I wait.":              Case([ALL_ACK, said(record("r3", 5))], claims=MINE),
    "r9 has not acknowledged; r1 has relayed its record. It was 7.2 m away, which is near: I wait.":
        Case([said(record("r1", 2, acks=ACK), far(6))], claims=MINE),
    "The same, but r9 was 8.4 m away: it is not near, and I do not wait for it.":
        Case([said(record("r1", 2, acks=ACK), far(7))], claims=MINE),
    "Two claims, both acknowledged: I take both cells in the order of my way.":
        Case([said(record("r1", 4, acks=(*ACK, ("r2", 8))))], claims=(*MINE, Claim(2, 8, NOW - 9))),
    "Two claims, of which the second one is acknowledged: I take none.":
        Case([said(record("r1", 4, acks=(("r2", 8),)))], claims=(*MINE, Claim(2, 8, NOW - 9))),
    # I claim
    "Nobody holds or claims my next cell: I may claim it.":                Case([ALL_ACK], wish=(1,)),
    "r1 claims my next cell: I do not claim it.":                          Case([claims("r1", 998)], wish=(1,)),
    "r1 holds my next cell and is not silent: I may claim it, to get it as soon as it is released.":
        Case([said(record("r1", 1))], wish=(1,)),
    "r1 holds the cell after my next one: I do not claim it yet.":
        Case([said(record("r1", 2))], claims=(Claim(1, 7, NOW - 1),), wish=(2,)),
    # silence
    "r3 was heard 40 ticks ago: it is not silent yet. It holds my next cell, and I wait for its acknowledgement.":
        Case([said(record("r3", 1, stamp=960)), ALL_ACK], claims=MINE),
    "r3 was heard 41 ticks ago: it is silent. It still holds its cell; nobody waits for its acknowledgement.":
        Case(silent(), claims=MINE),
    "A silent robot elsewhere has not acknowledged: nobody waits for it.":
        Case([said(record("r3", 5, stamp=959)), ALL_ACK], claims=MINE),
    "A silent robot holds my next cell: I do not even claim it.":          Case(silent(), wish=(1,)),
    # sightings
    "r1 saw the cell of silent r3 empty after r3 spoke last: r3's hold counts no more.":
        Case(silent(Sighting(1, True, 960)), claims=MINE),
    "r1 saw it empty at the very tick of r3's newest record: that is not later, so r3 holds it.":
        Case(silent(Sighting(1, True, 959)), claims=MINE),
    "r1 saw it empty, but r3 is not silent: r3 holds it.":
        Case([said(record("r3", 1, stamp=970, acks=ACK)), seen("r1", 2, True, 980, acks=ACK)], claims=MINE),
    "r1 saw a body in my next cell less than 400 ticks ago: I do not claim it.":
        Case([seen("r1", 2, False, 601)], wish=(1,)),
    "r1 saw a body there 400 ticks ago: I may claim it.":
        Case([seen("r1", 2, False, 600)], wish=(1,)),
    "r1 saw a body there, r4 saw the cell empty later: the newer sighting counts.":
        Case([seen("r1", 2, False, 900), seen("r4", 3, True, 901)], wish=(1,)),
    "The same, but r4's sighting is of the same tick: it is not newer, and the one heard first stays.":
        Case([seen("r1", 2, False, 900), seen("r4", 3, True, 900)], wish=(1,)),
    # relayed records
    "A record relayed 3 times is heeded: r3's claim is acknowledged.":
        Case([said(record("r1", 2), Relayed(3, record("r3", 5, stamp=990, claims=(Claim(4, 5, 980),))))]),
    "A record relayed 4 times is not heeded.":
        Case([said(record("r1", 2), Relayed(4, record("r3", 5, stamp=990, claims=(Claim(4, 5, 980),))))]),
    "A relayed record that is older than what I heard from r3 itself changes nothing.":
        Case([said(record("r3", 5, stamp=996)), said(record("r1", 2), Relayed(1, record("r3", 5, 4, stamp=992)))]),
    "A relayed record that is newer replaces what I heard from r3 itself.":
        Case([said(record("r3", 5, stamp=992)), said(record("r1", 2), Relayed(1, record("r3", 5, 4, stamp=996)))]),
    "My own record, relayed by r1, is not a record of another robot.":
        Case([said(record("r1", 2), Relayed(1, record("r2", 5, 4, stamp=996)))]),
    # records that cannot be true
    "From 20 ticks later: clocks may differ so much.":                     Case([said(record("r1", 2, stamp=1020))]),
    "From 21 ticks later: dropped.":                                       Case([said(record("r1", 2, stamp=1021))]),
    "It is in a cell that it does not hold: dropped.":                     Case([said(record("r1", 2, x=1.8, y=0.6))]),
    "It claims a cell farther than 5.9 m from it: dropped.":               Case([claims("r1", 990, 17)]),
    "It claims a cell that is not there: dropped.":                        Case([claims("r1", 990, 30)]),
    "It holds 65 cells: dropped.":                                         Case([said(record("r1", *[2, 3] * 32, 2))]),
    "In 4 ticks it went 1.2 m; 1.6 m/s allow 0.82 m: the second record is dropped.":
        Case([said(record("r1", 2, stamp=996)), said(record("r1", 3))]),
    "In 10 ticks it went 1.2 m, which it may: both are taken.":
        Case([said(record("r1", 2, stamp=990)), said(record("r1", 3))]),
    "The same stamp again, with other cells: dropped.":
        Case([said(record("r1", 2)), said(record("r1", 2, 3))]),
}
# fmt: on


def judged(case: Case) -> Json:
    """Return a case with the answer of our robots."""
    peers, sightings = PeerRecords("r2", SETTINGS), Sightings(SETTINGS)
    messages, dropped = [], []
    for broadcast in case.heard:
        traffic, message = heard(broadcast)
        messages.append(message)
        dropped += [event.text for event in peers.merge_broadcasts(NOW, CELLS, [traffic])]
        sightings.merge_sightings(NOW, peers.fresh_records(NOW).values())
    fresh = peers.fresh_records(NOW)
    known = situation(
        NOW, case.held[-1], peers.others, fresh=fresh, blocked=sightings.occupied_cells(),
        cleared=sightings.clear(peers.others, fresh),
    )  # fmt: skip
    reservations = Reservations(case.held, case.claims, 9)
    way = (*(claim.cell for claim in case.claims), *case.wish)
    progress = RouteProgress(reservations, (ALONE,) * len(case.held), way)
    x, y = CELLS.centre(case.held[0])
    body = Footprint(NOW, Pose(x, y, 0.0), case.held[0], frozenset(case.held[:1]))
    after = CellClaimer("r2", SETTINGS).step(progress, None, known, body, ()).progress.reservations
    answer: dict[str, Json] = {
        "newest": {robot: one.stamp for robot, one in peers.others.items()},
        "silent": sorted(peers.silent_records(NOW)),
        "acks": [[*ack] for ack in TELLING._acks(after, peers.others, body.pose)],
        "takes": [*after.held[len(case.held) :]],
    }
    if case.wish:
        answer["may_claim"] = any(claim.cell in case.wish for claim in after.claims)
    if dropped:
        answer["dropped"] = dropped
    state = {"held": [*case.held], "claims": [[*claim] for claim in case.claims], "way": [*way]}
    return {"heard": messages, "state": state, "answer": answer}


def ill_formed() -> list[Json]:
    """Return payloads that are dropped before anybody looks at them, each with the reason."""
    good = msgpack.unpackb(encode(said(record("r1", 2))))
    own = good["traffic"]["own"]
    wrong: dict[str, Json] = {
        "another version": good | {"v": 2},
        "no version": {name: value for name, value in good.items() if name != "v"},
        "a required field is missing": {name: value for name, value in good.items() if name != "yaw"},
        "not a number": good | {"x": float("nan")},
        "text where a number belongs": good | {"tick": "1000"},
        "a cell out of bounds": good | {"traffic": {"own": own | {"held": [-2]}}},
        "a claim with two numbers": good | {"traffic": {"own": own | {"claims": [[1, 5]]}}},
        "an array, no map": [1, "r1"],
    }
    found = []
    for about, message in wrong.items():
        packed = msgpack.packb(message)
        try:
            decode(packed, Broadcast, RADIO.limit)
        except PeerError as fault:
            found.append({"description": about, "hex": packed.hex(), "we_say": str(fault)})
    assert len(found) == len(wrong)
    return found


def records() -> Json:
    """Return the vector of broadcasts heard and of the answer to each."""
    return {
        "description": "What r2 makes of broadcasts that it hears at tick 1000, on the floor of lattice-squares.json. "
        "It is in the middle of cell 0, joined long ago, and has heard nothing before.",
        "fields": {
            "heard": "in this order: the payload, MessagePack as hex, and its field `traffic`",
            "state": "of r2: the cells it holds, its claims (cell, number, stamp), and its way beyond what it holds",
            "newest": "stamp of the newest record that r2 keeps of each robot",
            "silent": "robots that are silent at tick 1000",
            "acks": "what r2 says in its next record: claims that it acknowledges (robot, number), in any order",
            "takes": "claimed cells that it holds from now on",
            "may_claim": "whether it may claim the last cell of its way now",
            "dropped": "a record was not believed; the words are ours",
        },
        "cases": [{"description": about, **judged(case)} for about, case in CASES.items()],
        "ill_formed_description": "Payloads to be dropped as a whole; the words are ours.",
        "ill_formed": ill_formed(),
    }


VECTORS: Final[dict[str, Callable[[], Json]]] = {"records": records}
