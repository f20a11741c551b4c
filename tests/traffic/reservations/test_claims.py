"""What a robot claims, beside its way too, takes and waits for in one step: one robot among others, on cells of 1.2 m."""

import numpy as np
import pytest
from msgspec.structs import replace

from swarm.geometry import Pose
from swarm.maps.occupancy import OccupancyMap
from swarm.messages.traffic import Claim, Entry, Epoch, JointPlan, Record
from swarm.traffic.interface import MovingObstacle
from swarm.traffic.joint.states import FollowedPlan
from swarm.traffic.lattice.cell_map import CellMap
from swarm.traffic.peers.situation import Situation
from swarm.traffic.reservations.claims import CellClaimer, ClaimResult, list_room_cells
from swarm.traffic.reservations.route import ALONE, BESIDE, Footprint, RouteProgress
from swarm.traffic.reservations.rules import Reservations
from swarm.traffic.settings import TrafficConstants
from tests.traffic.maps import SIDE, Drawn, lane

FLOOR = Drawn("abcdefgh", "ijklmnop")
A, B, C, BELOW, BESIDE_B = FLOOR.at("abcij")
NOW = 1000
NEAR = TrafficConstants()  # claims reach 3.5 m
WIDE = TrafficConstants(radio_range=20.0)  # claims reach 9.5 m
IN_SIGHT = TrafficConstants(in_sight=True)
PLAN = Epoch(900, "r9")
ACK = (("r1", 1),)  # of the first claim


def other(robot: str, held: str, *claims: Claim, **fields: object) -> Record:
    x, y = FLOOR.points(held[0])[0]
    plain = Record(robot=robot, stamp=NOW, x=x, y=y, goal=-1, held=FLOOR.at(held), claims=claims)
    return replace(plain, **fields)


def way(held: str = "a", route: str = "bcdefgh", *claims: Claim, steps: tuple[int, ...] = ()) -> RouteProgress:
    reservations = Reservations(FLOOR.at(held), claims, 1 + len(claims))
    return RouteProgress(reservations, steps or (ALONE,) * len(held), FLOOR.at(route), bool(steps))


def step(
    progress: RouteProgress,
    *others: Record,
    silent: tuple[Record, ...] = (),
    blocked: str = "",
    cleared: str = "",
    room: str = "",
    docking: str = "",
    entries: dict[int, Entry] | None = None,
    body: str = "a",
    off: float = 0.0,
    settings: TrafficConstants = NEAR,
    floor: Drawn = FLOOR,
) -> ClaimResult:
    """Make one step of r1, whose body is ``off`` [m] to the right of its cell's middle."""
    cell, fresh = floor.at(body)[0], {one.robot: one for one in others}
    pose = floor.pose(cell)
    situation = Situation(
        tick=NOW, cells=floor.cells, head=progress.head, goal=FLOOR.at("h")[0], blocked=frozenset(floor.at(blocked)), cleared=frozenset(("r8", one) for one in floor.at(cleared)), others=fresh | {one.robot: one for one in silent}, fresh=fresh, docking=floor.at(docking)
    )  # fmt: skip
    plan = None
    if entries is not None:
        plan = FollowedPlan("r1", JointPlan(epoch=PLAN, ways={}, after={}), ("r1", "r2"), NOW, 140, entries)
    footprint = Footprint(NOW, pose._replace(x=pose.x + off), cell, frozenset({cell}))
    return CellClaimer("r1", settings).step(progress, plan, situation, footprint, floor.at(room))


def names(cells: tuple[int, ...]) -> str:
    return "".join(name for cell in cells for name in FLOOR.names if FLOOR.at(name) == (cell,))


def claimed(after: ClaimResult) -> str:
    return names(tuple(claim.cell for claim in after.progress.reservations.claims))


LOOPS = {  # cells held, the next cell of its way, where it is: it takes that one again at once
    "it has not left the first cell of a loop": ("abcd", "a", "a", False),
    "it has left it": ("abcd", "a", "b", True),
    "it turns back at a dead end": ("ab", "a", "a", True),
}


@pytest.mark.parametrize("name", LOOPS)
def test_a_loop_is_closed_when_its_first_cell_was_left(name: str) -> None:
    """A robot that holds a cell twice is taken to be there for the last time, and gives up the cells between."""
    held, following, body, closes = LOOPS[name]
    after = step(way(held, following), body=body).progress
    assert names(after.reservations.held) == (held + following if closes else held)


# --- what it claims ---

