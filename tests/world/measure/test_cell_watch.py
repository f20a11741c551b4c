"""The watch on ticks that are made by hand: it counts each planted fault once, at its beginning, and nothing else."""

from collections.abc import Iterable, Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm.geometry import Pose
from swarm.traffic.lattice.cell_map import OUTSIDE
from swarm.traffic.peers.records import TrafficNote
from tests.traffic.maps import SIDE, Drawn
from world.measure.cell_watch import STUCK, Watch, Watched
from world.measure.state import Fault

FLOOR = Drawn("abcd", "efgh", "ijkl")
CELL = {name: FLOOR.cell(place) for name, place in FLOOR.names.items()}
RADIUS = 0.2  # m
SECOND = 1.0  # s, a tick in tests of waiting
MM = 0.001  # m


def watch(tick: float = 0.05) -> Watch:
    return Watch(FLOOR.cells, RADIUS, tick)


def centre(name: str) -> tuple[float, float]:
    return FLOOR.cells.centre(CELL[name])


def at(
    name: str,
    held: str | None = None,
    dx: float = 0.0,
    dy: float = 0.0,
    *,
    waits: Sequence[str] = (),
    wants: bool = True,
    moved: bool = True,
) -> Watched:
    """Put a robot at a cell's centre or a little off; it holds that cell, or those named."""
    x, y = centre(name)
    cells = tuple(CELL[one] for one in (name if held is None else held))
    return Watched(Pose(x + dx, y + dy, 0.0), cells, wants, moved, tuple(waits))


def fed(ticks: Iterable[dict[str, Watched]], tick: float = 0.05) -> Watch:
    """Show a new watch these ticks."""
    watching = watch(tick)
    for number, robots in enumerate(ticks):
        watching.look(number, robots)
    return watching


# --- faults ---

APART = {"r1": at("a"), "r2": at("d")}
ONE = {"r1": at("a", "ab"), "r2": at("d", "db")}
TWO = {"r1": at("a", "abc"), "r2": at("d", "dbc")}
OTHER = {"r1": at("a", "ac"), "r2": at("d", "dc")}
THREE = {"r1": at("a", "ab"), "r2": at("d", "db"), "r3": at("j", "jb")}
PAIRS = {"r1": at("a", "ab"), "r2": at("e", "eb"), "r3": at("d", "dc"), "r4": at("h", "hc")}

# fmt: off
OVERLAPS: dict[str, tuple[list[dict[str, Watched]], list[tuple[int, tuple[str, ...], str]]]] = {
    "none":                          ([APART, APART],        []),
    "as long as it lasts":           ([ONE, ONE, ONE],       [(0, ("r1", "r2"), "b")]),
    "not from the start":            ([APART, ONE],          [(1, ("r1", "r2"), "b")]),
    "ends and begins again":         ([ONE, APART, ONE],     [(0, ("r1", "r2"), "b"), (2, ("r1", "r2"), "b")]),
    "two cells of one pair":         ([TWO],                 [(0, ("r1", "r2"), "bc")]),
    "one cell becomes another":      ([ONE, OTHER],          [(0, ("r1", "r2"), "b")]),
    "three in a cell are one fault": ([THREE],               [(0, ("r1", "r2", "r3"), "b")]),
    "two pairs":                     ([PAIRS],               [(0, ("r1", "r2"), "b"), (0, ("r3", "r4"), "c")]),
    "one robot holds a cell twice":  ([{"r1": at("a", "aba")}], []),
}
# fmt: on


@pytest.mark.parametrize("name", OVERLAPS)
def test_overlapping_holds_are_counted_as_they_begin(name: str) -> None:
    ticks, planted = OVERLAPS[name]
    watching = fed(ticks)
    expected = [Fault(tick, "overlap", robots, tuple(CELL[c] for c in cells)) for tick, robots, cells in planted]
    assert [fault._replace(where=tuple(sorted(fault.where))) for fault in watching.state.faults] == [
        fault._replace(where=tuple(sorted(fault.where))) for fault in expected
    ]


