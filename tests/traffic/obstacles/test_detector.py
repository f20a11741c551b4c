"""Bodies that rays show: which robot explains them, how long a stop lasts, and when a body counts as fixed."""

from collections.abc import Sequence
from math import cos, pi, sin
from typing import Any

import pytest

from swarm.geometry import Pose
from swarm.messages.traffic import Claim, Record
from swarm.traffic.interface import TrafficInputs
from swarm.traffic.obstacles.detector import (
    ABOUT,
    AT_LAST,
    CLOSE,
    COMING,
    HALTED,
    LINGERS,
    NEARER,
    NOTED,
    STILL,
    ObstacleDetector,
    ProtectiveStop,
    robot_at,
)
from swarm.traffic.obstacles.scan import (
    KnownBody,
    Reading,
    Scan,
    body_centre,
    find_unexpected,
)
from swarm.traffic.settings import TrafficConstants
from tests.traffic.maps import Drawn

FLOOR = Drawn(".....", "..a.b", ".....")
A, B = FLOOR.at("ab")
SETTINGS = TrafficConstants()
HERE = FLOOR.pose(A)
STOP, LESS = SETTINGS.stop_distance, SETTINGS.unexpected


def front(measured: float, expected: float = 1.6) -> Reading:
    return Reading(measured, expected, 0.0)


@pytest.mark.parametrize(
    ("measured", "expected", "body"),
    [
        (STOP - 0.01, 1.6, True),
        (0.4, 0.4, False),  # the map's wall
        (0.4, 0.4 + 0.9 * LESS, False),  # as exact as walls are known
        (0.4, 0.4 + 1.1 * LESS, True),
        (0.5, 0.3, False),
    ],
)
def test_a_body_is_near_and_nearer_than_the_map_has_it(measured: float, expected: float, body: bool) -> None:
    assert front(measured, expected).is_body(SETTINGS) is body


def ahead(measured: float, side: float = 0.0) -> tuple[float, float]:
    """The middle of a body as large as a robot's half that is seen so far off, and to the left of it."""
    return HERE.x + 1.5 * SETTINGS.radius + measured, HERE.y + side


def unexplained(bodies: Sequence[Reading], pose: Pose, known: Sequence[KnownBody]) -> tuple[float, float] | None:
    """Return where the first body that none of the known ones explains has its middle."""
    found = next(find_unexpected(bodies, pose, FLOOR.cells, known, SETTINGS), None)
    return None if found is None else body_centre(pose, found, SETTINGS.radius)


def cell(x: float, y: float) -> int:
    return FLOOR.cells.cell_of(x, y)


@pytest.mark.parametrize("yaw", [0.0, pi / 2, -pi / 2])
def test_what_nobody_told_of_is_where_it_is_seen(yaw: float) -> None:
    pose = HERE._replace(yaw=yaw)
    reading = Reading(0.4, 1.6, -yaw)  # along x, whichever way the robot faces
    assert unexplained([reading], pose, []) == pytest.approx(ahead(0.4))
    assert unexplained([], pose, []) is None


# fmt: off
EXPLAINED: dict[str, tuple[KnownBody, bool]] = {  # of a body seen 0.4 m ahead
    "a robot that is there":               (KnownBody(ahead(0.4), 0.2),                               True),
    "a little off, ahead":                 (KnownBody(ahead(0.55), 0.2),                              True),
    "a little off, to a side":             (KnownBody(ahead(0.4, 0.15), 0.2),                         True),
    "too far to a side":                   (KnownBody(ahead(0.4, 0.3), 0.2),                          False),
    "too far on":                          (KnownBody(ahead(0.7), 0.2),                               False),
    "behind":                              (KnownBody((HERE.x - 0.7, HERE.y), 0.2),                   False),
    "held, in that cell":                  (KnownBody(ahead(0.4), 0.2, {cell(*ahead(0.4))}),          True),
    "held, in another cell":               (KnownBody(ahead(0.4), 0.2, {B}),                          False),
    "nearer than it can be":               (KnownBody(ahead(0.4), 0.2, nearest=0.5),                  False),
    "as near as it can be":                (KnownBody(ahead(0.4), 0.2, nearest=0.4),                  True),
}
# fmt: on


