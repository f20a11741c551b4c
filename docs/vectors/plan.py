"""The test vectors of joint plans: whose turn it is, who stays at the end of its way, who stands for a call."""

from collections.abc import Callable, Sequence
from typing import Any, Final

import msgpack
from msgspec.structs import replace

from docs.vectors.records import CELLS, NOW, SETTINGS, heard, record, said, situation
from docs.vectors.writing import Json
from swarm.bus.codec import encode
from swarm.messages import Broadcast
from swarm.messages.traffic import Collect, Entry, Epoch, JointPlan, Record, Relayed
from swarm.traffic.joint.protocol import JointPlanning
from swarm.traffic.joint.states import FollowedPlan
from swarm.traffic.mapf.precedence import order_of
from swarm.traffic.peers.records import PeerRecords
from swarm.traffic.reservations.route import RouteProgress
from swarm.traffic.reservations.rules import Reservations

EPOCH: Final = Epoch(980, "r1")
ORDER: Final = order_of([(0, 2, 22), (1, 12, 21), (2, 22, 11), (3, 22, 1)])
MEMBERS: Final = ("r1", "r2", "r3")
PLAN: Final = JointPlan(
    epoch=EPOCH,
    ways=dict(zip(MEMBERS, ORDER.ways, strict=True)),
    after={
        robot: tuple(Entry(step, MEMBERS[first], place) for step, (first, place) in after.items())
        for robot, after in zip(MEMBERS, ORDER.after, strict=True)
    },
    until=("r1",),
)


def follows(robot: str, left: int, stamp: int = 1040, **fields: Any) -> Record:  # noqa: ANN401
    """Return what a robot says that has left some cells of its way."""
    way = PLAN.ways[robot]
    told = {"epoch": EPOCH, "left": left, "entered": left, "goal": way[-1], **fields}
    return record(robot, way[left], stamp=stamp, **told)


def without(robot: str, stamp: int, **fields: Any) -> Record:  # noqa: ANN401
    """Return what a robot says that does not follow the plan."""
    return record(robot, PLAN.ways[robot][0], stamp=stamp, **fields)


# fmt: off
MOMENTS: Final[dict[str, tuple[int, list[Record]]]] = {  # tick, the newest records
    "All follow, nobody has moved.":               (1040, [follows("r1", 0), follows("r2", 0), follows("r3", 0)]),
    "r2 has left cell 2, the first of its way.":   (1040, [follows("r1", 0), follows("r2", 1), follows("r3", 0)]),
    "r3 has left cell 22.":                        (1040, [follows("r1", 1), follows("r2", 1), follows("r3", 1)]),
    "r1 has left cell 1, the second of its way.":  (1040, [follows("r1", 2), follows("r2", 2), follows("r3", 2)]),
    "r2 does not follow, but its record is of at most 20 ticks after we adopted the plan: it may still adopt it.":
        (1040, [follows("r1", 0), without("r2", 1020), follows("r3", 0)]),
    "r2 does not follow, and its record is of 21 ticks after: the reservations alone decide.":
        (1040, [follows("r1", 0), without("r2", 1021), follows("r3", 0)]),
    "r2 still stands for the call of this plan.":
        (1040, [follows("r1", 0), without("r2", 1036, frozen=EPOCH), follows("r3", 0)]),
    "r2 follows a newer plan.":
        (1010, [follows("r1", 0, 1008), without("r2", 1008, epoch=Epoch(990, "r3")), follows("r3", 0, 1008)]),
    "r2 follows a plan of the same tick by a higher leader, which is newer.":
        (1010, [follows("r1", 0, 1008), without("r2", 1008, epoch=Epoch(980, "r3")), follows("r3", 0, 1008)]),
    "r2 has been silent for 140 ticks.":
        (1180, [follows("r1", 0, 1178), follows("r2", 0), follows("r3", 0, 1178)]),
    "r2 has been silent for 141 ticks: the reservations alone decide.":
        (1181, [follows("r1", 0, 1178), follows("r2", 0), follows("r3", 0, 1178)]),
    "r2 was never heard.":                         (1040, [follows("r1", 0), follows("r3", 0)]),
}
ENDS: Final[dict[str, tuple[str, int, int, list[Record]]]] = {  # who, its goal, tick, the newest records of others
    "r1, of `until`, has one cell to go.":                   ("r3", 25, 1040, [follows("r1", 2)]),
    "r1 has come to the end of its way.":                    ("r3", 25, 1040, [follows("r1", 3)]),
    "r1 does not follow, but may still adopt the plan.":     ("r3", 25, 1040, [without("r1", 1020)]),
    "r1 does not follow, 21 ticks after.":                   ("r3", 25, 1040, [without("r1", 1021)]),
    "r1 is silent.":                                         ("r3", 25, 1081, [follows("r1", 1)]),
    "r1's way ends at my goal, and it wants to be there.":   ("r2", 3, 1040, [follows("r1", 3)]),
    "r1's way ends at my goal, but its goal is elsewhere.":  ("r2", 3, 1040, [follows("r1", 3, goal=8)]),
    "r1's way ends at my goal; it is idle.":                 ("r2", 3, 1040, [follows("r1", 3, idle=True)]),
    "r1's way ends at my goal; it is done and there.":       ("r2", 3, 1040, [follows("r1", 3, done=True)]),
    "The end of my way is my goal.":                         ("r3", 1, 1040, []),
}
# fmt: on