EDGE = SIDE / 2 - RADIUS  # m, from a cell's centre to where the body touches its edge

# fmt: off
OUTSIDES: dict[str, tuple[Watched, list[int]]] = {
    "touches the edge on the right":       (at("f", dx=EDGE),                   []),
    "touches the edge on the left":        (at("f", dx=-EDGE),                  []),
    "touches the edge above":              (at("f", dy=EDGE),                   []),
    "touches the edge below":              (at("f", dy=-EDGE),                  []),
    "1 mm over it, on the right":          (at("f", dx=EDGE + MM),              [CELL["g"]]),
    "1 mm over it, on the left":           (at("f", dx=-EDGE - MM),             [CELL["e"]]),
    "1 mm over it, above":                 (at("f", dy=EDGE + MM),              [CELL["b"]]),
    "1 mm over it, below":                 (at("f", dy=-EDGE - MM),             [CELL["j"]]),
    "0.05 mm over it":                     (at("f", dx=EDGE + 5e-5),            [CELL["g"]]),
    "rounding is no fault":                (at("f", dx=EDGE + 5e-7),            []),
    "over it into a cell held":            (at("f", "fg", dx=EDGE + MM),        []),
    "beside the corner of a third cell":   (at("f", "fgb", dx=EDGE + MM, dy=EDGE + MM), []),
    "in the corner of a third cell":       (at("f", "fgb", dx=0.55, dy=0.55),   [CELL["c"]]),
    "two cells at once, one fault":        (at("f", "f", dx=EDGE + MM, dy=-EDGE - MM), [CELL["g"], CELL["j"]]),
    "off the lattice":                     (at("a", dx=-EDGE - MM),             [OUTSIDE]),
    "holds nothing at all":                (at("f", ""),                        [CELL["f"]]),
}
# fmt: on


@pytest.mark.parametrize("name", OUTSIDES)
def test_a_body_outside_its_cells_is_seen_to_the_millimetre(name: str) -> None:
    seen, where = OUTSIDES[name]
    watching = fed([{"r1": seen}, {"r1": seen}])
    assert len(watching.state.faults) == bool(where)
    assert sorted(cell for fault in watching.state.faults for cell in fault.where) == sorted(where)
    assert all(fault[:3] == (0, "outside", ("r1",)) for fault in watching.state.faults)


def test_a_body_that_leaves_its_cells_again_counts_again() -> None:
    inside, outside = {"r1": at("f")}, {"r1": at("f", dx=EDGE + MM)}
    assert [fault.tick for fault in fed([outside, inside, outside, outside]).state.faults] == [0, 2]


def beside(gap: float, dy: float = 0.0) -> dict[str, Watched]:
    """Put two robots side by side in three cells that each declares for itself; faults of holds are not looked at."""
    half = RADIUS + gap / 2
    return {"r2": at("g", dx=-SIDE / 2 + half, dy=dy), "r1": at("f", dx=SIDE / 2 - half, dy=dy)}


@pytest.mark.parametrize(("gap", "touches"), [(MM, 0), (1e-9, 0), (-1e-9, 1), (-MM, 1), (-0.3, 1)])
def test_bodies_that_meet_are_a_contact(gap: float, touches: int) -> None:
    watching = fed([beside(gap), beside(gap)])
    faults = [fault for fault in watching.state.faults if fault.kind == "contact"]
    assert len(faults) == touches
    assert all(fault.tick == 0 and fault.robots == ("r1", "r2") and len(fault.where) == 1 for fault in faults)
    assert watching.state.least_gap == pytest.approx(gap, abs=1e-12)


def test_a_contact_is_in_the_cell_of_the_first_of_the_two() -> None:
    (fault,) = (fault for fault in fed([beside(-0.1)]).state.faults if fault.kind == "contact")
    assert fault.where == (CELL["f"],)