@pytest.mark.parametrize("name", EXPLAINED)
def test_what_is_known_explains_what_is_seen_where_it_can_be(name: str) -> None:
    known, explained = EXPLAINED[name]
    found = unexplained([front(0.4)], HERE, [KnownBody((0.0, 0.0), 0.1), known])
    assert (found is None) is explained
    both = [front(0.4), Reading(0.3, 1.6, 2.0)]
    assert unexplained(both, HERE, [known]) is not None, "the other ray shows another one"


@pytest.mark.parametrize(("bearing", "stops"), [(0.0, True), (0.5, True), (-0.5, True), (0.55, False), (-1.0, False)])
def test_a_known_body_very_near_stops_who_drives_at_it_not_who_drives_past(bearing: float, stops: bool) -> None:
    pose = HERE._replace(yaw=-bearing)  # the body is along x
    known = KnownBody(ahead(0.1), 0.2, nearest=CLOSE)
    found = unexplained([Reading(0.1, 1.6, bearing)], pose, [known])
    assert (found is not None) is stops


def test_what_the_map_would_show_is_asked_for_only_when_something_is_near() -> None:
    def never(_: Sequence[float]) -> list[float]:
        raise AssertionError("nobody needs that")

    assert Scan((0.0,), (STOP,), never).body_readings(SETTINGS, STOP) == []
    assert Scan((0.0, 1.0), (0.3, 0.4), lambda _: [0.3, 1.6]).body_readings(SETTINGS, STOP) == [Reading(0.4, 1.6, 1.0)]
    assert Scan().readings == ()


# --- how long it stops ---


def halts(
    *measured: float,
    others: tuple[Record, ...] = (),
    mine: frozenset[int] = frozenset(),
    bearing: float = 0.0,
    expected: float = 1.6,
    halting: ObstacleDetector | None = None,
    start: int = 100,
) -> list[ProtectiveStop]:
    """Look in one direction, straight ahead by default, tick by tick."""
    halting = halting or ObstacleDetector(SETTINGS)
    return [
        halting.detect(
            TrafficInputs(start + tick, HERE, None, scan=Scan((bearing,), (one,), lambda _: (expected,))),
            others,
            mine,
            FLOOR.cells,
        )
        for tick, one in enumerate(measured)
    ]


def test_it_stops_as_long_as_something_is_near_and_says_once_that_it_stays() -> None:
    said = halts(*[1.6] * 3, *[0.4] * HALTED)
    assert [halt.stopped for halt in said] == [False] * 3 + [True] * HALTED
    assert all(halt.found is None for halt in said)
    said = halts(*[0.4] * (HALTED + 1))
    assert said[-1].stopped
    assert said[-1].found == pytest.approx(ahead(0.4))
    said = halts(*[0.4] * (HALTED + 40))
    assert [halt.found is not None for halt in said].count(True) == 1
    assert not said[-1].stopped, "it is known now, and driven round"


def test_what_goes_away_in_between_begins_anew() -> None:
    said = halts(*[0.4] * HALTED, 1.6, *[0.4] * HALTED)
    assert all(halt.found is None for halt in said)
    assert [halt.stopped for halt in said] == [True] * HALTED + [False] + [True] * HALTED


@pytest.mark.parametrize("bearing", [pi / 3, 0.0, -pi / 3], ids=["left", "ahead", "right"])
def test_it_stops_for_what_it_sees_to_either_side_too(bearing: float) -> None:
    said = halts(*[0.4] * (HALTED + 2), bearing=bearing)
    assert [halt.stopped for halt in said] == [True] * (HALTED + 1) + [False]
    (found,) = [halt.found for halt in said if halt.found is not None]
    away = 1.5 * SETTINGS.radius + 0.4
    assert found == pytest.approx((HERE.x + away * cos(bearing), HERE.y + away * sin(bearing)))
    assert not any(halt.stopped for halt in halts(*[1.6] * 5, bearing=bearing))


