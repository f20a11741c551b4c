"""Robots that are heard but say nothing of traffic: the cells they cover, and what a robot does about them."""

from collections.abc import Sequence
from itertools import groupby
from math import pi
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm.geometry import Pose, Twist, distance, integrate
from swarm.maps.occupancy import Point
from swarm.messages.traffic import Record, TrafficBroadcast
from swarm.traffic.interface import TrafficInputs
from swarm.traffic.own_route import OwnRoute
from swarm.traffic.peers.records import PeerRecords
from swarm.traffic.peers.situation import Situation
from swarm.traffic.peers.uncooperative import (
    CLEAR,
    LASTS,
    SAYS,
    STAYS,
    MuteBroadcast,
    Mutes,
    StepAsideRecovery,
    cells_under_mute,
)
from swarm.traffic.reservations.route import ALONE, RouteProgress
from swarm.traffic.reservations.rules import Reservations
from swarm.traffic.settings import TrafficConstants
from swarm.traffic.step import Traffic
from tests.traffic.maps import DOOR, Drawn

CELLS = DOOR.cells
A, B = DOOR.at("ab")
SETTINGS = TrafficConstants(speed=1.6)


def spoken(tick: int, cell: int = A, robot: str = "f1") -> MuteBroadcast:
    return MuteBroadcast(robot, tick, Pose(*CELLS.centre(cell), 0.0))


def record(tick: int, cell: int = A, robot: str = "f1") -> TrafficBroadcast:
    x, y = CELLS.centre(cell)
    return TrafficBroadcast(own=Record(robot=robot, stamp=tick, x=x, y=y, goal=cell, held=(cell,)))


@given(
    x=st.floats(0.0, 6.0), y=st.floats(0.0, 6.0), yaw=st.floats(-pi, pi), speed=st.floats(-1.6, 1.6),
    curvature=st.floats(-1.5, 1.5), age=st.integers(0, 8),
)  # fmt: skip
def test_its_cells_cover_its_body_until_it_has_braked(
    x: float, y: float, yaw: float, speed: float, curvature: float, age: int
) -> None:
    twist, dt = Twist(speed, speed * curvature), SETTINGS.tick
    before = Pose(x, y, yaw)
    last = integrate(before, twist, 4 * dt)
    cells = cells_under_mute(MuteBroadcast("f1", 0, before), MuteBroadcast("f1", 4, last), age, CELLS, SETTINGS)
    pose = last
    for _ in range(age):
        pose = integrate(pose, twist, dt)
        assert CELLS.swept_cells(((pose.x, pose.y),), SETTINGS.radius) <= cells
    rest = speed**2 / (2 * SETTINGS.acceleration)
    pose = integrate(pose, Twist(rest if speed > 0 else -rest, rest * curvature * (1 if speed > 0 else -1)), 1.0)
    if abs(speed) > 0.05:
        assert CELLS.swept_cells(((pose.x, pose.y),), SETTINGS.radius) <= cells


def test_who_is_done_covers_what_is_under_its_body_and_who_stands_a_margin_beside_it() -> None:
    x, y = CELLS.centre(A)
    at = Pose(x + CELLS.side / 2 - SETTINGS.radius - SETTINGS.margin / 2, y, 0.0)
    assert cells_under_mute(MuteBroadcast("f1", 0, at), MuteBroadcast("f1", 4, at), 1, CELLS, SETTINGS) == {A, A + 1}
    assert cells_under_mute(MuteBroadcast("f1", 0, at), MuteBroadcast("f1", 4, at, rests=True), 1, CELLS, SETTINGS) == {
        A
    }


def heard(peers: PeerRecords, *mute: MuteBroadcast, tick: int, said: Sequence[TrafficBroadcast] = ()) -> None:
    peers.merge_broadcasts(tick, CELLS, said, mute)


def test_it_holds_what_it_covers_and_is_asked_for_nothing() -> None:
    peers = PeerRecords("r0", SETTINGS)
    heard(peers, spoken(5), tick=6)
    assert peers.others["f1"].held == (A,)
    assert not peers.others["f1"].acks
    assert peers.fresh_records(6) == {}, "so no claim waits for its acknowledgement, and no plan counts it in"
    assert peers.cells_held_alone((A, B), 6) == (B,)
    assert peers.relay(6, 0.0, 0.0) == ()
    heard(peers, tick=6 + SETTINGS.fresh)
    assert peers.others["f1"].held == (A,), "it keeps them when it is not heard any more, until a look"
    assert peers.mutes.names == frozenset()