MINE = Claim(B, 1, NOW - 1)
THERE = other("r2", "b", epoch=PLAN, left=1, entered=1)  # in the visit of b that has to be over first
COMING = other("r2", "j", epoch=PLAN, left=0, entered=0)
SILENT = other("r8", "b", stamp=0)

AT_STOP = other("r2", "j", goal=BESIDE_B, ahead=FLOOR.at("bc"))  # it needs these two cells to come to its place

# fmt: off
ASKS: dict[str, tuple[ClaimResult, str, tuple[str, ...]]] = {  # the step: cells claimed, who is waited for
    "as far as it may be heard":            (step(way()),                                               "bc",  ()),
    "a little nearer, one more":            (step(way(), off=0.11),                                     "bcd", ()),
    "not quite near enough":                (step(way(), off=0.09),                                     "bc",  ()),
    "three beyond the one it is in":        (step(way(), settings=WIDE),                                "bcd", ()),
    "one of three is held":                 (step(way("ab", "cdefgh"), settings=WIDE),                  "cd",  ()),
    "one lies behind":                      (step(way("ab", "cdefgh"), settings=WIDE, body="b"),        "cde", ()),
    "all three are held":                   (step(way("abcd", "efgh"), settings=WIDE),                  "",    ()),
    "more than three are held":             (step(way("abcde", "fgh"), settings=WIDE),                  "",    ()),
    "a claim made before stays":            (step(way("a", "bcdefgh", MINE)),                           "bc",  ()),
    "up to a blocked cell":                 (step(way(), blocked="c"),                                  "b",   ()),
    "not a blocked cell":                   (step(way(), blocked="b"),                                  "",    ()),
    "up to a cell of its own":              (step(way("a", "bacdefgh")),                                "b",   ()),
    "up to a held cell":                    (step(way(), other("r2", "c")),                             "b",   ()),
    "up to a silent robot's cell":          (step(way(), silent=(other("r8", "c", stamp=0),)),          "b",   ()),
    "up to a claimed cell":                 (step(way(), other("r2", "k", Claim(C, 5, 1))),             "b",   ()),
    "not a claimed cell":                   (step(way(), other("r2", "k", Claim(B, 5, 1))),             "",    ("r2",)),
    "a held cell, if it is the next":       (step(way(), other("r2", "b"), silent=(other("r8", "p"),)), "bc",  ("r2",)),
    "not a silent robot's cell":            (step(way(), other("r2", "k"), silent=(SILENT,)),           "",    ("r8",)),
    "nor if one of two is silent":          (step(way(), other("r2", "b"), silent=(SILENT,)),           "",    ("r2", "r8")),
    "another cell was seen to be empty":    (step(way(), other("r2", "b"), silent=(SILENT,), cleared="c"), "", ("r2", "r8")),
    "or the silent one's own":              (step(way(), other("r2", "b"), silent=(SILENT,), cleared="b"), "bc", ("r2",)),
    "but one that was seen to be empty":    (step(way(), silent=(SILENT,), cleared="b"),                "bc",  ()),
    "not what a robot at its stop needs":   (step(way(), AT_STOP),                                      "",    ("r2",)),
    "unless it holds some of that":         (step(way("ac", "bdefgh"), AT_STOP),                        "b",   ()),
    "or a joint plan leads it there":       (step(way(steps=(0,)), AT_STOP, entries={}),                "bc",  ()),
    "in a plan, when it is its turn":       (step(way(steps=(0,)), COMING, entries={}),                 "bc",  ()),
    "not before it is":                     (step(way(steps=(0,)), COMING, entries={1: Entry(1, "r2", 1)}), "", ("r2",)),
    "up to where it is not":                (step(way(steps=(0,)), COMING, entries={2: Entry(2, "r2", 1)}), "b", ()),
    "if it comes next":                     (step(way(steps=(0,)), THERE, entries={1: Entry(1, "r2", 1)}),  "bc", ("r2",)),
    "but only the next cell":               (step(way(steps=(0,)), replace(THERE, held=(BESIDE_B,)), entries={2: Entry(2, "r2", 1)}), "b", ()),
}
# fmt: on


@pytest.mark.parametrize("name", ASKS)
def test_the_next_cells_are_claimed_in_order(name: str) -> None:
    after, cells, waits = ASKS[name]
    assert (claimed(after), after.waits, after.took) == (cells, waits, False)
    numbers = [claim.number for claim in after.progress.reservations.claims]
    assert numbers == list(range(1, len(cells) + 1))


# --- what it takes ---