def test_a_wall_of_the_map_never_stops_it_and_is_no_thing_found() -> None:
    said = halts(*[0.4] * (2 * HALTED), expected=0.4)
    assert said == [ProtectiveStop(stopped=False)] * (2 * HALTED)


def test_a_robot_that_is_heard_never_stops_it_and_is_no_thing_found() -> None:
    x, y = ahead(0.4)
    others = (Record(robot="r2", stamp=100, x=x, y=y, goal=B, held=(cell(x, y),)),)
    assert halts(*[0.4] * (2 * HALTED), others=others) == [ProtectiveStop(stopped=False)] * (2 * HALTED)
    behind = (Record(robot="r2", stamp=100, x=HERE.x - 1.0, y=y, goal=B, held=(cell(HERE.x - 1.0, y),)),)
    assert halts(0.4, others=behind)[0].stopped


def test_a_thing_found_explains_what_is_seen_there_and_nothing_else() -> None:
    halting = ObstacleDetector(SETTINGS)
    (*_, last) = halts(*[0.4] * (HALTED + 1), halting=halting)
    assert last.found is not None
    assert halting.obstacle_places(100 + HALTED) == (last.found,)
    near, far = ABOUT + SETTINGS.radius - 0.05, ABOUT + SETTINGS.radius + 0.05  # m off it, still close enough to see
    later = 100 + HALTED + 1
    assert not halts(max(CLOSE, 0.4 - near), halting=halting, start=later)[0].stopped
    assert halts(0.4, bearing=far / (1.5 * SETTINGS.radius + 0.4) * 1.1, halting=halting, start=later + 1)[0].stopped
    assert halting.obstacle_places(100 + HALTED + SETTINGS.obstacle - 1) == (last.found,)
    assert halting.obstacle_places(100 + HALTED + SETTINGS.obstacle) == ()


@pytest.mark.parametrize("bearing", [0.0, 1.2])
def test_the_body_of_an_obstacle_is_where_the_rays_end_on_it_also_when_it_was_found_elsewhere(bearing: float) -> None:
    halting = ObstacleDetector(SETTINGS)
    halts(*[0.4] * (HALTED + 1), bearing=bearing, halting=halting)
    for off in (0.0, 0.1):  # it has come nearer since, and is explained by what was found
        (said,) = halts(0.4 - off, bearing=bearing, halting=halting, start=200)
        away = 2 * SETTINGS.radius + 0.4 - off
        assert not said.stopped
        (body,) = said.bodies
        assert body == pytest.approx((HERE.x + away * cos(bearing), HERE.y + away * sin(bearing), SETTINGS.radius))
    assert halts(STOP + 0.01, halting=halting, start=300)[0].bodies == ()
    x, y = ahead(0.4)
    others = (Record(robot="r2", stamp=100, x=x, y=y, goal=B, held=(cell(x, y),)),)
    assert halts(0.4, others=others)[0].bodies == (), "a robot that was heard is kept from by cells"


@pytest.mark.parametrize("speed", [0.3, -0.3])
def test_an_obstacle_that_was_found_to_stay_is_a_threat_when_it_moves(speed: float) -> None:
    halting = ObstacleDetector(SETTINGS)
    halts(*[0.8] * 3, *[0.5] * (HALTED + 1), halting=halting)
    moves = halts(*[0.5 - speed * SETTINGS.tick * tick for tick in range(12)], halting=halting, start=100 + HALTED + 4)
    assert bool(moves[-1].threats)


