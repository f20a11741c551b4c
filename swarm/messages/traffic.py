"""What robots tell each other about traffic: one record per robot, in each of its broadcasts, relayed a few hops.

A record contains everything: reservations, claims, acknowledgements, calls for a joint plan, the plan itself, progress.
So a lost broadcast only delays, and it is enough to relay the newest record of each robot. Cells are numbers of the
shared lattice (``swarm.traffic.cells``); ticks are those of the run.
"""

from typing import Annotated, Final, NamedTuple

from msgspec import Meta, Struct

from swarm.messages.fields import Count, Id, Metres, Speed, doc

Tick = Count
Cell = Annotated[int, Meta(ge=-1, le=2**40)]
Index = Annotated[int, Meta(ge=0, le=2**32)]
MOST_SHUT: Final = 16  # shut joins listed in one refusal


class Epoch(NamedTuple):
    """The name of a joint plan; a later epoch is newer."""

    tick: Annotated[Tick, doc("when its leader began to collect")]
    leader: Annotated[Id, doc("who leads")]


class Claim(NamedTuple):
    """A request for a reservation: a cell that a robot wants next."""

    cell: Annotated[Cell, doc("which")]
    number: Annotated[Index, doc("never used again by the same robot")]
    stamp: Annotated[Tick, doc("since when; of two claims the older one goes first")]


class Collect(NamedTuple):
    """A leader's call for a joint plan: its members stop and report where they stand."""

    epoch: Annotated[Epoch, doc("of the plan to come")]
    members: Annotated[tuple[Id, ...], doc("robots that it calls")]


class Entry(NamedTuple):
    """A turn: a robot enters a cell of its way only after another robot has left a cell of that robot's way."""

    step: Annotated[Index, doc("index of the cell in the waiting robot's way")]
    robot: Annotated[Id, doc("robot that it waits for")]
    place: Annotated[Index, doc("index of the cell in that robot's way that must be left")]


class JointPlan(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """The way of each member, and the order in which the members enter each cell."""

    epoch: Annotated[Epoch, doc("its name")]
    ways: Annotated[
        dict[Id, tuple[Cell, ...]], doc("way of each member: its cells from the first one; no cell twice in a row")
    ]
    after: Annotated[dict[Id, tuple[Entry, ...]], doc("the turns that each member waits for")]
    until: Annotated[tuple[Id, ...], doc("those who must arrive before the others leave the ends of their ways")] = ()
    through: Annotated[
        bool, doc("ways lead on through targets that members share: who is at the end of its way waits for nobody")
    ] = False


class Sighting(NamedTuple):
    """What a robot saw in a cell that only silent robots reserve, or in one with an unexpected body."""

    cell: Annotated[Cell, doc("which")]
    empty: Annotated[bool, doc("the cell is empty")]
    tick: Annotated[Tick, doc("when it was seen")]


class Moving(NamedTuple):
    """An unexpected obstacle that moves by itself, when a robot last saw it."""

    x: Annotated[Metres, doc("m; its centre in the map")]
    y: Annotated[Metres, doc("m")]
    vx: Annotated[Speed, doc("m/s; its velocity in the map")]
    vy: Annotated[Speed, doc("m/s")]
    tick: Annotated[Tick, doc("when it was seen")]


class Refusal(NamedTuple):
    """A member's refusal of a joint plan that its own map does not allow."""

    epoch: Annotated[Epoch, doc("epoch of that plan")]
    shut: Annotated[
        tuple[tuple[Cell, Cell], ...],
        Meta(
            max_length=MOST_SHUT,
            description="joins that its map lacks, each as two cells (from, to), those of its own way first",
        ),
    ]


class Notice(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """The part of a record that reservations depend on."""

    robot: Annotated[Id, doc("whose record")]
    stamp: Annotated[Tick, doc("tick at which it was true")]
    held: Annotated[tuple[Cell, ...], doc("cells it has reserved, in the order of its way; the last is the head")] = ()
    claims: Annotated[tuple[Claim, ...], doc("cells it wants next")] = ()
    acks: Annotated[
        tuple[tuple[Id, Index], ...], doc("claims of others that it does not object to: (robot, claim number)")
    ] = ()


class Record(Notice, frozen=True, kw_only=True, omit_defaults=True):
    """Everything that one robot tells others about its traffic."""

    x: Annotated[Metres, doc("m; its centre in the map")]
    y: Annotated[Metres, doc("m")]
    error: Annotated[Metres, doc("m; its centre may be so far from (x, y), at most; 0: it is exact")] = 0.0
    speed: Annotated[Speed | None, doc("m/s; how fast its centre moves; none: nobody knows")] = None
    radius: Annotated[
        Metres | None, doc("m; radius of its footprint, also while it carries a load; none: the widest of the fleet's")
    ] = None
    top: Annotated[Speed | None, doc("m/s; the fastest that it drives; none: the fastest of the fleet's")] = None
    goal: Annotated[
        Cell,
        doc(
            "cell it drives to: that of its target; done: of the place where it must stand; idle: where it is; -1: none"
        ),
    ]
    then: Annotated[Cell, doc("cell of the target after that one; -1: there is none")] = -1
    idle: Annotated[
        bool, doc("it has no target left and may stand anywhere: a joint plan may send it wherever there is room")
    ] = False
    done: Annotated[
        bool, doc("it has no target left; unless it is idle, it returns to the place where it must stand")
    ] = False
    wants: Annotated[Tick, doc("tick since which it has had this goal")] = 0
    ahead: Annotated[
        tuple[Cell, ...], doc("cells of its way beyond the head, then those that it needs beside its own at its stop")
    ] = ()
    waits: Annotated[tuple[Id, ...], doc("robots that it waits for")] = ()
    moved: Annotated[Tick, doc("tick at which it last left a cell or got a new one")] = 0
    epoch: Annotated[Epoch | None, doc("the joint plan that it follows")] = None
    left: Annotated[Index, doc("cells of that plan's way that it has left")] = 0
    entered: Annotated[Index, doc("index of its head in that way")] = 0
    frozen: Annotated[Epoch | None, doc("the joint plan to come, for which it stands still")] = None
    need: Annotated[Id | None, doc("the robot that it asks to make a joint plan")] = None
    collect: Annotated[Collect | None, doc("its call for a joint plan")] = None
    plan: Annotated[JointPlan | None, doc("the joint plan that it has made")] = None
    refusal: Annotated[Refusal | None, doc("its refusal of a joint plan")] = None
    stands: Annotated[bool, doc("it was told to stop: it stays until it is told to go on")] = False
    listens: Annotated[bool, doc("it has just started or woken and claims nothing yet; robots near it answer")] = False
    seen: Annotated[tuple[Sighting, ...], doc("what it has seen in cells, newest first")] = ()
    moving: Annotated[tuple[Moving, ...], doc("unexpected obstacles that it has lately seen to move")] = ()


class Relayed(NamedTuple):
    """A record of another robot that the sender relays."""

    hops: Annotated[int, Meta(ge=1, le=16, description="how many times it has been relayed")]
    record: Annotated[Record, doc("that record, unchanged")]


class TrafficBroadcast(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """The sender's own record and the newest ones that it has of others."""

    own: Annotated[Record, doc("the sender's own record")]
    others: Annotated[tuple[Relayed, ...], doc("records of others, nearest robot first")] = ()
