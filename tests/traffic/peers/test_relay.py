"""Relays: what somebody near may not hear is relayed, the rest is not, and one robot that lies silences nobody."""

from dataclasses import replace as replaced
from typing import Final

import pytest
from msgspec.structs import replace

from swarm.messages.traffic import Collect, Epoch, JointPlan, Record, Refusal
from swarm.traffic.peers.relay import WELCOME, KnownRecord, RelayChooser
from swarm.traffic.settings import TrafficConstants

SETTINGS: Final = TrafficConstants()  # a range of 8 m: who is 7 m apart may not hear each other
PAUSE: Final = SETTINGS.relay_silent
EPOCH: Final = Epoch(5, "r9")


def record(robot: str, x: float, stamp: int = 100, y: float = 0.0) -> Record:
    return Record(robot=robot, stamp=stamp, x=x, y=y, goal=0)


def known(*records: Record, hops: int = 1) -> dict[str, KnownRecord]:
    return {one.robot: KnownRecord(one, hops) for one in records}


def chosen(
    relaying: RelayChooser, tick: int, known: dict[str, KnownRecord], x: float = 0.0, *, listens: bool = False
) -> list[str]:
    return [one.record.robot for one in relaying.choose(tick, x, 0.0, known, listens=listens)]


def turns(relaying: RelayChooser, ticks: range, known: dict[str, KnownRecord]) -> list[int]:
    """Return the ticks at which a record is relayed."""
    return [tick for tick in ticks if chosen(relaying, tick, known)]


NEAR, LEFT, RIGHT = record("r1", 1.0), record("r2", -4.0), record("r3", 3.5)


@pytest.mark.parametrize(
    ("records", "expected"),
    [
        ([], []),
        ([LEFT], []),
        ([NEAR, RIGHT], []),
        ([LEFT, record("r3", 3.0)], []),  # 7 m apart
        ([LEFT, record("r3", 3.1)], ["r3", "r2"]),
        ([NEAR, LEFT, RIGHT], ["r3", "r2"]),
        ([LEFT, record("r3", 9.0)], ["r3"]),  # nobody near me misses r2: r3 does not hear me
        ([record("r2", 0.0, y=-4.0), record("r3", 0.0, y=3.1)], ["r3", "r2"]),
    ],
)
def test_who_may_not_be_heard_by_a_robot_in_range_is_relayed(records: list[Record], expected: list[str]) -> None:
    assert chosen(RelayChooser(SETTINGS), 100, known(*records)) == expected


def test_where_walls_stop_the_radio_all_are_relayed() -> None:
    relaying = RelayChooser(replaced(SETTINGS, in_sight=True))
    assert chosen(relaying, 100, known(NEAR, RIGHT)) == ["r1", "r3"]
    assert chosen(relaying, 100, known(record("r1", 9.0), record("r3", 9.5))) == [], "nobody is there to hear it"
    held = known(replace(NEAR, stamp=104, held=(7,)), RIGHT)
    assert chosen(relaying, 104, held) == ["r1"], "a robot behind a wall may want that cell"


def test_a_record_is_relayed_again_when_it_is_so_much_newer() -> None:
    relaying = RelayChooser(SETTINGS)
    ticks = [
        tick
        for tick in range(100, 150, SETTINGS.every)
        if chosen(relaying, tick, known(replace(LEFT, stamp=tick - 1), replace(RIGHT, stamp=tick - 1)))
    ]
    assert ticks == list(range(100, 150, SETTINGS.relay))
    assert turns(relaying, range(150, 188), known(replace(LEFT, stamp=148), replace(RIGHT, stamp=148))) == [], (
        "the same"
    )


@pytest.mark.parametrize(
    "news",
    [
        {"epoch": EPOCH}, {"frozen": EPOCH}, {"need": "r9"}, {"collect": Collect(EPOCH, ())},
        {"plan": JointPlan(epoch=EPOCH, ways={}, after={})}, {"refusal": Refusal(EPOCH, ())},
    ],
)  # fmt: skip
def test_news_about_joint_plans_is_relayed_at_once(news: dict[str, object]) -> None:
    relaying = RelayChooser(SETTINGS)
    assert chosen(relaying, 100, known(LEFT, RIGHT)) == ["r3", "r2"]
    assert chosen(relaying, 101, known(replace(LEFT, stamp=101, held=(3,)), RIGHT)) == [], "no hurry"
    assert chosen(relaying, 101, known(replace(LEFT, stamp=101, **news), RIGHT)) == ["r2"]