RIPE, YOUNG = Claim(B, 1, NOW - 8), Claim(B, 1, NOW - 7)
OLD, OLDER = Claim(B, 1, NOW - 39), Claim(B, 1, NOW - 40)
R2, ACKED = other("r2", "k"), other("r2", "k", acks=ACK)
R3 = other("r3", "l")

# fmt: off
TAKES: dict[str, tuple[ClaimResult, str, tuple[str, ...], bool]] = {  # the step: cells held, who is waited for, if it took one
    "all have acknowledged":                 (step(way("a", "bc", RIPE), ACKED),                        "ab",  (), True),
    "nobody is near":                        (step(way("a", "bc", RIPE)),                               "ab",  (), True),
    "wherever in its cell it is":            (step(way("a", "bc", RIPE), off=0.3),                      "ab",  (), True),
    "too young":                             (step(way("a", "bc", YOUNG), ACKED),                       "a",   (), False),
    "not acknowledged":                      (step(way("a", "bc", OLD), R2),                            "a",   (), False),
    "not for long":                          (step(way("a", "bc", OLDER), R3, R2),                      "a",   ("r2", "r3"), False),
    "one of two has not for long":           (step(way("a", "bc", OLDER), R3, ACKED),                   "a",   ("r3",), False),
    "somebody holds it":                     (step(way("a", "bc", OLDER), other("r2", "b"), R3),        "a",   ("r2",), False),
    "two at once":                           (step(way("a", "bc", RIPE, Claim(C, 2, NOW - 8))),         "abc", (), True),
    "its turn in a plan":                    (step(way("a", "bc", RIPE, steps=(0,)), entries={}),       "ab",  (), True),
    "not its turn: nobody keeps the cell":   (step(way("a", "bc", RIPE, steps=(0,)), COMING, entries={1: Entry(1, "r2", 1)}), "a", (), False),
    "its own again":                         (step(way("ab", "ac"), body="b"),                          "aba", (), False),
    "its own, but another holds it too":     (step(way("ab", "ac"), other("r2", "a"), body="b"),        "ab",  (), False),
    "its own, but a claim is open":          (step(way("ab", "ac", Claim(C, 1, NOW - 8)), body="b"),    "ab",  (), False),
    "its own, but not its turn":             (step(way("ab", "ac", steps=(0, 1)), COMING, entries={2: Entry(2, "r2", 1)}, body="b"), "ab", ("r2",), False),
}
# fmt: on


@pytest.mark.parametrize("name", TAKES)
def test_a_claimed_cell_is_taken_once_all_near_have_acknowledged(name: str) -> None:
    after, cells, waits, took = TAKES[name]
    assert (names(after.progress.reservations.held), after.waits, after.took) == (cells, waits, took)


# --- room beside its way ---


def besides(after: ClaimResult) -> str:
    return names(tuple(claim.cell for claim in after.progress.reservations.beside))


# fmt: off
ROOMS: dict[str, tuple[ClaimResult, str]] = {  # the step: cells beside the way that are claimed
    "each":                                  (step(way("a", "b"), room="ij"),                            "ij"),
    "four at a time":                        (step(way("a", "b"), room="ijklm", settings=WIDE),          "ijkl"),
    "none that it holds, claims or comes to": (step(way("a", "bcd"), room="abci"),                       "i"),
    "nothing blocked":                       (step(way("a", "b"), room="ij", blocked="i"),               "j"),
    "nothing too far":                       (step(way("a", "b"), room="klm", off=0.0),                  "k"),
    "nothing that somebody holds":           (step(way("a", "b"), other("r2", "i"), room="ij"),          "j"),
    "at its stop, one of its way too":       (step(way("a", "bc"), room="bi", docking="bi"),             "bi"),
    "nothing where walls stop the radio":    (step(way("a", "b"), room="ij", settings=IN_SIGHT),         ""),
}
# fmt: on


@pytest.mark.parametrize("name", ROOMS)
def test_room_is_claimed_beside_the_way(name: str) -> None:
    after, cells = ROOMS[name]
    assert besides(after) == cells


def asking(stamp: int = NOW - 8) -> RouteProgress:
    """Return the progress of a robot without a way that has claimed i."""
    return RouteProgress(Reservations((A,), (), 2, (Claim(BELOW, 1, stamp),)), (ALONE,))


def test_room_is_taken_once_all_near_have_acknowledged() -> None:
    taken = step(asking(), ACKED, room="i").progress
    assert (taken.reservations, taken.steps) == (Reservations((BELOW, A), (), 2), (BESIDE, ALONE))
    for progress, near in ((asking(), R2), (asking(NOW - 7), ACKED)):
        assert step(progress, near, room="i").progress == progress
    assert step(asking(), ACKED).progress == RouteProgress(Reservations((A,), (), 2), (ALONE,)), "no longer wanted"


