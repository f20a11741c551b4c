"""Looks at a cell that only a silent robot keeps: when a robot looks, what it judges, and what it forgets."""

from math import atan2, cos, pi, sin
from typing import Any

import pytest
from msgspec.structs import replace

from swarm.messages.traffic import Claim, Record, Sighting
from swarm.traffic.interface import TrafficInputs
from swarm.traffic.obstacles.inspection import Inspection, Inspector, View, has_gone, is_out_of_range, judge_cell
from swarm.traffic.obstacles.scan import Reading, Scan
from swarm.traffic.peers.situation import Situation
from swarm.traffic.reservations.route import ALONE, RouteProgress
from swarm.traffic.reservations.rules import Reservations
from swarm.traffic.settings import TrafficConstants
from tests.traffic.maps import SIDE, Drawn

ROW = Drawn("abcde")
A, B, C, D, E = ROW.at("abcde")
SETTINGS = TrafficConstants(radius=0.2, sensor_range=1.6, surmise=200)
NOW = 201  # the first tick at which a robot last heard at tick 0 has long been silent
MIDDLE = 1.2  # m, from the middle of b to that of c
BODY = MIDDLE - 2 * SETTINGS.radius  # m, what a ray measures from there if a body stands in the middle of c
FAR = 1.6  # m, what a ray measures if nothing is there
RAYS = tuple(0.05 * number for number in range(-16, 17))  # rad


def silent(away: float = MIDDLE, **fields: object) -> Record:
    """Return the last record of r2, which holds c and was ``away`` [m] from the middle of b, to the right."""
    x, y = ROW.cells.centre(B)
    return replace(Record(robot="r2", stamp=0, x=x + away, y=y, goal=E, held=(C,)), **fields)


def looked(
    lookout: Inspector,
    *others: Record,
    measured: float = FAR,
    at: float = 0.0,
    yaw: float = 0.0,
    waits: tuple[str, ...] = ("r2",),
    held: tuple[int, ...] = (B,),
    fresh: tuple[str, ...] = (),
    cleared: frozenset[tuple[str, int]] = frozenset(),
) -> Inspection:
    """Look from ``at`` [m] right of the middle of b; every ray measures the same."""
    heard = {record.robot: record for record in others}
    situation = Situation(
        tick=NOW, cells=ROW.cells, head=B, goal=E, cleared=cleared, others=heard, fresh={robot: heard[robot] for robot in fresh}
    )  # fmt: skip
    pose = ROW.pose(B, yaw)
    scan = Scan(RAYS, [measured] * len(RAYS), lambda bearings: [FAR] * len(bearings))
    inputs = TrafficInputs(NOW, pose._replace(x=pose.x + at), None, scan=scan)
    progress = RouteProgress(Reservations(held), (ALONE,) * len(held), (C, D))
    return lookout.inspect(progress, situation, waits, inputs)


def lookout() -> Inspector:
    return Inspector(SETTINGS)


NOTHING = Inspection()
BEYOND = ROW.cells.centre(B)[0] + 1.3, ROW.cells.centre(B)[1]
CENTRE = ROW.cells.centre(C)
TAKEN, FREE = (Inspection(CENTRE, Sighting(C, empty, NOW)) for empty in (False, True))
WAITED = Record(robot="r3", stamp=0, x=-9.0, y=0.0, goal=A, held=(A,))

# fmt: off
LOOKS: dict[str, tuple[tuple[Record, ...], dict[str, Any], Inspection]] = {
    "its body stands there":                 ((silent(),),                         {"measured": BODY},             TAKEN),
    "it has gone":                           ((silent(),),                         {},                             FREE),
    "a claim is enough":                     ((silent(held=(), claims=(Claim(C, 1, 0),)),), {},                    FREE),
    "it was last heard elsewhere":           ((silent(-9.0),),                     {},                             FREE),
    "elsewhere, but a body is there":        ((silent(-9.0),),                     {"measured": BODY},             TAKEN),
    "faces it closely enough":               ((silent(),),                         {"measured": BODY, "yaw": 0.09}, TAKEN),
    "turns to it first":                     ((silent(1.3),),                      {"measured": BODY, "yaw": 0.11}, Inspection(BEYOND)),
    "turns to the cell first":               ((silent(-9.0),),                     {"yaw": pi / 2},                Inspection(CENTRE)),
    "not long silent":                       ((silent(stamp=1),),                  {},                             NOTHING),
    "one waited for is not long silent":     ((silent(), replace(WAITED, stamp=1)), {"waits": ("r2", "r3")},       NOTHING),
    "both are long silent":                  ((silent(), WAITED),                  {"waits": ("r2", "r3")},        FREE),
    "one that keeps it too is heard":        ((silent(), replace(WAITED, stamp=1, held=(C,))), {},                 NOTHING),
    "one that is heard stands near it":      ((silent(-9.0), silent(2.0, robot="r3", stamp=NOW, held=(D,))), {"fresh": ("r3",)}, FREE),
    "nobody keeps it":                       ((silent(held=(D,)),),                {},                             NOTHING),
    "it was seen empty before":              ((silent(),),                         {"cleared": frozenset({("r2", C)})}, NOTHING),
    "waits for nobody":                      ((silent(),),                         {"waits": ()},                  NOTHING),
    "still has another cell":                ((silent(),),                         {"held": (A, B)},               NOTHING),
    "nearly in the middle":                  ((silent(),),                         {"measured": BODY + 0.24, "at": -0.24}, TAKEN),
    "too far from the middle":               ((silent(),),                         {"measured": BODY + 0.26, "at": -0.26}, NOTHING),
}
# fmt: on


