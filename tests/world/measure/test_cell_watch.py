"""The watch on ticks that are made by hand: it counts each planted fault once, at its beginning, and nothing else.

Its input is made of true poses and the robots' declarations, only while they are repeated.
"""

from collections.abc import Iterable, Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm.geometry import Pose
from swarm.messages import Activity, Command
from swarm.traffic.lattice.cell_map import OUTSIDE
from swarm.traffic.lattice.placement import cells_of
from tests.shared import ROOM, scenario_of
from tests.traffic.maps import SIDE, Drawn
from tests.world.shared import command
from world.bodies.roster import Roster
from world.measure.cell_watch import STUCK, TrafficWatch, Watched
from world.measure.state import ReservationFault
from world.tasks.tasks import REST
from world.world import World

FLOOR = Drawn("abcd", "efgh", "ijkl")
CELL = {name: FLOOR.cell(place) for name, place in FLOOR.names.items()}
RADIUS = 0.2  # m
SECOND = 1.0  # s, a tick in tests of waiting
MM = 0.001  # m


def watch(tick: float = 0.05) -> TrafficWatch:
    return TrafficWatch(FLOOR.cells, Roster(SCENARIO, []), tick)


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
    return Watched(Pose(x + dx, y + dy, 0.0), cells, wants, moved, tuple(waits), radius=RADIUS)


