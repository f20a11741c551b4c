"""What robots tell each other about traffic: one record a robot, in each of its broadcasts, passed on a few hops.

Everything rides in it: holds, claims, acknowledgements, election, plan, progress. So a lost broadcast only delays, and
passing on the newest record of each robot needs no further code. Cells are numbers of the shared ``CellMap``.
"""

from typing import Annotated, Final, NamedTuple

from msgspec import Meta, Struct

Id = Annotated[str, Meta(pattern=r"^[A-Za-z0-9_.:-]{1,64}\Z")]
Tick = Annotated[int, Meta(ge=0, le=2**53)]
Cell = Annotated[int, Meta(ge=-1, le=2**40)]
Index = Annotated[int, Meta(ge=0, le=2**32)]
MOST_SHUT: Final = 16  # joins told in one refusal
Metres = Annotated[float, Meta(ge=-1e6, le=1e6)]


class Epoch(NamedTuple):
    """Names a joint plan: when its leader began to collect, and who leads; later is newer."""

    tick: Tick
    leader: Id


class Claim(NamedTuple):
    """A cell that is wanted next. The number is never used again by the same robot."""

    cell: Cell
    number: Index
    stamp: Tick


class Collect(NamedTuple):
    """A leader's call: these shall stand and say where."""

    epoch: Epoch
    members: tuple[Id, ...]


class Entry(NamedTuple):
    """An entry into the ``step``-th cell of a way waits until ``robot`` has left the ``place``-th of its own."""

    step: Index
    robot: Id
    place: Index


class JointPlan(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """Who goes where, and who enters each cell after whom."""

    epoch: Epoch
    ways: dict[Id, tuple[Cell, ...]]  # from the cell it stood in; none twice in a row
    after: dict[Id, tuple[Entry, ...]]
    until: tuple[Id, ...] = ()  # the others stay where their ways end until these have arrived


class Sighting(NamedTuple):
    """A look at a cell that only silent robots keep, or at an unexpected body."""

    cell: Cell
    empty: bool
    tick: Tick


class Refusal(NamedTuple):
    """A joint plan that a member's own map does not allow, and joins of its ways that are shut there."""

    epoch: Epoch
    shut: Annotated[tuple[tuple[Cell, Cell], ...], Meta(max_length=MOST_SHUT)]


class Notice(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """The part of a record that decides who may enter a cell."""

    robot: Id
    stamp: Tick  # when it was true
    held: tuple[Cell, ...] = ()  # in the order of its way; the last is the head
    claims: tuple[Claim, ...] = ()
    acks: tuple[tuple[Id, Index], ...] = ()  # claims of others it does not object to: (robot, claim number)


class Record(Notice, frozen=True, kw_only=True, omit_defaults=True):
    """All that one robot tells about its traffic."""

    x: Metres
    y: Metres
    goal: Cell
    idle: bool = False  # wants to be nowhere: makes room, and chooses last where to stand
    done: bool = False  # has no stop left: only goes back to where it has to stand
    wants: Tick = 0  # since when it has had this goal
    ahead: tuple[Cell, ...] = ()  # of its way, beyond the head
    waits: tuple[Id, ...] = ()  # whom it waits for
    moved: Tick = 0  # when it last left a cell or got a new one
    epoch: Epoch | None = None  # the joint plan it follows
    left: Index = 0  # cells of that plan's way it has left
    entered: Index = 0  # the number, within that way, of its head
    frozen: Epoch | None = None  # stands still for this plan to come
    need: Id | None = None  # asks this robot to make a joint plan
    collect: Collect | None = None
    plan: JointPlan | None = None
    refusal: Refusal | None = None
    listens: bool = False  # it has just begun or woken, and claims nothing yet: who is near speaks up
    seen: tuple[Sighting, ...] = ()  # newest first


class Relayed(NamedTuple):
    """A record of somebody else, and how many radio hops it has come."""

    hops: Annotated[int, Meta(ge=1, le=16)]
    record: Record


class TrafficBroadcast(Struct, frozen=True, kw_only=True, omit_defaults=True):
    """The sender's own record and the newest it has of others."""

    own: Record
    others: tuple[Relayed, ...] = ()
