"""What the measures keep between two ticks, as a snapshot saves it. Each measure changes its own state.

The states are apart from the measures, because a compiled class loses the options of msgspec's types.
"""

from collections import Counter
from collections.abc import Sequence
from math import inf
from typing import NamedTuple

from msgspec import Struct

from swarm.geometry import Pose
from swarm.messages import Steering
from world.bodies.sensors import FreeDistances
from world.bodies.shapes import Contact


class ArrayState(Struct, array_like=True, forbid_unknown_fields=True):
    """Base of all states: a snapshot has the fields alone, in their order."""


class RecorderState(ArrayState, kw_only=True):
    """The state of `Recorder`."""

    digest: bytes = bytes(16)
    last: Sequence[Pose]
    ticks: int = 0
    touched: dict[Contact, int] = {}  # the tick at which each contact was seen last
    path_length: list[float] = []  # m
    contact_counts: list[Counter[str]] = []
    struck: list[int] = []  # contacts while the robot stood still: no braking could have prevented them
    begun: list[tuple[int, Contact, bool]] = []  # each contact: its tick, could the robot have avoided it
    waiting: list[float] = []  # s
    standing: list[float] = []  # s, with a stop left
    waits_for: list[dict[str, float]] = []  # s, for each robot waited for
    before: list[Sequence[Pose]] = []  # of all robots in the last ticks, oldest first
    pushed: set[int] = set()  # robots that an obstacle touched, and that have touched something ever since
    smallest: float = inf  # m, of `ClearanceJudge`


class ReservationFault(NamedTuple):
    """A violation of reservations, when it began."""

    tick: int
    kind: str  # "overlap", "outside", "contact", "intrusion"
    robots: tuple[str, ...]
    where: tuple[int, ...]  # cells


class WatchState(ArrayState, kw_only=True):
    """What `TrafficWatch` has found and counted."""

    faults: list[ReservationFault] = []
    conflicts: int = 0  # times a robot began to wait for another
    joint_plans: int = 0
    deadlocks: int = 0  # times robots that stood waited for each other in a circle for 10 s
    longest_wait: float = 0.0  # s
    waiting: dict[str, float] = {}  # s, of each robot, total
    least_gap: float = inf  # m, between two bodies
    running: set[tuple[str, tuple[str, ...]]] = set()
    still: dict[str, int] = {}  # ticks since its last progress, while it wants to move
    waits: dict[str, Sequence[str]] = {}
    circling: dict[str, int] = {}  # ticks in a circle of waits among robots that stand
    stuck: set[str] = set()
    held: dict[str, set[int]] = {}  # what each held a tick ago
    under: dict[str, set[int]] = {}  # cells that each mute robot was in a tick ago
    intruders: dict[tuple[str, str], bool] = {}  # (mute, holder): the mute one drove in


class TrafficState(ArrayState, kw_only=True):
    """The state of `TrafficWatch`."""

    poses: Sequence[Pose]
    watch: WatchState


class ProgressState(ArrayState, kw_only=True):
    """The state of `ProgressWatch`, by the robots' numbers."""

    times: list[int] = []  # how often each has stalled
    longest: list[float] = []  # s, longest time without progress
    stop: list[int | None] = []
    seen: list[set[tuple[int, int]]] = []  # squares since the stop is the next one
    since: list[float] = []  # s, when each made progress last
    stalled: list[bool] = []


class SteeringState(ArrayState, kw_only=True):
    """The state of `SteeringWatch`."""

    sensed: dict[tuple[int, int], FreeDistances] = {}  # in the last ticks, by robot and tick
    poses: Sequence[Pose]
    weights: dict[Steering, list[float]]  # robot ticks, m, rad
    scaled: int = 0  # robot ticks in which distances were scaled
    scales: float = 0.0  # sum of their scales
    labels: list[Steering | None]  # of the last tick; None: no command is in force


class VerdictState(ArrayState, kw_only=True):
    """The state of `Verdict`."""

    text: str = ""  # the last verdict on a jam
    proofs: dict[str, float] = {}  # robot -> when it first said that its jam has no solution [s]
    told: dict[str, str] = {}  # robot -> the last proof that it told, which is no news a second time


class MeasuresState(NamedTuple):
    """The state of `Measures`."""

    recorder: RecorderState
    reservations: TrafficState
    progress: ProgressState
    steering: SteeringState
    verdict: VerdictState