def test_the_least_gap_is_of_any_pair_at_any_tick() -> None:
    assert fed([{"r1": at("a")}]).state.least_gap == float("inf")
    near, far = {"r1": at("a"), "r2": at("c"), "r3": at("d", dx=-0.3)}, APART
    assert fed([far, near, far]).state.least_gap == pytest.approx(SIDE - 0.3 - 2 * RADIUS)


def test_faults_of_a_tick_are_given_back_once() -> None:
    watching = watch()
    assert [fault.tick for fault in watching.look(7, ONE)] == [7]
    assert watching.look(8, ONE) == []


@given(st.lists(st.tuples(*[st.sets(st.sampled_from("abcdefghijkl"), max_size=4)] * 3), max_size=12))
def test_any_history_of_holds_counts_each_beginning_once(history: list[tuple[set[str], set[str], set[str]]]) -> None:
    """Recomputed apart: for each group that shares a cell, how many runs of ticks in a row there are."""
    names = ("r1", "r2", "r3")
    places = dict(zip(names, "aei", strict=True))
    ticks, groups = [], []
    for held in history:
        ticks.append({name: at(places[name], "".join(sorted(cells))) for name, cells in zip(names, held, strict=True)})
        owners = ({name for name, cells in zip(names, held, strict=True) if cell in cells} for cell in CELL)
        groups.append({tuple(sorted(group)) for group in owners if len(group) > 1})
    begun = sum(len(now - before) for before, now in zip([set(), *groups], groups, strict=False))
    assert [fault.kind for fault in fed(ticks).state.faults].count("overlap") == begun


# --- waiting ---


def waiting(waits: dict[str, Sequence[str]], tick: float = SECOND) -> Watch:
    """Let robots stand in the cells they are named by; a row says for each tick for whom, letter by letter.

    ``x``: it wants nothing, ``-`` or ``+``: it drives, ``.``: it waits for nobody.
    """
    ticks = []
    for row in zip(*waits.values(), strict=True):
        seen = {}
        for name, what in zip(waits, row, strict=True):
            whom = [other for other in what if other in waits]
            seen[name] = at(name, waits=whom, wants="x" not in what, moved="-" in what or "+" in what)
        ticks.append(seen)
    return fed(ticks, tick)


# fmt: off
CONFLICTS = {
    "nobody waits":                         (["."] * 5,                    0, 0.0),
    "one wait":                             ([".", "b", "b", "."],         1, 2.0),
    "from the first tick on":               (["b", "b", "."],              1, 2.0),
    "begins twice":                         (["b", ".", "b", "b"],         2, 3.0),
    "for one and then for another":         (["b", "c", "bc"],             1, 3.0),
    "on the move, but for somebody":        (["b+", "b+"],                 1, 2.0),
    "who wants nothing waits for nobody":   (["bx", "bx"],                 0, 0.0),
    "wants, then not, then wants again":    (["b", "bx", "b"],             2, 2.0),
}
# fmt: on


@pytest.mark.parametrize("name", CONFLICTS)
def test_waits_are_counted_as_they_begin_and_timed_as_they_last(name: str) -> None:
    waits, conflicts, seconds = CONFLICTS[name]
    watching = waiting({"a": waits, "b": ["-"] * len(waits), "c": ["-"] * len(waits)})
    assert watching.state.conflicts == conflicts
    assert watching.state.waiting == ({"a": seconds} if seconds else {})


# fmt: off
LONGEST = {
    "never stands":                         (["-"] * 4,                    0.0),
    "stands, for nobody":                   (["-", ".", ".", "-"],         2.0),
    "the longer of two":                    ([".", ".", ".", "-", "."],    3.0),
    "the longer comes last":                ([".", "-", ".", "."],         2.0),
    "waits on the move":                    (["b+", "b+"],                 0.0),
    "wants nothing":                        (["x"] * 9,                    0.0),
    "wants nothing for one tick":           ([".", ".", "x", "."],         2.0),
}
# fmt: on


@pytest.mark.parametrize("name", LONGEST)
def test_the_longest_wait_is_the_longest_time_that_one_stood_and_wanted_to_go_on(name: str) -> None:
    waits, seconds = LONGEST[name]
    assert waiting({"a": waits, "b": ["-"] * len(waits)}).state.longest_wait == pytest.approx(seconds)