@pytest.mark.parametrize("speed", [0.3, -0.3])
def test_what_comes_or_goes_is_not_taken_to_stay_where_it_was(speed: float) -> None:
    """A moving obstacle: what was found in one place would explain it where it drives against the robot."""
    assert abs(speed) * SETTINGS.tick * HALTED > STILL, "slower than that it is as good as still"
    began = 0.5 if speed > 0 else 0.2
    said = halts(*[began - speed * SETTINGS.tick * tick for tick in range(2 * HALTED)])
    assert [halt[:2] for halt in said] == [(True, None)] * (2 * HALTED)


# --- what comes towards it ---


# fmt: off
APPROACHES: dict[str, tuple[float, float, bool]] = {  # m/s, of the thing and of the robot towards it -> is it a threat?
    "it comes to a robot that stands":          (0.3, 0.0, True),
    "both drive":                               (0.3, 0.6, True),
    "the robot drives towards one that stands": (0.0, 0.6, False),
    "both stand":                               (0.0, 0.0, False),
    "it goes, the robot follows":               (-0.3, 0.6, True),  # it may turn round
    "it goes":                                  (-0.3, 0.0, True),
}
# fmt: on


def threats(thing: float, robot: float, noise: float = 0.0) -> list[bool]:
    """Return for each tick whether a thing 1.2 m ahead is a threat; noise alternates."""
    halting, away = ObstacleDetector(SETTINGS), 1.2
    said = []
    for tick in range(2 * NOTED):
        driven, came = robot * SETTINGS.tick * tick, thing * SETTINGS.tick * tick
        read = away - driven - came + (noise if tick % 2 else -noise)
        scan = Scan((0.0,), (read,), lambda _: (1.6,))
        pose = HERE._replace(x=HERE.x + driven)
        said.append(halting.detect(TrafficInputs(100 + tick, pose, None, scan=scan), (), (), FLOOR.cells).threats != ())
    return said


@pytest.mark.parametrize("name", APPROACHES)
def test_what_moves_by_itself_is_a_threat(name: str) -> None:
    thing, robot, threatens = APPROACHES[name]
    said = threats(thing, robot)
    assert said[-1] is threatens
    assert not said[0], "one look tells nothing of motion"
    assert any(said) is threatens


def test_noise_is_no_motion() -> None:
    assert not any(threats(0.0, 0.0, noise=NEARER / 2 - 0.001))


def test_a_threat_is_believed_in_for_a_while_and_then_forgotten() -> None:
    said = halts(*[1.2 - 0.3 * SETTINGS.tick * tick for tick in range(2 * NOTED)], *[1.6] * (COMING + 1))
    lasts = [halt.threats != () for halt in said[2 * NOTED :]]
    assert lasts == [True] * (COMING - 1) + [False] * 2


def test_what_never_seems_to_be_still_is_taken_to_stay_at_last() -> None:
    """To a robot that turns, other edges of a body come into view."""
    said = halts(*[0.2 if tick % 4 < 2 else 0.4 for tick in range(AT_LAST + 2 * HALTED)])
    (found,) = [tick for tick, halt in enumerate(said) if halt.found is not None]
    assert AT_LAST <= found <= AT_LAST + HALTED


def test_a_thing_found_is_forgotten_after_a_while() -> None:
    said = halts(*[0.4] * (HALTED + 1 + SETTINGS.obstacle))
    stops = [halt.stopped for halt in said]
    assert stops == [True] * (HALTED + 1) + [False] * (SETTINGS.obstacle - 1) + [True]


def test_what_came_very_near_is_believed_in_a_little_longer() -> None:
    for near, lasts in ((CLOSE - 0.01, LINGERS - 1), (CLOSE + 0.01, 0)):
        said = halts(near, *[1.6] * 20)
        assert [halt.stopped for halt in said] == [True] + [True] * lasts + [False] * (20 - lasts)


