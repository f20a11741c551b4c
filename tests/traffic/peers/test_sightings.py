"""Sightings of cells: the newest counts, old ones are forgotten, and live robots count more than sightings."""

import pytest

from swarm.messages.traffic import Claim, Record, Sighting
from swarm.traffic.peers.sightings import Sightings, has_reserved
from swarm.traffic.settings import TrafficConstants
from tests.traffic.maps import Drawn

FLOOR = Drawn("abcdef")
A, B, C, D, E, F = FLOOR.at("abcdef")
SETTINGS = TrafficConstants()
NOW = 5000


def record(
    robot: str, *seen: Sighting, stamp: int = NOW, held: tuple[int, ...] = (), claims: tuple[Claim, ...] = ()
) -> Record:
    return Record(robot=robot, stamp=stamp, x=0.0, y=0.0, goal=A, held=held, claims=claims, seen=seen)


def body(cell: int, tick: int) -> Sighting:
    return Sighting(cell, False, tick)


def empty(cell: int, tick: int) -> Sighting:
    return Sighting(cell, True, tick)


def test_what_is_seen_is_told_newest_first_and_not_too_much() -> None:
    sightings = Sightings(SETTINGS)
    assert sightings.sightings_to_tell() == ()
    sightings.note(C, empty=False, tick=NOW)
    sightings.note(B, empty=True, tick=NOW + 1)
    sightings.note(A, empty=False, tick=NOW)
    assert sightings.sightings_to_tell() == (empty(B, NOW + 1), body(A, NOW), body(C, NOW))
    assert sightings.occupied_cells() == {A, C}
    for cell in range(SETTINGS.sightings + 5):
        sightings.note(cell, empty=False, tick=NOW + cell)
    told = sightings.sightings_to_tell()
    assert [one.tick for one in told] == [NOW + SETTINGS.sightings + 4 - place for place in range(SETTINGS.sightings)]


# fmt: off
NEWS: dict[str, tuple[Sighting, Sighting, set[int]]] = {  # seen, heard: the cells with a body then
    "newer news of a body":        (empty(B, NOW - 5),  body(B, NOW - 4),   {B}),
    "newer news of an empty cell": (body(B, NOW - 5),   empty(B, NOW - 4),  set()),
    "older news":                  (body(B, NOW - 4),   empty(B, NOW - 5),  {B}),
    "news as old":                 (body(B, NOW - 4),   empty(B, NOW - 4),  {B}),
    "news of this tick":           (body(B, NOW - 4),   empty(B, NOW),      set()),
    "news from the future":        (body(B, NOW - 4),   empty(B, NOW + 1),  {B}),
    "news of another cell":        (body(B, NOW - 4),   body(C, NOW - 1),   {B, C}),
}
# fmt: on


@pytest.mark.parametrize("name", NEWS)
def test_the_newest_sighting_of_a_cell_counts(name: str) -> None:
    seen, heard, occupied = NEWS[name]
    sightings = Sightings(SETTINGS)
    sightings.note(seen.cell, empty=seen.empty, tick=seen.tick)
    sightings.merge_sightings(NOW, [record("r2"), record("r3", heard)])
    assert sightings.occupied_cells() == occupied


@pytest.mark.parametrize(("is_empty", "lasts"), [(False, SETTINGS.obstacle), (True, SETTINGS.emptied)])
def test_a_sighting_is_forgotten_in_time(is_empty: bool, lasts: int) -> None:
    sightings = Sightings(SETTINGS)
    sightings.note(B, empty=is_empty, tick=NOW)
    sightings.merge_sightings(NOW + lasts - 1, [])
    assert len(sightings.sightings_to_tell()) == 1
    sightings.merge_sightings(NOW + lasts, [])
    assert sightings.sightings_to_tell() == ()


# --- silent robots' cells ---

SILENT = record("r9", stamp=NOW - 900, held=(B, C), claims=(Claim(D, 1, NOW - 900),))

# fmt: off
CLEARED: dict[str, tuple[Sighting, bool, set[int]]] = {  # seen; whether the robot is heard: cells cleared
    "a cell it held":                  (empty(B, NOW),        False, {B}),
    "a cell it claimed":               (empty(D, NOW),        False, {D}),
    "a cell that was never its own":   (empty(E, NOW),        False, set()),
    "occupied":                        (body(B, NOW),         False, set()),
    "seen before it spoke last":       (empty(B, NOW - 900),  False, set()),
    "seen just after":                 (empty(B, NOW - 899),  False, {B}),
    "it is heard":                     (empty(B, NOW),        True,  set()),
}
# fmt: on


@pytest.mark.parametrize("name", CLEARED)
def test_a_silent_robots_cell_is_cleared_by_who_saw_it_empty_since(name: str) -> None:
    seen, heard, cells = CLEARED[name]
    sightings = Sightings(SETTINGS)
    sightings.note(seen.cell, empty=seen.empty, tick=seen.tick)
    others = {"r9": SILENT, "r8": record("r8", held=(B, D))}
    fresh = {"r8": others["r8"]} | ({"r9": SILENT} if heard else {})
    assert sightings.clear(others, fresh) == {("r9", cell) for cell in cells}


def test_a_cell_stays_cleared_until_its_robot_is_heard_again() -> None:
    sightings, others = Sightings(SETTINGS), {"r9": SILENT}
    sightings.note(B, empty=True, tick=NOW)
    assert sightings.clear(others, {}) == {("r9", B)}
    sightings.merge_sightings(NOW + SETTINGS.emptied, [])
    assert sightings.sightings_to_tell() == ()
    assert sightings.clear(others, {}) == {("r9", B)}, "though the sighting is forgotten"
    assert sightings.clear(others, others) == frozenset()
    assert sightings.clear(others, {}) == frozenset()


@pytest.mark.parametrize(("stamp", "cleared"), [(NOW - 1, {("r9", B)}), (NOW, set()), (NOW + 1, set())])
def test_a_record_that_comes_late_through_another_robot_keeps_its_cells(
    stamp: int, cleared: set[tuple[str, int]]
) -> None:
    sightings = Sightings(SETTINGS)
    sightings.note(B, empty=True, tick=NOW)
    assert sightings.clear({"r9": SILENT}, {}) == {("r9", B)}
    relayed = record("r9", stamp=stamp, held=(B,))  # too old to be fresh
    assert sightings.clear({"r9": relayed}, {}) == cleared


def test_a_robot_keeps_what_it_holds_and_what_it_claims() -> None:
    assert [has_reserved(SILENT, cell) for cell in (A, B, C, D, E)] == [False, True, True, True, False]