STANDS = round(STUCK / SECOND)  # ticks of standing before a robot counts in a circle
CIRCLE = 2 * STANDS - 1  # ticks, the one in which it begins to count is the first of the circle's own

# fmt: off
CIRCLES: dict[str, tuple[dict[str, Sequence[str]], int]] = {
    "two for each other, not long enough":  ({"a": ["b"] * (CIRCLE - 1), "b": ["a"] * (CIRCLE - 1)},           0),
    "two for each other, just long enough": ({"a": ["b"] * CIRCLE, "b": ["a"] * CIRCLE},                       1),
    "for ever, once":                       ({"a": ["b"] * 90, "b": ["a"] * 90},                               1),
    "three in a ring":                      ({"a": ["b"] * 30, "b": ["c"] * 30, "c": ["a"] * 30},              1),
    "a ring, and one that waits for it":    ({"a": ["b"] * 30, "b": ["a"] * 30, "c": ["a"] * 30},              1),
    "one of several is in a circle":        ({"a": ["cb"] * 30, "b": ["a"] * 30, "c": ["-"] * 30},             1),
    "a chain":                              ({"a": ["b"] * 30, "b": ["c"] * 30, "c": ["."] * 30},              0),
    "a ring in which one gets on":          ({"a": ["b"] * 30, "b": ["a+"] * 30},                              0),
    "a ring in which one wants nothing":    ({"a": ["b"] * 30, "b": ["ax"] * 30},                              0),
    "one gets on just in time":             ({"a": ["b"] * 30, "b": ["a"] * (CIRCLE - 1) + ["a+"] + ["a"] * 11}, 0),
    "ends and begins again":                ({"a": ["b"] * 60, "b": ["a"] * 25 + ["-"] + ["a"] * 34},          2),
    "two rings, one later":                 ({"a": ["b"] * 40, "b": ["a"] * 40,
                                              "c": ["-"] * 9 + ["d"] * 31, "d": ["c"] * 40},                   2),
    "nobody waits for anybody":             ({"a": ["."] * 60, "b": ["."] * 60},                               0),
    "a ring that stood long before":        ({"a": ["."] * 30 + ["b"] * (STANDS - 1),
                                              "b": ["."] * 30 + ["a"] * (STANDS - 1)},                         0),
    "and long enough in the ring":          ({"a": ["."] * 30 + ["b"] * STANDS,
                                              "b": ["."] * 30 + ["a"] * STANDS},                               1),
}
# fmt: on


@pytest.mark.parametrize("name", CIRCLES)
def test_a_deadlock_is_a_circle_of_waits_among_robots_that_stand(name: str) -> None:
    waits, deadlocks = CIRCLES[name]
    assert waiting(waits).state.deadlocks == deadlocks


@pytest.mark.parametrize("tick", [0.05, 0.1, 0.5])
def test_seconds_are_seconds_at_any_rate(tick: float) -> None:
    ticks = round(STUCK / tick)
    row: dict[str, Sequence[str]] = {"a": ["b"] * (2 * ticks - 1), "b": ["a"] * (2 * ticks - 1)}
    watching = waiting(row, tick)
    assert watching.state.deadlocks == 1
    assert watching.state.longest_wait == pytest.approx((2 * ticks - 1) * tick)
    assert watching.state.waiting == pytest.approx(dict.fromkeys(row, (2 * ticks - 1) * tick))
    assert waiting({name: waits[1:] for name, waits in row.items()}, tick).state.deadlocks == 0


def test_joint_plans_are_counted_by_their_events() -> None:
    watching = watch()
    plan, refused = TrafficNote("joint_plan", ("r1", "r2"), "r1 leads"), TrafficNote("refused", ("r1",), "no")
    for number, events in enumerate(([plan], [], [refused, plan, plan])):
        watching.look(number, APART, events)
    assert watching.state.joint_plans == 3