@pytest.mark.parametrize("name", LOOKS)
def test_one_look(name: str) -> None:
    others, how, expected = LOOKS[name]
    assert looked(lookout(), *others, **how) == expected


def test_who_was_seen_to_have_gone_is_remembered_nowhere_until_it_speaks_again() -> None:
    one, pose = lookout(), ROW.pose(B)
    body = (silent().x, silent().y, SETTINGS.radius)
    assert one.cells_of_silent({"r2": silent()}, ROW.cells) == {C}
    assert one.still_bodies({"r2": silent()}, (), pose, ROW.cells) == (body,)
    looked(one, silent(), measured=BODY)
    assert one.cells_of_silent({"r2": silent()}, ROW.cells) == {C}, "it is there"
    looked(one, silent())
    assert one.cells_of_silent({"r2": silent()}, ROW.cells) == frozenset()
    assert one.still_bodies({"r2": silent()}, (), pose, ROW.cells) == ()
    assert one.cells_of_silent({"r2": silent(stamp=1)}, ROW.cells) == {C}
    assert one.still_bodies({"r2": silent(stamp=1)}, (), pose, ROW.cells) == (body,)


def test_bodies_stand_near_within_two_cells() -> None:
    one, (x, y) = lookout(), ROW.cells.centre(B)
    for away, near in ((2.39, True), (2.41, False)):
        place = (x + away, y)
        assert one.still_bodies({"r2": silent(away)}, (), ROW.pose(B), ROW.cells) == (
            ((*place, SETTINGS.radius),) if near else ()
        )
        assert one.still_bodies({}, [place], ROW.pose(B), ROW.cells) == (((*place, SETTINGS.radius),) if near else ())
    assert one.still_bodies({}, (), ROW.pose(B), ROW.cells) == ()


def test_a_body_beyond_the_rays_is_judged_from_where_the_robot_leans() -> None:
    """r2 was last heard 2 m away, with a part of its body in c; the robot leans 0.29 m towards c."""
    one = lookout()
    assert looked(one, silent(2.0)) == NOTHING
    assert one.leans_to == C
    assert looked(one, silent(2.0), waits=(), at=0.40) == NOTHING, "not there yet"
    assert one.leans_to == C
    assert looked(one, silent(2.0), waits=(), at=0.29, measured=2.0 - 0.29 - 0.4) == TAKEN
    assert one.leans_to is None


def test_a_robot_that_leans_gives_up_when_the_silent_one_speaks() -> None:
    one = lookout()
    looked(one, silent(2.0))
    assert looked(one, silent(2.0, stamp=NOW), waits=(), fresh=("r2",)) == NOTHING
    assert one.leans_to is None


def test_a_cell_that_something_hides_is_judged_from_where_the_robot_leans() -> None:
    """r2 was last heard elsewhere; every ray ends before c, first from the middle of b and then from nearer."""
    one, last = lookout(), silent(-9.0)
    assert looked(one, last, measured=0.1) == NOTHING
    assert one.leans_to == C
    assert looked(one, last, waits=(), at=0.15, measured=0.0) == NOTHING, "on its way"
    assert looked(one, last, waits=(), at=0.29, measured=0.0) == TAKEN
    assert one.leans_to is None


# --- what the rays show of a cell, and of a body ---

