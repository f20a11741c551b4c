"""The snapshot of a run, from which a world that was killed goes on bit for bit: tables of what is saved.

A table lists attributes of one object with their types. Saving reads the attributes, restoring sets them.
"""

from collections import Counter
from typing import Any

import numpy as np
from msgspec import Struct

from swarm.errors import ConfigError
from swarm.geometry import Pose
from swarm.messages import (
    BodyReport,
    Command,
    Edit,
    Event,
    Id,
    PackedMap,
    Phase,
    Plan,
    Point,
    Seen,
    State,
    Steering,
)
from world.bodies.sensing import Distances, Errors
from world.bodies.shapes import Contact, PhysicsState
from world.measure.cell_watch import Fault
from world.tasks.orders import Row
from world.tasks.places import Book
from world.tasks.task_pool import Errand
from world.world import World

Noise = np.random.Generator


class Table(Struct, kw_only=True, forbid_unknown_fields=True):
    """Attributes of one object; the names are those of the object."""


class WorldTable(Table):
    """Attributes of `World`."""

    tick: int
    _heard: list[list[tuple[str, int]]]


class BodiesTable(Table):
    """Attributes of `Bodies`."""

    edits: int
    _recent: list[tuple[int, Edit]]
    wheels: list[tuple[float, float]]


class TasksTable(Table):
    """Attributes of `Tasks`."""

    commands: list[Command]


class PlannedTable(Table):
    """Attributes of `Planned`."""

    passed: int


class MissionsTable(Table):
    """Attributes of `Missions`."""

    left: list[int | None]
    reached_at: list[list[float | None]]
    laps: list[int]


class OrdersTable(Table):
    """Attributes of `Orders`."""

    last: int
    rows: list[Row]


class PoolTable(Table):
    """Attributes of `Pool`."""

    given: int
    done: int
    open: dict[str, Errand]
    closed: dict[str, Errand]
    requests: dict[str, list[Point]]


class RecorderTable(Table):
    """Attributes of `Recorder`."""

    _digest: bytes
    _last: list[Pose]
    _ticks: int
    _touched: dict[Contact, int]
    path_length: list[float]
    contact_counts: list[Counter[str]]
    struck: list[int]
    begun: list[tuple[int, Contact, bool]]
    waiting: list[float]
    standing: list[float]
    waits_for: list[dict[str, float]]


class BlameTable(Table):
    """Attributes of `Blame`."""

    before: list[list[Pose]]
    pushed: set[int]


class JudgeTable(Table):
    """Attributes of `ClearanceJudge`."""

    _smallest: float


class VerdictTable(Table):
    """Attributes of `Verdict`."""

    text: str
    _proofs: dict[str, float]


class TrafficTable(Table):
    """Attributes of `TrafficWatch`."""

    _poses: list[Pose]


class WatchTable(Table):
    """Attributes of `swarm.traffic.watch.Watch`."""

    faults: list[Fault]
    conflicts: int
    joint_plans: int
    deadlocks: int
    longest_wait: float
    waiting: dict[str, float]
    least_gap: float
    _running: set[tuple[str, tuple[str, ...]]]
    _still: dict[str, int]
    _waits: dict[str, list[str]]
    _circling: dict[str, int]
    _stuck: set[str]
    _held: dict[str, set[int]]
    _under: dict[str, set[int]]
    _intruders: dict[tuple[str, str], bool]


class ProgressTable(Table):
    """Attributes of `ProgressWatch`."""

    times: list[int]
    longest: list[float]
    _stop: list[int | None]
    _seen: list[set[tuple[int, int]]]
    _since: list[float]
    _stalled: list[bool]


class SteeringTable(Table):
    """Attributes of `SteeringWatch`."""

    _sensed: dict[tuple[int, int], Distances]
    _poses: list[Pose]
    weights: dict[Steering, list[float]]
    _scaled: int
    _scales: float
    labels: list[Steering | None]


class ExternalTable(Table):
    """Attributes of `External`."""

    poses: dict[int, Pose]
    reports: dict[int, BodyReport]
    silent: list[int]


class SensingTable(Table):
    """Attributes of `Sensing`."""

    _noise: list[Noise]
    _errors: list[Errors]


class RadioTable(Table):
    """Attributes of `RadioModel`."""

    _chance: Noise


class WorldState(Table):
    """The state of a world between two ticks."""

    world: WorldTable
    bodies: BodiesTable
    tasks: TasksTable
    planned: PlannedTable
    planned_orders: PlannedTable
    missions: MissionsTable
    orders: OrdersTable
    pool: PoolTable
    recorder: RecorderTable
    blame: BlameTable
    judge: JudgeTable
    verdict: VerdictTable
    traffic: TrafficTable
    watch: WatchTable
    progress: ProgressTable
    steering: SteeringTable
    sensing: SensingTable
    external: ExternalTable
    radio: RadioTable
    physics: PhysicsState


def parts(world: World) -> dict[str, Any]:
    """Return the object of each table in `WorldState`."""
    bodies, tasks, measures = world.bodies, world.tasks, world.measures
    return {
        "world": world,
        "bodies": bodies,
        "tasks": tasks,
        "planned": tasks.planned_edits,
        "planned_orders": tasks.planned_orders,
        "missions": tasks.missions,
        "orders": tasks.missions.orders,
        "pool": tasks.pool,
        "recorder": measures.recorder,
        "blame": measures.recorder.blame,
        "judge": measures.recorder.judge,
        "verdict": measures.verdict,
        "traffic": measures.reservations,
        "watch": measures.reservations.watch,
        "progress": measures.progress,
        "steering": measures.steering,
        "sensing": bodies.sensing,
        "external": bodies.external,
        "radio": world.radio,
    }


class HostState(Table):
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


class Snapshot(Table):
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


def saved(world: World) -> WorldState:
    """Return the state of a world between two ticks; it shares its values with the world."""
    world.settle()
    kinds = WorldState.__annotations__
    tables = {
        name: kinds[name](**{field: getattr(part, field) for field in kinds[name].__struct_fields__})
        for name, part in parts(world).items()
    }
    return WorldState(physics=world.bodies.physics.state, **tables)


def restore(world: World, state: WorldState) -> None:
    """Set a new world of the same scenario, floor, starts and seed to a state.

    Raises:
        ConfigError: the state is of another number of robots or stops, or other bodies are outside.
    """
    was, given = ([world.robots[n] for n in sorted(part.poses)] for part in (state.external, world.bodies.external))
    if was != given:
        raise ConfigError(f"snapshot: --body: expected {was}, as in the run that was saved, got {given}; give the same")
    for name, part in parts(world).items():
        table = getattr(state, name)
        for field in table.__struct_fields__:
            value, now = getattr(table, field), getattr(part, field)
            if isinstance(now, list) and now and len(value) != len(now):
                raise ConfigError(f"snapshot: {name}.{field}: expected {len(now)} values, got {len(value)}")
            setattr(part, field, value)
    world.bodies.physics.restore(state.physics)
    world.bodies.measure()