def following(me: str, *, through: bool = False) -> FollowedPlan:
    """Return a robot's part in the plan, adopted at tick 1000."""
    plan = replace(PLAN, through=through)
    return FollowedPlan(me, plan, MEMBERS, NOW, SETTINGS.absent, {entry.step: entry for entry in PLAN.after[me]})


def plain(one: Record) -> Json:
    """Return a record as it is unpacked."""
    return msgpack.unpackb(encode(said(one)))["traffic"]["own"]


def waits(me: str, tick: int, records: Sequence[Record]) -> Json:
    """Return for each cell of a robot's way, by index, whom it waits for before it enters it."""
    known = situation(tick, PLAN.ways[me][0], {one.robot: one for one in records if one.robot != me})
    return {str(step): following(me).waits_for(step, known) for step in range(1, len(PLAN.ways[me]))}


def stays(me: str, goal: int, tick: int, records: Sequence[Record], *, through: bool = False) -> bool:
    """Return True if a robot at the end of its way stays in the plan."""
    end = PLAN.ways[me][-1]
    progress = RouteProgress(Reservations((end,)), (len(PLAN.ways[me]) - 1,), following=True)
    known = situation(tick, end, {one.robot: one for one in records}, goal=goal)
    return following(me, through=through).keeps(progress, known)


def plan() -> Json:
    """Return the vector of a joint plan."""
    moments = [
        {
            "description": about,
            "tick": tick,
            "records": [plain(one) for one in records],
            "waits_for": {me: waits(me, tick, records) for me in MEMBERS},
        }
        for about, (tick, records) in MOMENTS.items()
    ]
    ends = [
        {
            "description": about,
            "me": me,
            "goal": goal,
            "tick": tick,
            "records": [plain(one) for one in records],
            "stays": stays(me, goal, tick, records),
            "stays_if_through": stays(me, goal, tick, records, through=True),
        }
        for about, (me, goal, tick, records) in ENDS.items()
    ]
    return {
        "description": "A joint plan of three robots on the floor of lattice-squares.json, in r1's broadcast.",
        "broadcast": heard(said(record("r1", 0, plan=PLAN, collect=Collect(EPOCH, MEMBERS))))[1],
        "adopted": NOW,
        "moments_description": "Each member has adopted the plan at tick `adopted`. `waits_for`: for the cells of its "
        "way, by index, the robot that must leave its cell first, with `records` as the newest ones; null: none.",
        "moments": moments,
        "ends_description": "`me` is in the last cell of its way, holds nothing else, and its goal is `goal`. `stays`: "
        "it stays in the plan; `stays_if_through`: it would if the plan said `through`.",
        "ends": ends,
    }


# --- calls ---

LOWER, HIGHER, LATER, AGAIN = Epoch(1000, "r1"), Epoch(996, "r2"), Epoch(1008, "r2"), Epoch(1030, "r1")
MADE: Final = replace(PLAN, epoch=LOWER)
SHUT: Final = replace(MADE, ways={"r1": (4, 14, 24), "r2": (2, 12), "r3": (22, 23, 24, 14)}, after={}, until=())


def calls(epoch: Epoch, stamp: int, *members: str, **fields: Any) -> Record:  # noqa: ANN401
    """Return the record of a leader that calls."""
    return record(
        epoch.leader, 0 if epoch.leader == "r1" else 2, stamp=stamp, collect=Collect(epoch, members), **fields
    )


def silence(stamp: int, **fields: Any) -> Record:  # noqa: ANN401
    """Return a record of r1 without a call."""
    return record("r1", 0, stamp=stamp, **fields)