def test_a_robot_is_known_where_it_was_heard_and_farther_off_the_older_that_is() -> None:
    x, y = ahead(0.4)
    held = (cell(x, y),)

    def stops(
        away: float,
        age: int,
        mine: frozenset[int] = frozenset(),
        held: tuple[int, ...] = held,
        speed: float | None = None,
    ) -> bool:
        record = Record(robot="r2", stamp=100 - age, x=x + away, y=y, speed=speed, goal=B, held=held)
        return halts(0.4, others=(record,), mine=mine)[0].stopped

    near = SETTINGS.radius + 0.15  # m, and how exactly a sector tells
    drives = SETTINGS.speed * SETTINGS.tick * 10
    gains = SETTINGS.reach_after(0.0, SETTINGS.tick * 10)[0]
    assert not stops(0.0, 0)
    assert not stops(near - 0.06, 0)
    assert stops(near + 0.06 + 0.3, 0)
    assert not stops(near - 0.06 + drives, 10)
    assert stops(near + 0.06 + 0.3 + drives, 10)
    assert not stops(near - 0.06 + drives, 10, speed=SETTINGS.speed)
    assert not stops(near - 0.06 + gains, 10, speed=0.0), "one that stood may gain speed"
    assert stops(near + 0.06 + 0.1 + gains, 10, speed=0.0), "but has not driven at its highest speed at once"
    assert stops(0.0, 0, mine=frozenset(held)), "in a cell that is mine alone nobody else is"
    assert stops(0.0, 0, held=(B,)), "nor where it holds nothing"


# fmt: off
BODIES = {  # age of its record [ticks], how far off the place heard of a hit is [m], in which cell: may be the robot
    "where it was heard":                   (0,     0.3,  "held",    True),
    "too far for now":                      (0,     0.4,  "held",    False),
    "as far as it may have driven":         (20,    1.1,  "held",    True),
    "farther than that":                    (20,    1.4,  "held",    False),
    "in a cell that it had not yet":        (2,     0.3,  "claimed", False),
    "in one that it may have taken since":  (20,    0.3,  "claimed", True),
    "a broadcast missed is not old":        (8,     0.3,  "claimed", False),
    "two missed are":                       (9,     0.3,  "claimed", True),
    "it may drive on for 1.5 s":            (200,   1.65, "held",    True),
    "for no longer":                        (200,   1.75, "held",    False),
    "silent for longer":                    (201,   0.95, "held",    False),
    "in one that it came to later":         (20,    0.3,  "ahead",   True),
    "in none of its cells":                 (20,    0.3,  "none",    False),
    "silent for long, it came to rest":     (1000,  0.8,  "held",    True),
    "and no farther":                       (1000,  1.0,  "held",    False),
    "it stood, and may have gained speed":  (10,    0.58, "stood",   True),
    "it stood, and cannot be so far":       (10,    0.62, "stood",   False),
}
# fmt: on


@pytest.mark.parametrize("name", BODIES)
def test_a_hit_may_be_on_a_robot_that_was_heard(name: str) -> None:
    age, off, kept, is_robot = BODIES[name]
    x, y = HERE.x, HERE.y + off
    cells = tuple(range(len(FLOOR.cells)))
    fields: dict[str, Any] = {"held": ()}
    match kept:
        case "held":
            fields = {"held": cells}
        case "claimed":
            fields = {"claims": tuple(Claim(cell, 1, 0) for cell in cells)}
        case "ahead":
            fields = {"ahead": FLOOR.cells.cells_under_disc(x, y, 0.01)}
        case "stood":
            fields = {"held": cells, "speed": 0.0}
    one = Record(robot="r2", stamp=0, x=HERE.x, y=HERE.y, goal=A, **fields)
    assert robot_at([one], age, FLOOR.cells, SETTINGS)((x, y)) is is_robot
    assert not robot_at([], age, FLOOR.cells, SETTINGS)((x, y))


# --- to the centimetre ---

