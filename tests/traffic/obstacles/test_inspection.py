"""Looks at a cell that only a silent robot keeps: when a robot looks, what it judges, and what it forgets."""

from math import pi
from typing import Any

import pytest
from msgspec.structs import replace

from swarm.messages.traffic import Claim, Record, Sighting
from swarm.traffic.interface import TrafficInputs
from swarm.traffic.obstacles.inspection import Inspection, Inspector
from swarm.traffic.obstacles.scan import Scan
from swarm.traffic.peers.situation import Situation
from swarm.traffic.reservations.route import ALONE, RouteProgress
from swarm.traffic.reservations.rules import Reservations
from swarm.traffic.settings import TrafficConstants
from tests.traffic.maps import Drawn

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
    place = (silent().x, silent().y)
    assert one.remembered({"r2": silent()}, ROW.cells) == {C}
    assert one.still_bodies({"r2": silent()}, (), pose, ROW.cells) == (place,)
    looked(one, silent(), measured=BODY)
    assert one.remembered({"r2": silent()}, ROW.cells) == {C}, "it is there"
    looked(one, silent())
    assert one.remembered({"r2": silent()}, ROW.cells) == frozenset()
    assert one.still_bodies({"r2": silent()}, (), pose, ROW.cells) == ()
    assert one.remembered({"r2": silent(stamp=1)}, ROW.cells) == {C}
    assert one.still_bodies({"r2": silent(stamp=1)}, (), pose, ROW.cells) == (place,)


def test_bodies_stand_near_within_two_cells() -> None:
    one, (x, y) = lookout(), ROW.cells.centre(B)
    for away, near in ((2.39, True), (2.41, False)):
        place = (x + away, y)
        assert one.still_bodies({"r2": silent(away)}, (), ROW.pose(B), ROW.cells) == ((place,) if near else ())
        assert one.still_bodies({}, [place], ROW.pose(B), ROW.cells) == ((place,) if near else ())
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
