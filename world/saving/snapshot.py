"""The snapshot of a run, from which a world that was killed goes on bit for bit."""

from msgspec import Struct

from swarm.messages import Event, Id, PackedMap, Phase, Plan, Seen, State
from world.tasks.places import Book
from world.world import WorldState


class HostState(Struct, kw_only=True, forbid_unknown_fields=True):
    """The state of a world's process beside the world."""

    phase: Phase
    held: bool
    reason: str
    lost: list[str]
    wall_time: float  # s
    present: list[str]  # robots
    most_in_one: int
    late: int
    states: dict[str, State]
    plans: dict[str, Plan]
    events: list[Event]  # the last ones
    seen: dict[str, Seen]
    left: set[str]
    tick_bins: list[int]
    tick_longest: float  # s
    not_reproducible: list[str]
    pressed: dict[str, str]


class Snapshot(Struct, kw_only=True, forbid_unknown_fields=True):
    """All that a world's process needs to go on with a run."""

    scenario: str  # hash of settings, profile and map at the start
    robots: int  # of the scenario
    places: Book  # of more robots
    seed: int
    identity: Id  # of the run's world
    run: int
    floor: PackedMap | None  # None: it is as in the scenario
    state: WorldState
    host: HostState