# --- where walls stop the radio ---

CORNER = Drawn("ab#", "#cd")  # from a, c cannot be seen: a robot leans 0.29 m towards b


@pytest.mark.parametrize(("off", "heard"), [(0.0, False), (0.18, False), (0.2, True), (0.38, True), (0.4, False)])
def test_round_a_corner_it_claims_and_takes_from_where_it_leans(off: float, heard: bool) -> None:
    a, b = CORNER.at("ab")
    asks = RouteProgress(Reservations((a,)), (ALONE,), (b,))
    after = step(asks, off=off, settings=IN_SIGHT, floor=CORNER)
    assert bool(after.progress.reservations.claims) is heard
    asked = asks._replace(reservations=Reservations((a,), (Claim(b, 1, NOW - 8),), 2))
    assert step(asked, off=off, settings=IN_SIGHT, floor=CORNER).took is heard
    assert step(asked, off=off, settings=NEAR, floor=CORNER).took


@pytest.mark.parametrize(("off", "heard"), [(-0.11, False), (-0.09, True), (0.09, True), (0.11, False)])
def test_where_no_corner_hides_the_next_cell_it_claims_from_the_middle_of_its_own(off: float, heard: bool) -> None:
    assert bool(claimed(step(way(), off=off, settings=IN_SIGHT))) is heard


YARD = Drawn("abcdefg", "hijklmn", "opqrstu", "vwxyzAB", "CDEFGHI")
ALL = tuple(range(35))


def progress(held: str, beside: int = 0) -> RouteProgress:
    """Return a way over held cells, the first ``beside`` of them off it."""
    return RouteProgress(Reservations(YARD.at(held)), (BESIDE,) * beside + (ALONE,) * (len(held) - beside))


def asked(way: RouteProgress, at: str, others: dict[str, str] | None = None, sweeps: tuple[int, ...] = ALL) -> str:
    """Return the cells asked for by name; ``others`` hold, claim or plan (``ahead``) what is named."""
    told: dict[str, tuple[object, ...]] = {field: YARD.at(names) for field, names in (others or {}).items()}
    if others and "claims" in others:
        told["claims"] = tuple(Claim(cell, 1, 0) for cell in YARD.at(others["claims"]))
    record = replace(Record(robot="r2", stamp=0, x=0.0, y=0.0, goal=0), **told)
    return named(list_room_cells(way, YARD.pose(*YARD.at(at)), sweeps, {"r2": record}, (), YARD.cells))


def named(cells: tuple[int, ...]) -> str:
    names = {YARD.cell(place): name for name, place in YARD.names.items()}
    return "".join(sorted(names[cell] for cell in cells))


# fmt: off
BESIDES: dict[str, tuple[RouteProgress, str, dict[str, str], str]] = {  # way, where it is, what others need: asks for
    "two cells and what is beside them":  (progress("rs"),         "r",  {},                              "klqrstyz"),
    "not what is beside its room":        (progress("krs", 1),     "r",  {},                              "klqrstyz"),
    "in its head cell":                   (progress("rs"),         "s",  {},                              ""),
    "with one cell alone":                (progress("r"),          "r",  {},                              ""),
    "what others hold, claim and plan":   (progress("rs"),         "r",  {"held": "k", "claims": "l", "ahead": "qt"}, "rsyz"),
}
# fmt: on


@pytest.mark.parametrize("name", BESIDES)
def test_the_cells_beside_a_way(name: str) -> None:
    way, at, others, cells = BESIDES[name]
    others = {field: names for field, names in others.items() if names}
    assert asked(way, at, others) == "".join(sorted(cells))
    assert asked(way, at, others, sweeps=()) == ""


# fmt: off
BACK: dict[str, tuple[str, int, str, dict[str, str], str]] = {  # held, how many beside, where it is, others: asks for
    "only a corner is between":           ("jrs",  1, "j", {},               "kq"),
    "of the two one is another's":        ("jrs",  1, "j", {"held": "k"},    "q"),
    "both are another's":                 ("jrs",  1, "j", {"ahead": "kq"},  ""),
    "one of the two is held: kept":       ("qjrs", 2, "j", {},               "kq"),
    "whatever others plan":               ("qjrs", 2, "j", {"ahead": "kq"},  "q"),
    "it shares a side with its way":      ("krs",  1, "k", {},               ""),
    "it is on its way":                   ("jrs",  1, "r", {},               ""),
    "two cells off, it drives about":     ("irs",  1, "i", {},               ""),
}
# fmt: on