def with_nulls(broadcast: Broadcast) -> bytes:
    """Return a payload whose record has null where nothing is to say."""
    message = msgpack.unpackb(encode(broadcast))
    absent = ("epoch", "frozen", "need", "collect", "plan", "refusal")
    message["traffic"]["own"] = dict.fromkeys(absent) | message["traffic"]["own"]
    packed: bytes = msgpack.packb(message)
    return packed


STORIES: Final[dict[str, list[tuple[str, int, Broadcast | bytes | None]]]] = {
    "Calls of two leaders, and a plan that r2 relays.": [
        ("r2 calls others: nothing.", 996, said(calls(HIGHER, 996, "r1"))),
        ("r2 calls me: I stand.", 1000, said(calls(HIGHER, 1000, "r1", "r3"))),
        ("r1 calls me too: I stand for the lower id.", 1004, said(calls(LOWER, 1004, "r2", "r3"))),
        ("r2 calls again, later: I stand for the lower id still.", 1008, said(calls(LATER, 1008, "r1", "r3"))),
        (
            "r2 relays r1's record, which has the plan: I follow it.",
            1012,
            said(record("r2", 2, stamp=1012), Relayed(1, silence(1010, plan=MADE))),
        ),
        ("r1's old call comes once more: I have stood for it.", 1016, said(calls(LOWER, 1016, "r2", "r3"))),
        ("r1 calls again: I stand, and still follow.", 1030, said(calls(AGAIN, 1030, "r2", "r3"))),
        ("r1 has given that call up: I go on.", 1034, said(silence(1034))),
    ],
    "A call that is given up by a robot that says null for what it has not.": [
        ("r1 calls me.", 1004, with_nulls(said(calls(LOWER, 1004, "r2", "r3")))),
        ("r1 calls no more: I go on.", 1008, with_nulls(said(silence(1008)))),
    ],
    "A call that lasts too long.": [
        ("r1 calls me.", 1004, said(calls(LOWER, 1004, "r3"))),
        ("200 ticks later it still calls: I stand.", 1204, said(calls(LOWER, 1204, "r3", moved=1))),
        ("After 201 ticks I go on.", 1205, None),
        ("It goes on calling: never again for this call.", 1208, said(calls(LOWER, 1208, "r3", moved=1))),
    ],
    "A leader that falls silent.": [
        ("r1 calls me.", 1004, said(calls(LOWER, 1004, "r3"))),
        ("40 ticks later: it is not silent yet.", 1044, None),
        ("41 ticks later: I go on.", 1045, None),
    ],
    "A plan over a join that my map lacks: I refuse it, and name the joins of my way first.": [
        ("r1 calls me.", 1004, said(calls(LOWER, 1004, "r2", "r3"))),
        ("The plan comes.", 1008, said(silence(1008, plan=SHUT))),
    ],
    "A plan that does not begin at my head: I do not follow it.": [
        ("r1 calls me.", 1004, said(calls(LOWER, 1004, "r2", "r3"))),
        ("The plan comes.", 1008, said(silence(1008, plan=replace(MADE, ways={**MADE.ways, "r3": (12, 22)})))),
    ],
}


def told(events: Sequence[tuple[str, int, Broadcast | bytes | None]]) -> list[Json]:
    """Return what r3 says after each event, in cell 22."""
    peers, joint, found = PeerRecords("r3", SETTINGS), JointPlanning("r3", SETTINGS), []
    for about, tick, broadcast in events:
        traffic, message = heard(broadcast) if broadcast is not None else (None, None)
        assert not peers.merge_broadcasts(tick, CELLS, [traffic] if traffic is not None else [])
        joint.handle_occasion(situation(tick, 22, peers.others))
        refusal = joint.refusal_to_tell(tick)
        answer = {"frozen": joint.call_epoch, "epoch": joint.epoch, "refusal": refusal}
        found.append(
            {"description": about, "tick": tick, "heard": message, "answer": msgpack.unpackb(msgpack.packb(answer))}
        )
    return found


def all_calls() -> Json:
    """Return the vector of calls for joint plans."""
    return {
        "description": "What r3 says of joint plans after each event of some stories, on the floor of "
        "lattice-squares.json. It holds cell 22 only. Each story begins anew. `heard`: the broadcast that comes at "
        "that tick; null: none. `frozen`, `epoch` and `refusal` are those of its record.",
        "stories": [{"description": about, "events": told(events)} for about, events in STORIES.items()],
    }


VECTORS: Final[dict[str, Callable[[], Json]]] = {"plan": plan, "calls": all_calls}