def test_who_speaks_again_is_mute_no_more_and_who_falls_mute_keeps_its_cells_for_a_while() -> None:
    peers = PeerRecords("r0", SETTINGS)
    heard(peers, tick=5, said=[record(4, B)])
    heard(peers, spoken(8), tick=9)
    assert set(peers.others["f1"].held) == {A, B}
    assert list(peers.fresh_records(9)) == ["f1"]
    heard(peers, spoken(60), tick=61)
    assert peers.others["f1"].held == (A,)
    assert list(peers.fresh_records(61)) == []
    heard(peers, tick=65, said=[record(64, B)])
    assert peers.others["f1"].held == (B,)
    assert list(peers.fresh_records(65)) == ["f1"]
    heard(peers, spoken(60), tick=66)
    assert peers.others["f1"].held == (B,), "an old broadcast that comes late counts for nothing"


def test_a_way_leads_round_cells_that_stay_covered_and_waits_there_if_none_does() -> None:
    start, goal = DOOR.at("ab")
    steps = RouteProgress(Reservations((start,)), (ALONE,))

    def way(stays: frozenset[int]) -> tuple[int, ...]:
        situation = Situation(0, CELLS, start, goal, {}, {}, stays=stays)
        return OwnRoute().find(steps, situation, ()).route

    straight = way(frozenset())
    assert straight
    for cell in straight[:-1]:
        other = way(frozenset({cell}))
        assert other[-1] == goal
        reachable = CELLS.distances(goal, {cell})[start] < len(CELLS)
        assert (cell not in other) == reachable
    assert way(frozenset({goal})) == straight


def test_cells_stay_covered_only_without_a_break() -> None:
    mutes = Mutes(SETTINGS)
    for tick in range(0, 2 * STAYS, 4):
        mutes.note_broadcasts(tick, [spoken(tick, A if tick < STAYS + 8 else B)], {})
        mutes.records(tick, {}, CELLS)
        assert (A in mutes.long_covered_cells(tick)) == (STAYS <= tick < STAYS + 8)


def test_who_waits_for_it_long_says_so_once() -> None:
    mutes = Mutes(SETTINGS)
    said = []
    for tick in range(3 * SAYS):
        mutes.note_broadcasts(tick, [spoken(tick)], {})
        said.append(mutes.check_wait(tick, ("f1",) if tick < 2 * SAYS else ("r2",)))
    assert [text for text in said if text] == ["waits for f1, which says nothing of traffic"]


ROOM = Drawn("######", "#abcd#", "#efgh#", "#ijkl#", "######")

HERE, BESIDE, FAR = (ROOM.cells.centre(cell) for cell in ROOM.at("abd"))
HEAD = ROOM.at("a")[0]