FLOOR = Drawn(".....", "..a..", ".....")
(MIDST,) = FLOOR.at("a")
HERE = FLOOR.pose(MIDST)
OPEN = 9.0  # m, nothing as far as a ray goes
FAN = (-0.4, -0.2, 0.0, 0.2, 0.4)  # rad
NEXT = 0.5 * SIDE - 0.2  # m, from the edge of a robot in the middle of its cell to the next cell
FAR_EDGE = 1.5 * SIDE - 0.2


def fan(**measured: float) -> list[Reading]:
    """Rays that see as far as the map lets them, but for those named: right, half_right, ahead, half_left, left."""
    names = ("right", "half_right", "ahead", "half_left", "left")
    walls = [min(OPEN, 0.6 / abs(sin(angle)) - 0.2) if angle else OPEN for angle in FAN]  # m, of a corridor 1.2 m wide
    return [Reading(measured.get(name, wall), wall, angle) for name, angle, wall in zip(names, FAN, walls, strict=True)]


WIDE = TrafficConstants(radius=0.2, sensor_range=OPEN)  # no ray ends for lack of range


# fmt: off
VIEWS: dict[str, tuple[list[Reading], View]] = {
    "nothing but the map's walls":        (fan(),                                            View.EMPTY),
    "as far as its far edge":             (fan(ahead=FAR_EDGE),                              View.EMPTY),
    "less than that":                     (fan(ahead=FAR_EDGE - 0.1),                        View.OCCUPIED),
    "just inside":                        (fan(ahead=NEXT + 0.01),                           View.OCCUPIED),
    "in its corner":                      (fan(left=0.9),                                    View.OCCUPIED),
    "before a wall":                      (fan(right=1.2),                                   View.OCCUPIED),
    "one ray ends before it":             (fan(left=0.1),                                    View.EMPTY),
    "most rays end before it":            (fan(half_right=0.1, ahead=0.1, half_left=0.1),    View.HIDDEN),
    "the map has a wall before it":       ([Reading(0.3, 0.3, 0.0)],                         View.HIDDEN),
    "no ray goes there":                  ([Reading(OPEN, OPEN, 2.0)],                       View.HIDDEN),
}
# fmt: on


@pytest.mark.parametrize("name", VIEWS)
@pytest.mark.parametrize("yaw", [0.0, 0.2, -0.2])
def test_what_the_rays_say_of_the_next_cell(name: str, yaw: float) -> None:
    readings, seen = VIEWS[name]
    turned = [reading._replace(bearing=reading.bearing - yaw) for reading in readings]
    assert judge_cell(turned, HERE._replace(yaw=yaw), MIDST + 1, FLOOR.cells, WIDE) is seen


@pytest.mark.parametrize(
    ("away", "off", "measured", "gone"),
    [
        (1.2, 0.0, 1.6, True),  # the ray sees beyond where the body was
        (1.2, 0.05, 1.6, True),  # and through a part of it
        (1.2, 0.0, 0.8, False),  # the body is what it sees
        (1.2, 0.2, 1.6, False),  # no ray points there
        (1.2, pi, 1.6, False),
        (3.0, 0.0, 1.6, False),  # too far off to be seen
    ],
)
def test_a_body_has_gone_where_a_ray_sees_beyond_it(away: float, off: float, measured: float, gone: bool) -> None:
    body = HERE.x + away * cos(HERE.yaw + off), HERE.y + away * sin(HERE.yaw + off), 0.2
    assert has_gone(body, HERE, [Reading(measured, 1.6, 0.0)], 0.2) is gone


@pytest.mark.parametrize(("away", "hidden"), [(1.0, False), (1.81, False), (1.83, True), (3.0, True)])
def test_what_is_beyond_the_rays_is_looked_at_from_nearer(away: float, hidden: bool) -> None:
    settings = TrafficConstants(radius=0.2, sensor_range=1.6)
    assert is_out_of_range((HERE.x + away, HERE.y, 0.2), HERE, settings) is hidden


# fmt: off
GONE: list[tuple[float, float, float, bool]] = [  # how far off it was [m], how far off the ray points [rad], what it measures
    (1.2,  0.0,   0.89, False),  # its near edge is 0.8 m from the robot's; 0.1 m more counts
    (1.2,  0.0,   0.91, True),
    (1.2,  0.1,   0.93, False),  # 0.12 m beside its middle its edge is at 0.834 m
    (1.2,  0.1,   0.94, True),
    (1.2,  -0.1,  0.93, False),
    (1.2,  -0.1,  0.94, True),
    (1.2,  0.132, 1.6,  True),   # 0.158 m beside its middle; what is 0.16 m beside it may miss the body
    (1.2,  0.136, 1.6,  False),
    (0.15, 1.1,   1.6,  True),
    (0.15, 2.1,   1.6,  False),  # it points away
]
# fmt: on