def test_what_two_others_have_relayed_is_held_back_once() -> None:
    relaying = RelayChooser(SETTINGS)
    for relayer in ("r4", "r5"):
        relaying.hear(relayer, LEFT)
    assert chosen(relaying, 100, known(LEFT, RIGHT)) == ["r3"]
    later = 100 + SETTINGS.relay
    for relayer in ("r4", "r5"):
        relaying.hear(relayer, replace(LEFT, stamp=later))
    assert chosen(relaying, later, known(replace(LEFT, stamp=later), RIGHT)) == ["r2"], "not twice running"


@pytest.mark.parametrize(("older", "held_back"), [(0, True), (SETTINGS.every, True), (SETTINGS.every + 1, False)])
def test_how_old_the_record_may_be_that_others_have_relayed(older: int, held_back: bool) -> None:
    relaying = RelayChooser(SETTINGS)
    assert "r2" in chosen(relaying, 100, known(LEFT, RIGHT))
    now = replace(LEFT, stamp=100 + SETTINGS.relay)
    for relayer in ("r4", "r5"):
        relaying.hear(relayer, replace(now, stamp=now.stamp - older))
    assert (chosen(relaying, now.stamp, known(now, RIGHT)) == []) is held_back
    news = replace(now, stamp=now.stamp + 1, epoch=EPOCH)
    assert chosen(relaying, news.stamp, known(news, RIGHT)) == ["r2"], "others have not relayed the news"


def test_one_robot_silences_nobody_whatever_it_says_and_how_often() -> None:
    """Two honest robots relay; a third one lies that it has just relayed a newer record."""
    for _ in range(2):
        honest = RelayChooser(SETTINGS)
        for tick in range(100, 400, SETTINGS.relay):
            now = replace(LEFT, stamp=tick)
            for lie in (now, replace(now, stamp=tick + 20), now):
                honest.hear("liar", lie)
            assert "r2" in chosen(honest, tick, known(now, replace(RIGHT, stamp=tick)))


def test_a_silent_robot_is_relayed_now_and_then_and_later_half_as_often() -> None:
    relaying, lost = RelayChooser(SETTINGS), known(record("r2", 1.0, stamp=0))
    assert turns(relaying, range(100, 200), lost) == list(range(100, 200, PAUSE))
    relaying = RelayChooser(SETTINGS)
    begin = SETTINGS.keep + 1
    assert turns(relaying, range(begin, begin + 100), lost) == list(range(begin, begin + 100, 2 * PAUSE))
    relaying = RelayChooser(SETTINGS)
    assert turns(relaying, range(SETTINGS.fresh), lost) == [], "it is not silent yet"
    assert turns(relaying, range(SETTINGS.fresh, SETTINGS.fresh + 2), lost) == [SETTINGS.fresh + 1]


def test_who_comes_near_or_listens_is_told_of_silent_robots_at_once() -> None:
    relaying, lost = RelayChooser(SETTINGS), known(record("r2", 1.0, stamp=0))
    assert turns(relaying, range(100, 102), lost) == [100]
    relaying.note_new_robot(103)
    assert turns(relaying, range(103, 140), lost)[: WELCOME + 1] == list(range(103, 104 + WELCOME))
    assert chosen(relaying, 104 + WELCOME, lost) == []
    assert chosen(relaying, 104 + WELCOME, lost, listens=True) == ["r2"]


def test_a_silent_robot_that_two_others_have_relayed_is_relayed_every_second_time() -> None:
    relaying, lost = RelayChooser(SETTINGS), record("r2", 1.0, stamp=0)
    for relayer in ("r4", "r5"):
        relaying.hear(relayer, lost)
    assert turns(relaying, range(100, 100 + 4 * PAUSE), known(lost)) == [100 + PAUSE, 100 + 3 * PAUSE]


def test_the_nearest_are_relayed_first_and_the_others_next_time() -> None:
    relaying = RelayChooser(replaced(SETTINGS, relayed=2))
    lost = known(*[record(f"r{place}", float(place), stamp=0) for place in (5, 1, 4, 2, 3)])
    assert chosen(relaying, 100, lost, x=2.9) == ["r3", "r2"]
    assert chosen(relaying, 101, lost, x=2.9) == ["r4", "r1"]
    assert chosen(relaying, 102, lost, x=2.9) == ["r5"]


def test_records_that_were_relayed_often_enough_are_not_relayed() -> None:
    lost = record("r2", 1.0, stamp=0)
    for hops, relayed in ((SETTINGS.hops, ["r2"]), (SETTINGS.hops + 1, [])):
        assert chosen(RelayChooser(SETTINGS), 100, known(lost, hops=hops)) == relayed
    (one,) = RelayChooser(SETTINGS).choose(100, 0.0, 0.0, known(lost, hops=2), listens=False)
    assert one == (2, lost)