def goals(
    mute: tuple[float, float], ticks: int, *, rests: bool = False, stands: bool = False, moves: float = 0.0
) -> list[Point | None]:
    """Return the place aside in each tick of a robot at ``HERE``; it ``moves`` [m] now and then."""
    mutes, aside, found = Mutes(TrafficConstants()), StepAsideRecovery(), list[Point | None]()
    for tick in range(ticks):
        mutes.note_broadcasts(tick, [MuteBroadcast("f1", tick, Pose(*mute, 0.0), rests)], {})
        there = HERE[0] + moves * (tick // (SAYS // 2) % 2)
        found.append(aside.decide(tick, Pose(there, HERE[1], 0.0), mutes, HEAD, (), ROOM.cells, stands=stands))
    return found


def test_after_long_it_goes_to_a_place_clear_of_the_mute_robot_and_comes_back() -> None:
    found = goals(BESIDE, 3 * (SAYS + LASTS))
    asides = [goal for goal in dict.fromkeys(found) if goal is not None]
    first = next(tick for tick, goal in enumerate(found) if goal is not None)
    assert first > SAYS
    assert None in found[first : first + LASTS + 1], "it comes back"
    assert len(asides) >= 2, "another place each time"
    assert all(distance(goal, BESIDE) >= CLEAR * ROOM.cells.side for goal in asides)


@pytest.mark.parametrize(
    ("mute", "fields"), [(FAR, {}), (BESIDE, {"rests": True}), (BESIDE, {"stands": True}), (BESIDE, {"moves": 0.31})],
    ids=["it is far away", "it wants to go nowhere", "this robot was told to stop", "this robot gets on"],
)  # fmt: skip
def test_otherwise_it_stays(mute: tuple[float, float], fields: dict[str, Any]) -> None:
    assert goals(mute, 2 * SAYS, **fields) == [None] * (2 * SAYS)


def test_it_moves_aside_until_it_is_told_to_stop() -> None:
    mutes, aside, pose = Mutes(TrafficConstants()), StepAsideRecovery(), Pose(*HERE, 0.0)
    for tick in range(2 * SAYS):
        mutes.note_broadcasts(tick, [MuteBroadcast("f1", tick, Pose(*BESIDE, 0.0))], {})
        if aside.decide(tick, pose, mutes, HEAD, (), ROOM.cells, stands=False) is not None:
            break
    else:
        raise AssertionError("it does not move aside")
    assert aside.decide(tick + 1, pose, mutes, HEAD, (), ROOM.cells, stands=True) is None
    assert aside.decide(tick + 2, pose, mutes, HEAD, (), ROOM.cells, stands=False) is None, "it has to wait again"


def test_aside_it_drives_by_any_way_and_is_not_done() -> None:
    """Its planner's path leads elsewhere; its record says where it goes now."""
    traffic, pose, said = Traffic("r1", ROOM.cells, TrafficConstants()), Pose(*HERE, 0.0), set[tuple[bool, bool]]()
    for tick in range(2 * SAYS):
        mute = [MuteBroadcast("f1", tick, Pose(*BESIDE, 0.0))]
        inputs = TrafficInputs(tick, pose, HERE, done=True, mute=mute, path=(HERE, BESIDE))
        broadcast = traffic.step(inputs, ROOM.cells).broadcast
        if broadcast is not None:
            said.add((broadcast.own.done, broadcast.own.goal == HEAD))
    assert said == {(True, True), (False, False)}


# fmt: off
PLACES: dict[str, tuple[str, str, str, str, str]] = {  # the cells of a hall, where mute robots stand, the head, cells taken: the places in turn
    "the four nearest":          ("abcdefghij", "b",  "c", "",  "efgde"),
    "its own cell is no wall":   ("abcdefghij", "b",  "c", "c", "efgde"),
    "not through what is taken": ("abcdefghij", "b",  "c", "e", "dd"),
    "nowhere":                   ("abcdefghij", "b",  "c", "d", "--"),
    "not too far":               ("abcdefghij", "c",  "a", "",  "fgefg"),
    "clear of both":             ("abcdefghij", "bd", "c", "",  "ghif"),
    "nothing is clear":          ("abc",        "b",  "c", "",  "--"),
}
# fmt: on


@pytest.mark.parametrize("name", PLACES)
def test_the_place_aside_is_near_free_and_clear_of_all(name: str) -> None:
    cells, mute, head, taken, expected = PLACES[name]
    hall, mutes, aside = Drawn(cells), Mutes(TrafficConstants()), StepAsideRecovery()
    x, y = hall.points(head)[0]
    pose, found = Pose(x + 0.6 * hall.cells.side * (head == "a"), y, 0.0), ""
    centres = {point: one for one in cells for point in hall.points(one)}
    near = [Pose(x - 0.1, y, 0.0) for x, y in hall.points(mute)]  # so that no distance is just the least
    for tick in range(len(expected) * (SAYS + LASTS + 2)):
        mutes.note_broadcasts(tick, [MuteBroadcast(f"f{number}", tick, at) for number, at in enumerate(near)], {})
        got = aside.decide(tick, pose, mutes, hall.at(head)[0], hall.at(taken), hall.cells, stands=False)
        found += "-" if got is None else centres[got]
    turns = [one for one, _ in groupby(found) if one != "-"]
    assert "".join(turns) == expected.replace("-", "")
