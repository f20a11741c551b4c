"""What a replay tells of a tick, of an answer, and of an answer that differs."""

from collections.abc import Mapping
from typing import NamedTuple

from swarm.maps.occupancy import OccupancyMap
from swarm.messages import Broadcast, Command, Event, Sense
from swarm.robot.outputs import Outputs
from world.host.last_messages import Sent
from world.saving.snapshot_file import pack_state
from world.tasks.places import Book
from world.world import World


class Difference(NamedTuple):
    """An answer that the replay does not give again."""

    tick: int
    time: float  # s
    robot: str
    text: str


class Stepped(NamedTuple):
    """One answer of a robot, to the sense of a tick."""

    sense: Sense
    heard: tuple[Broadcast, ...]
    outputs: Outputs | None  # None: of a robot of other code


class ReplayedTick(NamedTuple):
    """What happened in one tick of the world."""

    senses: Mapping[str, Sense]
    steps: list[tuple[str, Command, Stepped | None]]  # in the order in which the world took the answers
    events: list[Event]
    joined: list[str]  # robots whose process has begun


class Life(NamedTuple):
    """What the robots of a world had that was killed: they may have stepped with it, and the world wrote no row."""

    senses: Mapping[int, Mapping[str, Sense]]  # by tick
    broadcasts: Mapping[Sent, Broadcast]


class SavedWorld(NamedTuple):
    """What a world goes on from that was killed."""

    run: int
    edits: int
    floor: OccupancyMap
    places: Book
    state: bytes

    @classmethod
    def of(cls, world: World) -> "SavedWorld":
        """Return what a world can go on from; where bodies touch each other, that changes what it remembers."""
        book, bodies = world.tasks.places, world.bodies
        places = Book(starts=list(book.starts), kinds=list(book.kinds), requests=dict(book.requests))
        return cls(world.run, bodies.edits, bodies.floor, places, pack_state(world.save()))
