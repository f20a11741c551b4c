"""The recorder's numbers for ticks that are made by hand."""

import hashlib
import struct
from collections.abc import Sequence
from math import inf, nextafter, pi

import pytest

from swarm.geometry import Pose
from swarm.maps.text import from_text
from swarm.messages import Activity
from tests.shared import scenario_of
from tests.world.shared import command
from world.bodies.roster import Roster
from world.bodies.shapes import Contact
from world.measure.contact_cause import MOVES
from world.measure.recorder import PARTED, Recorder

SCENARIO = scenario_of()
DT = 0.25  # s; sums of it are exact
A, B = Pose(2.5, 2.5, 0.0), Pose(4.5, 4.5, 1.0)
WALL, OTHER, BOX = Contact(0, "wall", None), Contact(0, "robot", 1), Contact(0, "obstacle", None)
STANDS = (0.0, 0.0)


def unfed(starts: Sequence[Pose], dt: float) -> Recorder:
    roster = Roster(SCENARIO, [f"r{number}" for number in range(1, len(starts) + 1)])
    return Recorder(SCENARIO, roster, starts, dt)


def recorder(*starts: Pose, dt: float = DT) -> Recorder:
    poses = starts or (A,)
    record = unfed(poses, dt)
    record.poses(poses)
    return record


# --- contacts ---

LET_GO = round(PARTED / DT)  # ticks after which a touch is a new one

# fmt: off
TOUCHES: dict[str, tuple[list[int], list[int], list[int]]] = {  # ticks of a begin, of touching on; those that count
    "once":                               ([3],                       [],              [3]),
    "in the first tick":                  ([0],                       [],              [0]),
    "again too soon":                     ([3, 3 + LET_GO - 1],       [],              [3]),
    "again when it had let go":           ([3, 3 + LET_GO],           [],              [3, 3 + LET_GO]),
    "trembles":                           ([3, 5, 7, 9, 11],          [],              [3]),
    "trembles, lets go, comes again":     ([3, 5, 7, 7 + LET_GO],     [],              [3, 7 + LET_GO]),
    "pressed for long, then again soon":  ([3, 12],                   list(range(4, 12)), [3]),
    "pressed for long, then lets go":     ([3, 11 + LET_GO],          list(range(4, 12)), [3, 11 + LET_GO]),
}
# fmt: on


@pytest.mark.parametrize("name", TOUCHES)
def test_a_touch_counts_when_it_begins_and_was_let_go_of_before(name: str) -> None:
    begins, lasting, counting = TOUCHES[name]
    record = recorder()
    counted = []
    for tick in range(30):
        record.poses([A])
        touching = [WALL] if tick in begins or tick in lasting else []
        fresh = record.contacts([WALL] if tick in begins else [], touching, [STANDS], [A])
        counted += [tick] * len(fresh)
    assert counted == counting
    assert record.counts.contact_counts[0] == {"wall": len(counting)}


def test_contacts_are_each_robots_own_and_of_a_kind() -> None:
    record = recorder(A, B)
    both = [WALL, OTHER, Contact(1, "robot", 0), BOX]
    assert record.contacts(both, both, [STANDS, STANDS], [A, B]) == both
    assert [dict(counts) for counts in record.counts.contact_counts] == [
        {"wall": 1, "robot": 1, "obstacle": 1},
        {"robot": 1},
    ]


@pytest.mark.parametrize(
    ("wheels", "struck"),
    [
        ((0.0, 0.0), 1),
        ((0.5, -0.5), 1),  # turns on the spot: its round body goes nowhere
        ((MOVES, MOVES), 1),
        ((MOVES * 1.1, MOVES * 1.1), 0),
        ((-MOVES * 1.1, -MOVES * 1.1), 0),
        ((MOVES * 3, 0.0), 0),
        ((0.0, MOVES * 1.5), 1),
        ((0.5, 0.5), 0),
    ],
)
def test_who_stands_is_struck(wheels: tuple[float, float], struck: int) -> None:
    record = recorder(A, B)
    record.contacts([WALL], [WALL], [wheels, (1.0, 1.0)], [A, B])
    assert record.counts.struck == [struck, 0]