# fmt: off
BEYOND: list[tuple[float, dict[float, float], bool]] = [  # how far off the place is [m], rays and lengths [rad, m]
    (1.0, {0.2: 0.79, -0.2: 0.79},            True),   # beside the ray the place is 0.98 m off; rays begin at 0.2 m
    (1.0, {0.2: 0.77, -0.2: 0.79},            False),
    (1.0, {0.2: 0.79, -0.2: 0.77},            False),
    (1.0, {0.2: 1.6},                         False),  # on one side only
    (1.0, {0.2: 1.6, 0.3: 1.6},               False),
    (1.0, {0.2: 1.6, -0.55: 1.6},             False),  # 0.52 m beside it
    (1.0, {0.2: 1.6, -0.51: 1.6, -0.6: 0.1},  True),   # 0.49 m; the last one does not count
    (0.4, {1.2: 1.6, -1.2: 1.6},              True),
    (0.4, {3.0: 1.6, -3.0: 1.6},              False),  # they point away
]
# fmt: on


@pytest.mark.parametrize(("away", "rays", "sees"), BEYOND)
@pytest.mark.parametrize("yaw", [0.0, 2.5])
def test_a_place_is_seen_beyond_between_two_rays(away: float, rays: dict[float, float], sees: bool, yaw: float) -> None:
    place = HERE.x + away * cos(yaw), HERE.y + away * sin(yaw)
    scan = Scan([0.3 + angle for angle in rays], list(rays.values()))
    assert scan.sees_beyond(place, HERE._replace(yaw=yaw - 0.3), 0.5, 0.2) is sees


def test_a_stop_in_ticks_and_metres() -> None:
    assert [halt.stopped for halt in halts(1.6, 1.6, start=0)] == [False, False]
    for then, found in ((0.4, 10), (0.48, 10), (0.52, 15)):
        said = halts(*[0.4] * 5, *[then] * 16)
        assert [tick for tick, halt in enumerate(said) if halt.found is not None] == [found], then
    said = halts(*[0.2 if tick % 4 < 2 else 0.4 for tick in range(80)])
    assert [60 <= tick <= 70 for tick, halt in enumerate(said) if halt.found is not None] == [True]
    for near, stops in ((0.14, 10), (0.16, 1)):
        assert [halt.stopped for halt in halts(near, *[1.6] * 20)] == [True] * stops + [False] * (21 - stops)


@pytest.mark.parametrize(("age", "stops"), [(0, False), (SETTINGS.fresh, False), (SETTINGS.fresh + 1, True)])
def test_a_robot_that_has_fallen_silent_does_not_explain_what_is_very_near(age: int, stops: bool) -> None:
    """It came to rest somewhere about: what is 0.14 m ahead may be it, and a robot must not drive at it."""
    x, y = ahead(0.14)
    record = Record(robot="r2", stamp=100 - age, x=x, y=y, goal=B, held=(cell(x, y),))
    assert halts(0.14, others=(record,))[0].stopped is stops
    assert not halts(0.16, others=(record,))[0].stopped


def test_a_robot_that_drives_up_from_afar_is_no_threat() -> None:
    """It is heard where it is, 1.6 m from the robot's middle and nearer; a thing that nobody tells of is one."""
    for told in (True, False):
        halting = ObstacleDetector(SETTINGS)
        for tick in range(24):
            x = HERE.x + 1.6 - 0.3 * SETTINGS.tick * tick
            record = Record(robot="r2", stamp=100 + tick, x=x, y=HERE.y, goal=B, held=tuple(range(len(FLOOR.cells))))
            others = (record,) if told else ()
            (halt,) = halts(x - HERE.x - 0.3, others=others, halting=halting, start=100 + tick, expected=3.0)
        assert bool(halt.threats) is not told


def test_what_is_far_off_is_not_watched() -> None:
    """From 1.4 m on it is: 0.3 m/s take it from 1.6 m there in 14 ticks, and 6 ticks more show that it comes."""
    said = halts(*[1.6 - 0.3 * SETTINGS.tick * tick for tick in range(30)], expected=3.0)
    assert next(tick for tick, halt in enumerate(said) if halt.threats) == 20