@pytest.mark.parametrize(("away", "off", "measured", "gone"), GONE)
@pytest.mark.parametrize("yaw", [0.0, 2.5])
def test_where_a_body_was_a_ray_has_to_see_beyond_its_edge(
    away: float, off: float, measured: float, gone: bool, yaw: float
) -> None:
    body = HERE.x + away * cos(yaw), HERE.y + away * sin(yaw), 0.2
    reading = Reading(measured, 1.6, -0.3 - off)
    assert has_gone(body, HERE._replace(yaw=yaw + 0.3), [reading], 0.2) is gone


# fmt: off
CROSSINGS: list[tuple[list[tuple[float, float, float]], View]] = [  # bearing, measured and expected of rays
    ([(0.0, 1.56, OPEN)],                                      View.EMPTY),     # it leaves the cell at 1.8 m - 0.2 m
    ([(0.0, 1.54, OPEN)],                                      View.OCCUPIED),
    ([(0.0, 0.31, OPEN)],                                      View.OCCUPIED),  # it enters it at 0.6 m - 0.2 m
    ([(0.0, 0.29, OPEN)],                                      View.HIDDEN),
    ([(0.0, 0.96, 1.0)],                                       View.EMPTY),     # a wall within the cell
    ([(0.0, 0.94, 1.0)],                                       View.OCCUPIED),
    ([(0.0, 0.39, 0.39)],                                      View.HIDDEN),    # a wall before it
    ([(0.0, 0.41, 0.41)],                                      View.EMPTY),
    ([(0.4, 1.30, OPEN)],                                      View.EMPTY),     # it leaves it to a side at 1.54 m - 0.2 m
    ([(0.4, 1.28, OPEN)],                                      View.OCCUPIED),
    ([(-0.4, 1.30, OPEN)],                                     View.EMPTY),
    ([(-0.4, 1.28, OPEN)],                                     View.OCCUPIED),
    ([(0.4, 0.36, OPEN)],                                      View.OCCUPIED),  # it enters it at 0.65 m - 0.2 m
    ([(0.4, 0.34, OPEN)],                                      View.HIDDEN),
    ([(pi / 2, 1.6, OPEN)],                                    View.HIDDEN),    # rays that miss it
    ([(-pi / 2, 1.6, OPEN)],                                   View.HIDDEN),
    ([(pi, 1.6, OPEN)],                                        View.HIDDEN),
    ([(0.8, 1.6, OPEN)],                                       View.HIDDEN),
    ([(0.0, 1.6, OPEN), (0.1, 0.1, OPEN)],                     View.HIDDEN),    # as many rays end before it
    ([(0.0, 1.6, OPEN), (0.1, 0.1, OPEN), (0.2, 1.6, OPEN)],   View.EMPTY),
    ([(0.0, 0.1, OPEN), (0.1, 0.1, OPEN), (0.2, 1.6, OPEN)],   View.HIDDEN),
]
# fmt: on


@pytest.mark.parametrize(("rays", "seen"), CROSSINGS)
@pytest.mark.parametrize(("across", "up"), [(1, 0), (0, 1), (-1, 0), (0, -1)])
def test_where_a_ray_enters_a_cell_and_leaves_it(
    rays: list[tuple[float, float, float]], seen: View, across: int, up: int
) -> None:
    pose = HERE._replace(yaw=atan2(up, across))
    readings = [Reading(measured, expected, angle) for angle, measured, expected in rays]
    assert judge_cell(readings, pose, MIDST + across + up * FLOOR.cells.columns, FLOOR.cells, WIDE) is seen


@pytest.mark.parametrize(
    ("back", "measured", "wall", "seen"),
    [
        (0.0, 1.6, 1.6, View.EMPTY),  # from the middle, the rays reach the far edge of the next cell
        (0.04, 1.6, 1.6, View.EMPTY),
        (0.2, 1.6, 1.6, View.HIDDEN),  # a body may stand behind their ends
        (0.2, 1.56, 1.6, View.HIDDEN),
        (0.2, 1.5, 1.6, View.OCCUPIED),
        (0.2, 1.4, 1.4, View.EMPTY),  # a wall of the map
    ],
)
def test_a_ray_that_ends_in_a_cell_does_not_show_that_it_is_empty(
    back: float, measured: float, wall: float, seen: View
) -> None:
    pose = HERE._replace(x=HERE.x - back)
    assert judge_cell([Reading(measured, wall, 0.0)], pose, MIDST + 1, FLOOR.cells, SETTINGS) is seen