def fed(ticks: Iterable[dict[str, Watched]], tick: float = 0.05) -> TrafficWatch:
    """Show a new watch these ticks."""
    watching = watch(tick)
    for number, robots in enumerate(ticks):
        watching.judge(number, robots)
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
    expected = [
        ReservationFault(tick, "overlap", robots, tuple(CELL[c] for c in cells)) for tick, robots, cells in planted
    ]
    assert [fault._replace(where=tuple(sorted(fault.where))) for fault in watching.state.watch.faults] == [
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
    assert len(watching.state.watch.faults) == bool(where)
    assert sorted(cell for fault in watching.state.watch.faults for cell in fault.where) == sorted(where)
    assert all(fault[:3] == (0, "outside", ("r1",)) for fault in watching.state.watch.faults)


def beside(gap: float, dy: float = 0.0) -> dict[str, Watched]:
    """Put two robots side by side in three cells that each declares for itself; faults of holds are not looked at."""
    half = RADIUS + gap / 2
    return {"r2": at("g", dx=-SIDE / 2 + half, dy=dy), "r1": at("f", dx=SIDE / 2 - half, dy=dy)}


@pytest.mark.parametrize(("gap", "touches"), [(MM, 0), (1e-9, 0), (-1e-9, 1), (-MM, 1), (-0.3, 1)])
def test_bodies_that_meet_are_a_contact(gap: float, touches: int) -> None:
    watching = fed([beside(gap), beside(gap)])
    faults = [fault for fault in watching.state.watch.faults if fault.kind == "contact"]
    assert faults == [ReservationFault(0, "contact", ("r1", "r2"), (CELL["f"],))] * touches, (
        "in the cell of the first of the two"
    )
    assert watching.state.watch.least_gap == pytest.approx(gap, abs=1e-12)


def test_the_least_gap_is_of_any_pair_at_any_tick() -> None:
    assert fed([{"r1": at("a")}]).state.watch.least_gap == float("inf")
    near, far = {"r1": at("a"), "r2": at("c"), "r3": at("d", dx=-0.3)}, APART
    assert fed([far, near, far]).state.watch.least_gap == pytest.approx(SIDE - 0.3 - 2 * RADIUS)


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
    assert [fault.kind for fault in fed(ticks).state.watch.faults].count("overlap") == begun


# --- waiting ---


def waiting(waits: dict[str, Sequence[str]], tick: float = SECOND) -> TrafficWatch:
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
    assert watching.state.watch.conflicts == conflicts
    assert watching.state.watch.waiting == ({"a": seconds} if seconds else {})


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
    assert waiting({"a": waits, "b": ["-"] * len(waits)}).state.watch.longest_wait == pytest.approx(seconds)


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
    assert waiting(waits).state.watch.deadlocks == deadlocks


@pytest.mark.parametrize("tick", [0.05, 0.1, 0.5])
def test_seconds_are_seconds_at_any_rate(tick: float) -> None:
    ticks = round(STUCK / tick)
    row: dict[str, Sequence[str]] = {"a": ["b"] * (2 * ticks - 1), "b": ["a"] * (2 * ticks - 1)}
    watching = waiting(row, tick)
    assert watching.state.watch.deadlocks == 1
    assert watching.state.watch.longest_wait == pytest.approx((2 * ticks - 1) * tick)
    assert watching.state.watch.waiting == pytest.approx(dict.fromkeys(row, (2 * ticks - 1) * tick))
    assert waiting({name: waits[1:] for name, waits in row.items()}, tick).state.watch.deadlocks == 0


# --- what it is fed: true poses and declarations ---

SCENARIO = scenario_of(traffic={"cell": 1.0, "offset": [0.0, 0.0]})
COLUMNS = 10
HERE, BESIDE, THERE = 3 * COLUMNS + 2, 3 * COLUMNS + 3, 3 * COLUMNS + 6  # cells of the room, 1 m wide
AT = {HERE: Pose(2.5, 3.5, 0.0), BESIDE: Pose(3.5, 3.5, 0.0), THERE: Pose(6.5, 3.5, 0.0)}


def say(*held: int, activity: Activity = Activity.DRIVE, waits: tuple[str, ...] = (), notes: int = 0) -> Command:
    plans = [("joint_plan", "leads 2 robots"), ("refused", "no")] * notes
    return command(held=list(held), activity=activity, waits=list(waits), notes=plans)


def traffic_watch() -> TrafficWatch:
    roster = Roster(SCENARIO, ["r1", "r2"])
    return TrafficWatch(cells_of(SCENARIO.map, SCENARIO.settings), roster, 1.0 / SCENARIO.settings.rate)


def test_true_poses_are_judged_by_what_was_declared_last() -> None:
    watching = traffic_watch()
    poses = [AT[HERE], AT[THERE]]
    last = [say(HERE), say(THERE)]
    assert watching.look(0, poses, {"r1": last[0], "r2": last[1]}, last) == []
    (fault,) = watching.look(1, [AT[BESIDE], AT[THERE]], {}, last)
    assert fault == (1, "outside", ("r1",), (BESIDE,)), "though it has said nothing new"
    (fault,) = watching.look(2, poses, {"r2": say(THERE, HERE)}, [last[0], say(THERE, HERE)])
    assert fault == (2, "overlap", ("r1", "r2"), (HERE,))


def test_who_has_not_spoken_yet_is_not_judged() -> None:
    assert traffic_watch().look(0, [AT[HERE], AT[HERE]], {}, [REST, REST]) == []
    watching = traffic_watch()
    assert watching.look(0, [AT[HERE], Pose(-9.0, 0.0, 0.0)], {}, [say(HERE), REST]) == []
    (fault,) = watching.look(1, [AT[HERE], Pose(-9.0, 0.0, 0.0)], {}, [say(HERE), say(THERE)])
    assert (*fault[:3], set(fault.where)) == (1, "outside", ("r2",), {OUTSIDE})


def test_who_is_done_or_not_told_to_go_waits_for_nobody() -> None:
    for activity, conflicts in (
        (Activity.DRIVE, 1), (Activity.GIVE_WAY, 1), (Activity.BLOCKED, 1), (Activity.DONE, 0), (Activity.READY, 0),
    ):  # fmt: skip
        watching = traffic_watch()
        last = [say(HERE, waits=("r2",), activity=activity), say(THERE)]
        watching.look(0, [AT[HERE], AT[THERE]], {}, last)
        assert watching.state.watch.conflicts == conflicts, activity


def test_who_moves_is_known_from_its_poses() -> None:
    watching = traffic_watch()
    last = [say(HERE), say(THERE)]
    for tick in range(6):  # r1 turns from the 3rd tick on, r2 stands
        watching.look(tick, [AT[HERE]._replace(yaw=max(0.0, 0.1 * (tick - 1))), AT[THERE]], {}, last)
    dt = 1.0 / SCENARIO.settings.rate
    assert watching.state.watch.longest_wait == 6 * dt
    moving = traffic_watch()
    for tick in range(6):
        moving.look(tick, [AT[HERE]._replace(yaw=0.1 * tick), AT[THERE]._replace(x=6.5 + 1e-9 * tick)], {}, last)
    assert moving.state.watch.longest_wait == dt, "of the first tick, before which nothing is known"


def test_a_note_counts_when_it_comes_and_not_again_while_the_command_lasts() -> None:
    watching = traffic_watch()
    told, last = say(HERE, notes=2), [say(HERE, notes=2), say(THERE)]
    watching.look(0, [AT[HERE], AT[THERE]], {"r1": told}, last)
    watching.look(1, [AT[HERE], AT[THERE]], {}, last)
    assert watching.state.watch.joint_plans == 2


def test_a_fault_is_an_event_of_the_run() -> None:
    world = World(SCENARIO, [AT[HERE], AT[THERE]], 1)
    commands = {"r1": say(HERE), "r2": say(THERE, HERE, BESIDE)}
    assert [(event.kind, event.robot, event.text) for event in world.step(commands)] == [
        ("traffic_fault", "r1", f"overlap of r1 and r2 in cell {HERE}")
    ]
    assert world.step(commands) == []


def test_after_an_edit_bodies_are_judged_on_the_new_floor() -> None:
    watching = traffic_watch()
    wider = scenario_of("#" * 10 + "\n" + ROOM, traffic={"cell": 2.0, "offset": [0.0, 0.0]})
    watching.cells = cells_of(wider.map, wider.settings)
    place = Pose(3.0, 3.0, 0.0)  # in the middle of the second cell of the second row, 5 cells a row
    assert watching.look(0, [place, AT[THERE]], {}, [say(1 * 5 + 1), REST]) == []