def test_a_touch_that_does_not_count_strikes_nobody() -> None:
    record = recorder()
    for _ in range(3):
        record.poses([A])
        record.contacts([WALL], [WALL], [STANDS], [A])
    assert record.counts.struck == [1]


# --- ways and gaps ---


def test_the_way_is_the_sum_of_the_steps_of_each() -> None:
    record = recorder(A, B)
    for pose in ((2.8, 2.9), (2.8, 2.9), (2.5, 2.5)):
        record.poses([Pose(*pose, 0.0), B._replace(yaw=2.0)])
    assert record.counts.path_length == pytest.approx([1.0, 0.0])


def test_the_smallest_gap_is_of_all_ticks_and_of_the_floor_of_its_time() -> None:
    record = recorder()
    record.poses([Pose(1.5, 2.5, 0.0)])  # 0.5 m off the wall, of which 0.2 are its own
    record.poses([A])
    assert record.judge.smallest == pytest.approx(0.3)
    walled = from_text("####\n####\n#..#\n#.##\n####\n####\n", 1.0)  # a wall on the right at x = 2, two rows up
    record.judge.set_floor(walled)
    record.poses([Pose(1.7, 2.5, 0.0)])
    assert record.judge.smallest == pytest.approx(0.1)
    beside = recorder(A, A._replace(x=A.x + 0.45))
    assert beside.judge.smallest == pytest.approx(0.05)


# --- waiting ---

GO, WAIT, SHUT, DONE, READY = (
    Activity.DRIVE, Activity.GIVE_WAY, Activity.BLOCKED, Activity.DONE, Activity.READY,
)  # fmt: skip

# fmt: off
WAITS: dict[str, tuple[list[Activity], int]] = {  # ticks waited
    "nobody":                         ([GO, READY, DONE],              0),
    "once":                           ([GO, WAIT, WAIT, GO],           2),
    "twice":                          ([WAIT, WAIT, WAIT, GO, WAIT],   4),
    "shut in":                        ([SHUT, SHUT, SHUT],             3),
    "gives way and is shut in":       ([WAIT, SHUT, WAIT],             3),
}
# fmt: on


@pytest.mark.parametrize("name", WAITS)
def test_who_gives_way_or_has_no_way_waits(name: str) -> None:
    activities, ticks = WAITS[name]
    record = recorder(A, B)
    for activity in activities:
        record.record_activities([command(activity=activity), command()])
    assert record.counts.waiting == [ticks * DT, 0.0]


def test_who_stands_is_told_by_the_wheels_and_only_with_a_stop_left() -> None:
    record = recorder(A, B)
    record.record_standing([0, None], [(0.0, 0.0), (0.0, 0.0)])
    record.record_standing([0, 1], [(0.2, -0.2), (0.0, 0.005)])  # one that turns in place does not stand
    assert record.counts.standing == [DT, DT]


# --- the digest ---

HISTORY = [[A, B], [Pose(2.6, 2.5, 0.1), B], [Pose(2.7, 2.5, -0.1), Pose(4.5, 4.5, pi)]]


def digest(history: Sequence[Sequence[Pose]]) -> str:
    record = unfed(history[0], DT)
    for poses in history:
        record.poses(poses)
    return record.digest


def test_the_digest_is_of_every_pose_in_order() -> None:
    chain = bytes(16)
    for poses in HISTORY:
        plain = struct.pack("<6d", *(number for pose in poses for number in pose))
        chain = hashlib.blake2b(chain + plain, digest_size=16).digest()
    assert digest(HISTORY) == chain.hex()


def test_one_bit_of_one_number_of_one_pose_changes_the_digest() -> None:
    digests = {digest(HISTORY)}
    for tick in range(3):
        for robot in range(2):
            for field in range(3):
                history = [list(poses) for poses in HISTORY]
                numbers = list(history[tick][robot])
                numbers[field] = nextafter(numbers[field], inf)
                history[tick][robot] = Pose(*numbers)
                digests.add(digest(history))
    digests.add(digest(HISTORY[:2]))
    digests.add(digest([poses[::-1] for poses in HISTORY]))
    assert len(digests) == 1 + 3 * 2 * 3 + 2
