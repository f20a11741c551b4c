"""Peer records: they are merged and relayed, and are not trusted blindly."""

from dataclasses import replace as replaced

import pytest
from msgspec.structs import replace

from swarm.messages.traffic import Claim, Record, Relayed, TrafficBroadcast
from swarm.traffic.peers.records import SKEW, SLACK, PeerRecords
from swarm.traffic.settings import TrafficConstants
from tests.traffic.maps import DOOR

CELLS = DOOR.cells
A, B = DOOR.at("ab")
SETTINGS = TrafficConstants()


def record(stamp: int, robot: str = "r1", cell: int = A, held: tuple[int, ...] | None = None) -> Record:
    x, y = CELLS.centre(cell)
    return Record(robot=robot, stamp=stamp, x=x, y=y, goal=B, held=(cell,) if held is None else held)


def told(*records: Record, hops: int = 1) -> TrafficBroadcast:
    return TrafficBroadcast(own=records[0], others=tuple(Relayed(hops, other) for other in records[1:]))


def kinds(peers: PeerRecords, tick: int, *broadcasts: TrafficBroadcast) -> list[str]:
    return [event.text for event in peers.merge_broadcasts(tick, CELLS, broadcasts)]


def test_the_newest_record_wins_whichever_way_it_came() -> None:
    peers = PeerRecords("r0", SETTINGS)
    assert kinds(peers, 10, told(record(8, "r2"), record(9))) == []
    assert peers.others["r1"].stamp == 9
    assert kinds(peers, 11, told(record(8))) == []
    assert peers.others["r1"].stamp == 9
    assert list(peers.others) == ["r1", "r2"]


def test_records_travel_so_many_hops_and_no_farther() -> None:
    peers = PeerRecords("r0", SETTINGS)
    far = SETTINGS.fresh + 10  # both are silent then
    peers.merge_broadcasts(10, CELLS, [told(record(9, "r2"), record(9), hops=SETTINGS.hops)])
    assert "r1" in peers.others
    assert [relayed.record.robot for relayed in peers.relay(far, 0.0, 0.0)] == ["r2"]
    peers = PeerRecords("r0", SETTINGS)
    peers.merge_broadcasts(10, CELLS, [told(record(9, "r2"), record(9), hops=SETTINGS.hops + 1)])
    assert "r1" not in peers.others


def test_a_silent_robot_is_remembered_but_not_fresh() -> None:
    peers = PeerRecords("r0", SETTINGS)
    peers.merge_broadcasts(10, CELLS, [told(record(9))])
    assert list(peers.fresh_records(40)) == ["r1"]
    assert list(peers.fresh_records(60)) == []
    assert peers.others["r1"].held == (A,)


def test_lies_are_named_and_dropped() -> None:
    def refusal(lie: Record) -> str:
        peers = PeerRecords("r0", SETTINGS)
        assert kinds(peers, 100, told(record(90))) == []
        texts = kinds(peers, 101, told(lie))
        assert peers.others["r1"].stamp == 90
        return " ".join(texts)

    assert "far from where it is" in refusal(record(95, held=(A, B)))
    assert "far from where it is" in refusal(replace(record(95), claims=(Claim(B, 1, 90),)))
    assert "jumped" in refusal(record(95, cell=B))
    assert "does not hold" in refusal(record(95, held=(A + 1,)))
    assert "not there" in refusal(record(95, held=(A, 10_000)))
    assert "from the future" in refusal(record(200))
    assert "again" in refusal(record(90))


def test_two_robots_of_one_id_are_noticed() -> None:
    peers = PeerRecords("r0", SETTINGS)
    assert "uses my id" in kinds(peers, 10, told(record(9, "r0")))[0]
    assert kinds(peers, 10, told(record(9, "r2"), record(9))) == []
    texts = kinds(peers, 11, told(replace(record(9), goal=A)))
    assert "two different records" in texts[0]


def test_the_same_fault_is_told_once_in_a_while() -> None:
    peers = PeerRecords("r0", SETTINGS)
    texts = [text for tick in range(10, 60) for text in kinds(peers, tick, told(record(tick, "r0")))]
    assert len(texts) == 1


def test_after_sleep_a_silent_robot_may_have_got_on() -> None:
    peers = PeerRecords("r0", SETTINGS)
    peers.merge_broadcasts(10, CELLS, [told(replace(record(9), ahead=(A + 1, A + 2)))])
    peers.note_wake(110)
    peers.merge_broadcasts(110, CELLS, [])
    assert set(peers.others["r1"].held) == {A, A + 1, A + 2}
    peers.merge_broadcasts(120, CELLS, [told(record(119))])
    assert peers.others["r1"].held == (A,)


AHEAD = tuple(range(A + 1, A + 6))

# fmt: off
SLEPT = {  # tick of a record, of waking, of asking: how many cells of its way the robot may have taken meanwhile
    "silent before and since":          (9,   110, 110, SETTINGS.horizon),
    "spoke after I woke":               (115, 110, 200, 0),
    "spoke in the tick in which I woke": (110, 110, 200, 0),
    "not silent yet":                   (9,   30,  9 + SETTINGS.fresh, 0),
    "just silent":                      (9,   30,  10 + SETTINGS.fresh, SETTINGS.horizon),
    "I never slept":                    (0,   0,   200, 0),
    "I woke at the second tick":        (0,   1,   200, SETTINGS.horizon),
}
# fmt: on


