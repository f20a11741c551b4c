"""What robots tell each other about traffic: one record a robot, in each of its broadcasts, passed on a few hops.

Everything rides in it: reservations, claims, acknowledgements, calls for a joint plan, the plan itself, progress. So a
lost broadcast only delays, and passing on the newest record of each robot needs no further code. Cells are numbers of
the shared lattice (``swarm.traffic.cells``); ticks are those of the run.
"""

from typing import Annotated, Final, NamedTuple

from msgspec import Meta, Struct

from swarm.messages.fields import Count, Id, Metres, says

Tick = Count
Cell = Annotated[int, Meta(ge=-1, le=2**40)]
Index = Annotated[int, Meta(ge=0, le=2**32)]
MOST_SHUT: Final = 16  # joins told in one refusal


class Epoch(NamedTuple):
    """Names a joint plan; later is newer."""

    tick: Annotated[Tick, says("when its leader began to collect")]
    leader: Annotated[Id, says("who leads")]


class Claim(NamedTuple):
    """A cell that is wanted next."""

    cell: Annotated[Cell, says("which")]
    number: Annotated[Index, says("never used again by the same robot")]
    stamp: Annotated[Tick, says("since when; of two claims the older one goes first")]


class Collect(NamedTuple):
    """A leader's call: these shall stand and say where."""

    epoch: Annotated[Epoch, says("of the plan to come")]
    members: Annotated[tuple[Id, ...], says("whom it calls")]


class Entry(NamedTuple):
    """A turn: an entry into a cell waits until another robot has left a place of its own way."""

    step: Annotated[Index, says("which cell of the own way")]
    robot: Annotated[Id, says("for whom it waits")]
    place: Annotated[Index, says("which cell of that robot's way must have been left")]


class JointPlan(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """Who goes where, and who enters each cell after whom."""

    epoch: Annotated[Epoch, says("its name")]
    ways: Annotated[
        dict[Id, tuple[Cell, ...]], says("cells of each member, from the one it stood in; none twice in a row")
    ]
    after: Annotated[dict[Id, tuple[Entry, ...]], says("the turns that each member waits for")]
    until: Annotated[tuple[Id, ...], says("the others stay where their ways end until these have arrived")] = ()


class Sighting(NamedTuple):
    """A look at a cell that only silent robots keep, or at an unexpected body."""

    cell: Annotated[Cell, says("which")]
    empty: Annotated[bool, says("nothing stands in it")]
    tick: Annotated[Tick, says("when it was seen")]


class Refusal(NamedTuple):
    """A joint plan that a member's own map does not allow."""

    epoch: Annotated[Epoch, says("of that plan")]
    shut: Annotated[
        tuple[tuple[Cell, Cell], ...], Meta(max_length=MOST_SHUT, description="joins of its ways that are shut there")
    ]


class Notice(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """The part of a record that decides who may enter a cell."""

    robot: Annotated[Id, says("whose record")]
    stamp: Annotated[Tick, says("when it was true")]
    held: Annotated[tuple[Cell, ...], says("cells it holds, in the order of its way; the last is the head")] = ()
    claims: Annotated[tuple[Claim, ...], says("cells it wants next")] = ()
    acks: Annotated[
        tuple[tuple[Id, Index], ...], says("claims of others that it does not object to: (robot, claim number)")
    ] = ()


class Record(Notice, frozen=True, kw_only=True, omit_defaults=True):
    """All that one robot tells about its traffic."""

    x: Annotated[Metres, says("m; its middle in the map")]
    y: Annotated[Metres, says("m")]
    goal: Annotated[Cell, says("where it wants to be; -1: nowhere")]
    idle: Annotated[bool, says("wants to be nowhere: makes room, and chooses last where to stand")] = False
    done: Annotated[bool, says("has no stop left: only goes back to where it has to stand")] = False
    wants: Annotated[Tick, says("since when it has had this goal")] = 0
    ahead: Annotated[tuple[Cell, ...], says("of its way, beyond the head")] = ()
    waits: Annotated[tuple[Id, ...], says("robots that it waits for")] = ()
    moved: Annotated[Tick, says("when it last left a cell or got a new one")] = 0
    epoch: Annotated[Epoch | None, says("the joint plan that it follows")] = None
    left: Annotated[Index, says("cells of that plan's way that it has left")] = 0
    entered: Annotated[Index, says("the number, within that way, of its head")] = 0
    frozen: Annotated[Epoch | None, says("stands still for this plan to come")] = None
    need: Annotated[Id | None, says("asks this robot to make a joint plan")] = None
    collect: Annotated[Collect | None, says("whom it calls for a joint plan")] = None
    plan: Annotated[JointPlan | None, says("the joint plan that it has made")] = None
    refusal: Annotated[Refusal | None, says("a joint plan that its own map does not allow")] = None
    listens: Annotated[bool, says("it has just begun or woken and claims nothing yet: who is near speaks up")] = False
    seen: Annotated[tuple[Sighting, ...], says("what it knows of cells by looking, newest first")] = ()


class Relayed(NamedTuple):
    """A record of somebody else that is passed on."""

    hops: Annotated[int, Meta(ge=1, le=16, description="how many times it has been passed on")]
    record: Annotated[Record, says("as it was told")]


class TrafficBroadcast(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """The sender's own record and the newest that it has of others."""

    own: Annotated[Record, says("of the sender")]
    others: Annotated[tuple[Relayed, ...], says("of others, nearest first")] = ()