@pytest.mark.parametrize("name", BACK)
def test_back_to_its_way_round_a_corner(name: str) -> None:
    held, beside, at, others, cells = BACK[name]
    assert asked(progress(held, beside), at, others, sweeps=()) == cells


@pytest.mark.parametrize(("walled", "back", "room"), [(False, (), (0,)), (True, (1,), ())])
def test_a_wall_between_a_cell_and_its_way_leads_round_it(walled: bool, back: tuple[int, ...], room: object) -> None:
    """The way is 2, 5, 4, 3. A wall stands between 0 and 3, along all their common side."""
    fine = OccupancyMap(np.zeros((8, 12), np.uint8), 0.3)
    fine.cells[4, 0:4] = walled
    cells = CellMap(fine, side=1.2, radius=0.23)
    astray = RouteProgress(Reservations((0, 2, 5, 4, 3)), (BESIDE, *(ALONE,) * 4))
    assert list_room_cells(astray, Pose(0.6, 0.6, 0.0), (), {}, (), cells) == back
    beside = RouteProgress(Reservations((1, 2, 5, 4, 3)), (BESIDE, *(ALONE,) * 4))
    assert list_room_cells(beside, Pose(1.8, 0.6, 0.0), (0,), {}, (), cells) == room


def test_who_strayed_into_a_lane_half_a_cell_wide_asks_for_the_cells_along_its_way_back() -> None:
    """It cannot stand in its cell 4, and its body is in 3 too; to get to 7 it drives through 6 as well."""
    cells = CellMap(lane(), side=SIDE, radius=0.23)
    astray = RouteProgress(Reservations((3, 4, 7, 8)), (BESIDE, BESIDE, ALONE, ALONE))
    assert not cells.stands[4]
    assert list_room_cells(astray, Pose(1.25, 2.0, 0.0), (), {}, (), cells) == (6,)
    keeps = RouteProgress(Reservations((3, 4, 6, 7, 8)), (BESIDE,) * 3 + (ALONE,) * 2)
    plans = Record(robot="r2", stamp=0, x=0.0, y=0.0, goal=6, ahead=(6,))
    assert list_room_cells(keeps, Pose(1.25, 2.0, 0.0), (), {"r2": plans}, (), cells) == (6,), "what it has, it keeps"


def threatened(*places: tuple[str, float, float], floor: Drawn = YARD, held: str = "") -> str:
    """Return the cells asked for in the middle, with threats some way off the middles of cells [m]."""
    threats = [(floor.pose(*floor.at(name)), dx, dy) for name, dx, dy in places]
    moving = tuple(MovingObstacle(pose.x + dx, pose.y + dy, 0.0, 0.0) for pose, dx, dy in threats)
    others = {"r2": Record(robot="r2", stamp=0, x=0.0, y=0.0, goal=0, held=floor.at(held), ahead=floor.at("k"))}
    return named(list_room_cells(progress("r"), floor.pose(*floor.at("r")), (), others, moving, floor.cells))


WALLED = Drawn("abcdefg", "hij#lmn", "opqrstu", "vwx.zAB", "CDEFGHI")


def test_before_a_threat_it_asks_for_all_cells_round_it_that_are_farther_off() -> None:
    """A threat on the left of the cell r, in the middle of j k l / q r s / x y z."""
    assert threatened(("q", 0.1, 0.0)) == "jklsxyz"
    assert threatened(("q", -0.1, 0.0)) == "klsyz", "j and x are nearer to it than r"
    assert threatened(("q", 0.1, 0.0), held="s") == "jklxyz", "what another only plans is asked for"
    assert threatened(("k", 0.0, -0.1)) == "jlqsxyz"
    assert threatened(("q", 0.1, 0.0), ("o", 0.0, 0.0)) == "jklsxyz", "the nearer one counts"
    assert threatened(("q", 0.1, 0.0), ("s", -0.1, 0.0)) == "jklxyz"


def test_before_a_threat_it_asks_for_no_cell_that_it_cannot_stand_in() -> None:
    x, y = WALLED.cells.centre(WALLED.at("q")[0])
    got = list_room_cells(
        progress("r"), WALLED.pose(*WALLED.at("r")), (), {}, (MovingObstacle(x + 0.1, y, 0.0, 0.0),), WALLED.cells
    )
    assert named(got) == "jlsxyz"