@pytest.mark.parametrize("name", SLEPT)
def test_only_what_a_silent_robot_did_while_i_slept_is_surmised(name: str) -> None:
    """r2 is silent all the time: so something is surmised at every tick."""
    stamp, woke, asked, taken = SLEPT[name]
    peers = PeerRecords("r0", SETTINGS)
    peers.merge_broadcasts(2, CELLS, [told(record(1, "r2"))])
    for tick in sorted({woke, stamp + 1, asked} - {0}):
        if tick == woke:
            peers.note_wake(tick)
        peers.merge_broadcasts(tick, CELLS, [told(replace(record(stamp), ahead=AHEAD))] if tick == stamp + 1 else [])
    assert set(peers.others["r1"].held) == {A, *AHEAD[:taken]}


# --- bounds of what is believed, and of what is passed on ---


@pytest.mark.parametrize(("ahead", "believed"), [(SKEW, True), (SKEW + 1, False)])
def test_clocks_may_differ_a_little(ahead: int, believed: bool) -> None:
    peers = PeerRecords("r0", SETTINGS)
    peers.merge_broadcasts(100, CELLS, [told(record(100 + ahead))])
    assert ("r1" in peers.others) is believed
    if not believed:
        assert kinds(peers, 101, told(record(99))) == [], "nor does a lie keep the truth out"


@pytest.mark.parametrize(("count", "believed"), [(63, True), (64, False)])
def test_a_record_names_no_more_cells_than_a_robot_can_want(count: int, believed: bool) -> None:
    peers = PeerRecords("r0", SETTINGS)
    peers.merge_broadcasts(
        10, CELLS, [told(replace(record(9), claims=tuple(Claim(A + 1, number, 9) for number in range(count))))]
    )
    assert ("r1" in peers.others) is believed


def test_a_robot_drives_no_faster_than_it_can() -> None:
    ticks = 20
    drives = SETTINGS.speed * SETTINGS.tick * ticks
    for off, believed in ((drives + SLACK - 0.01, True), (drives + SLACK + 0.01, False)):
        peers = PeerRecords("r0", SETTINGS)
        x, y = CELLS.centre(A)
        first = Record(robot="r1", stamp=10, x=x - 0.5, y=y, goal=B, held=(A,))
        peers.merge_broadcasts(10, CELLS, [told(first)])
        here = CELLS.cell_of(x - 0.5 + off, y)
        peers.merge_broadcasts(30, CELLS, [told(replace(first, stamp=10 + ticks, x=x - 0.5 + off, held=(here,)))])
        assert (peers.others["r1"].stamp == 30) is believed, off


def test_who_is_silent_just_so_long_is_fresh() -> None:
    peers = PeerRecords("r0", SETTINGS)
    peers.merge_broadcasts(10, CELLS, [told(record(9))])
    for tick, silent in ((9 + SETTINGS.fresh, False), (10 + SETTINGS.fresh, True)):
        assert ("r1" in peers.silent_records(tick)) is silent
        assert ("r1" in peers.fresh_records(tick)) is not silent


def test_a_fault_is_told_again_after_a_while_and_another_one_at_once() -> None:
    peers = PeerRecords("r0", SETTINGS)
    lies = [told(record(tick, "r0")) for tick in range(10, 112)]
    ticks = [tick for tick, lie in enumerate(lies, 10) if kinds(peers, tick, lie)]
    assert ticks == [10, 110]
    assert kinds(peers, 112, told(record(999, "r1"))) != []


def test_cells_of_mine_that_a_live_robot_holds_too_are_not_mine_alone() -> None:
    peers = PeerRecords("r0", SETTINGS)
    peers.merge_broadcasts(10, CELLS, [told(record(9, held=(A, A + 1)))])
    assert peers.cells_held_alone((A + 2, A + 1, A), 10) == (A + 2,)
    assert peers.holder_bodies(A + 1, 10) == ((*CELLS.centre(A), SETTINGS.widest),)
    assert peers.holder_bodies(A + 2, 10) == ()
    assert peers.cells_held_alone((A + 1,), 10 + SETTINGS.fresh) == (A + 1,), "a silent one is not live"


def test_robots_fall_silent_one_after_the_other() -> None:
    """Each is fresh for 40 ticks after its stamp, also where the ticks in between bring nothing new."""
    peers = PeerRecords("r0", SETTINGS)
    peers.merge_broadcasts(36, CELLS, [told(record(5)), told(record(20, "r2", A + 1)), told(record(35, "r3", A + 2))])
    for heard, asked, fresh in (
        (36, 45, ["r1", "r2", "r3"]), (36, 46, ["r2", "r3"]), (50, 60, ["r2", "r3"]), (50, 61, ["r3"]),
        (62, 75, ["r3"]), (62, 76, []),
    ):  # fmt: skip
        peers.merge_broadcasts(heard, CELLS, [])
        assert list(peers.fresh_records(asked)) == fresh, (heard, asked)
        assert sorted({*peers.silent_records(asked), *fresh}) == ["r1", "r2", "r3"]
        assert not peers.silent_records(asked).keys() & set(fresh)


def test_nothing_is_made_anew_while_nothing_changes() -> None:
    """What depends on the records is computed again only if they are another mapping."""
    peers = PeerRecords("r0", SETTINGS)
    peers.note_wake(5)
    peers.merge_broadcasts(10, CELLS, [told(record(9))])
    others = peers.others
    peers.merge_broadcasts(11, CELLS, [])
    assert peers.others is others
    assert peers.fresh_records(11) is others, "no copy while nobody is silent"
    peers.merge_broadcasts(60, CELLS, [told(record(59, "r2", A + 1))])
    assert peers.fresh_records(60) is peers.fresh_records(61)


def test_ticks_and_cells_begin_at_zero() -> None:
    peers = PeerRecords("r0", SETTINGS)
    assert kinds(peers, 1, told(record(0, cell=0))) == []
    assert list(peers.fresh_records(1)) == ["r1"]
    assert peers.others["r1"].held == (0,)
    assert len(peers.relay(640, 0.0, 0.0)) == 1, "old news"
    assert "not there" in kinds(peers, 2, told(record(1, cell=0, held=(0, -1))))[0]


# fmt: off
FARTHEST = [  # radio range, columns to the claimed cell, how far the robot is from its cell's middle towards it [m]
    (8.0, 5, 0.11, True),   # 3.5 m to claim and two cells: 5.9 m
    (8.0, 5, 0.09, False),
    (5.0, 4, 0.01, True),   # two cells to claim, since 2 m are less, and two cells: 4.8 m
    (5.0, 4, -0.01, False),
]
# fmt: on


@pytest.mark.parametrize(("reach", "columns", "off", "believed"), FARTHEST)
def test_a_robot_claims_so_far_and_no_farther(reach: float, columns: int, off: float, believed: bool) -> None:
    peers = PeerRecords("r0", replaced(SETTINGS, radio_range=reach))
    plain = record(9)
    peers.merge_broadcasts(10, CELLS, [told(replace(plain, x=plain.x + off, claims=(Claim(A + columns, 1, 9),)))])
    assert ("r1" in peers.others) is believed


def test_what_others_relay_counts_if_it_is_newer_or_came_a_shorter_way() -> None:
    same, far = record(9), 10 + SETTINGS.fresh + 2  # r1 is silent then
    said: list[TrafficBroadcast] = []
    for teller, told_of, hops, expected in (
        ("r2", same, 2, (9, 3)),
        ("r3", same, 1, (9, 2)),
        ("r4", record(9), 2, (9, 2)),  # an equal copy, a longer way
        ("r5", record(10), 2, (10, 3)),
        ("r6", record(10), 1, (10, 2)),
        ("r7", record(11), 3, None),  # relayed too often: with one hop more nobody would take it
    ):
        said.append(told(record(11, teller, A + 1), told_of, hops=hops))
        peers = PeerRecords("r0", SETTINGS)
        for one in said:
            assert kinds(peers, 12, one) == []
        ticks = (far, far + SETTINGS.relay_silent)  # it is held back at the first one if two others have relayed it
        found = {one for tick in ticks for one in peers.relay(tick, 0.0, 0.0) if one.record.robot == "r1"}
        assert [(one.record.stamp, one.hops) for one in found] == ([expected] if expected else []), teller


def test_a_robot_listens_until_it_says_otherwise_or_falls_silent() -> None:
    peers = PeerRecords("r0", SETTINGS)
    assert not peers.somebody_listens(10)
    peers.merge_broadcasts(10, CELLS, [told(record(9))])
    assert not peers.somebody_listens(10)
    peers.merge_broadcasts(20, CELLS, [told(replace(record(19, "r2", A + 1), listens=True))])
    assert [peers.somebody_listens(tick) for tick in (20, 59, 60)] == [True, True, False]
    peers.merge_broadcasts(21, CELLS, [told(record(20, "r2", A + 1))])
    assert not peers.somebody_listens(21)


@pytest.mark.parametrize(
    ("heard_before", "met"), [(None, True), (SETTINGS.fresh, False), (SETTINGS.fresh + 1, True)], ids=str
)
def test_who_is_heard_for_the_first_time_or_after_long_is_told_of_the_silent_at_once(
    heard_before: int | None, met: bool
) -> None:
    now = SETTINGS.fresh + 100
    peers = PeerRecords("r0", SETTINGS)
    peers.merge_broadcasts(10, CELLS, [told(record(9))])  # r1 then falls silent
    if heard_before is not None:
        peers.merge_broadcasts(now - heard_before, CELLS, [told(record(now - heard_before, "r2"))])
    peers.relay(now - 1, 0.0, 0.0)  # my turn to tell of r1: without a new robot, the next one comes much later
    peers.merge_broadcasts(now, CELLS, [told(record(now, "r2"))])
    assert ("r1" in [one.record.robot for one in peers.relay(now, 0.0, 0.0)]) == met
