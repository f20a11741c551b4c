"""Which contacts a robot could have avoided by stopping, for motions that are made by hand."""

import msgspec
import pytest

from swarm.geometry import Pose
from swarm.settings import MoverSettings
from tests.shared import scenario_of
from world.bodies.roster import Roster
from world.bodies.shapes import Contact
from world.measure.contact_cause import MOVES, Blame
from world.measure.state import RecorderState

DT = 0.05  # s
RADIUS = 0.2  # m, of the robots and of the disc
WALL, BOX, OTHER = (Contact(0, kind, other) for kind, other in (("wall", None), ("obstacle", None), ("robot", 1)))
STANDS, DRIVES, TURNS, BACKS = (0.0, 0.0), (0.5, 0.5), (0.5, -0.5), (-0.5, -0.5)
TOUCHES = 20  # the tick of the contact, at which the robot is at the origin


def mover(
    speed: float, direction: float, at: tuple[float, float], **shape: float | tuple[float, float]
) -> MoverSettings:
    """Return a moving obstacle along x, to the right for a ``direction`` of 1.0, ``at`` a place at the contact."""
    x, y = at
    begin = x - direction * speed * TOUCHES * DT
    return msgspec.convert(
        {"speed": speed, "waypoints": [(begin, y), (begin + direction * 50.0, y)], **shape}, MoverSettings
    )


AHEAD, BEHIND = (2 * RADIUS, 0.0), (-2 * RADIUS, 0.0)
DISC, LONG = {"radius": RADIUS}, {"size": (4.0, 0.2)}
# fmt: off
CONTACTS: dict[str, tuple[Contact, tuple[float, float], list[MoverSettings], bool]] = {
    # what the robot touches, its rim speeds, moving obstacles: could it have avoided that
    "it drives into a wall":                       (WALL, DRIVES, [], True),
    "it backs into a wall":                        (WALL, BACKS, [], True),
    "it drives into a robot":                      (OTHER, DRIVES, [], True),
    "it creeps into a wall":                       (WALL, (MOVES * 1.1, MOVES * 1.1), [], True),
    "it drives into a block that stands":          (BOX, DRIVES, [], True),
    "it drives into a block, a mover is far off":  (BOX, DRIVES, [mover(1.0, -1.0, (2.0, 0.0), **DISC)], True),
    "it stands":                                   (OTHER, STANDS, [], False),
    "it turns on the spot":                        (OTHER, TURNS, [], False),
    "a faster mover comes from ahead":             (BOX, DRIVES, [mover(1.0, -1.0, AHEAD, **DISC)], False),
    "a slower mover comes from ahead":             (BOX, DRIVES, [mover(0.3, -1.0, AHEAD, **DISC)], True),
    "a faster mover comes from behind":            (BOX, DRIVES, [mover(1.0, 1.0, BEHIND, **DISC)], False),
    "it catches up with a slower mover":           (BOX, DRIVES, [mover(0.3, 1.0, AHEAD, **DISC)], True),
    "it backs into a mover that comes slower":     (BOX, BACKS, [mover(0.3, 1.0, BEHIND, **DISC)], True),
    "a mover comes, but the robot touches a wall": (WALL, DRIVES, [mover(1.0, -1.0, AHEAD, **DISC)], True),
    "a large mover comes":                         (BOX, DRIVES, [mover(1.0, -1.0, (2.2, 0.0), radius=2.0)], False),
    "a long box comes, end ahead":                 (BOX, DRIVES, [mover(1.0, -1.0, (2.2, 0.0), **LONG)], False),
    "it drives into the end of a long box":        (BOX, DRIVES, [mover(0.3, -1.0, (2.2, 0.0), **LONG)], True),
    "a second mover comes":
        (BOX, DRIVES, [mover(0.3, -1.0, AHEAD, **DISC), mover(1.0, 1.0, BEHIND, **DISC)], False),
}
# fmt: on


def blame(movers: list[MoverSettings], wheels: tuple[float, float], until: int = TOUCHES) -> Blame:
    """Return the memory of a robot that drives along x at these rim speeds, before the tick ``until``."""
    one = Blame(movers, roster("r1", "r2"), RecorderState(last=[place(0, wheels)]), DT)
    for tick in range(1, until):
        assert one.look(tick, [], [], [wheels], [place(tick, wheels)]) == []
    return one


def roster(*names: str) -> Roster:
    return Roster(scenario_of(robot={"radius": RADIUS}), list(names))


def place(tick: int, wheels: tuple[float, float]) -> Pose:
    return Pose(sum(wheels) / 2 * (tick - TOUCHES) * DT, 0.0, 0.0)


@pytest.mark.parametrize("name", CONTACTS)
def test_a_contact_counts_if_its_robot_could_have_avoided_it_by_stopping(name: str) -> None:
    contact, wheels, movers, expected = CONTACTS[name]
    one = blame(movers, wheels)
    assert one.look(TOUCHES, [contact], [contact], [wheels], [place(TOUCHES, wheels)]) == [expected]


def test_the_side_of_a_long_box_that_passes_does_not_come() -> None:
    passing, up = mover(1.0, 1.0, (0.0, RADIUS + 0.1), size=(4.0, 0.2)), (0.5, 0.5)
    one = Blame([passing], roster("r1"), RecorderState(last=[Pose(0.0, -0.5 * DT * TOUCHES, 0.0)]), DT)
    for tick in range(1, TOUCHES):
        one.look(tick, [], [], [up], [Pose(0.0, 0.5 * DT * (tick - TOUCHES), 0.0)])
    assert one.look(TOUCHES, [BOX], [BOX], [up], [Pose(0.0, 0.0, 0.0)]) == [True], "the robot drove into its side"


# fmt: off
PUSHES: dict[str, tuple[list[list[Contact]], bool]] = {  # what touches from the push on: could it have avoided the wall
    "pressed from the push to the wall":     ([[BOX], [BOX], [BOX]],   False),
    "pressed against a wall and on":         ([[BOX], [OTHER], [BOX]], False),
    "let go before the wall":                ([[BOX], [], []],         True),
    "let go, then another one touches":      ([[BOX], [], [OTHER]],    True),
    "touched by a robot only":               ([[OTHER], [OTHER]],      True),
}
# fmt: on


@pytest.mark.parametrize("name", PUSHES)
def test_who_is_pushed_is_not_to_blame_until_it_is_let_go(name: str) -> None:
    touching, expected = PUSHES[name]
    one = blame([], DRIVES)
    for tick, row in enumerate(touching, start=TOUCHES):
        one.look(tick, row if tick == TOUCHES else [], row, [DRIVES], [place(tick, DRIVES)])
    last = TOUCHES + len(touching)
    assert one.look(last, [WALL], [WALL], [DRIVES], [place(last, DRIVES)]) == [expected]


def test_a_robot_that_joins_is_judged_like_the_others() -> None:
    coming = mover(1.0, -1.0, AHEAD, **DISC)
    one = blame([coming], STANDS, until=TOUCHES - 3)
    one.add_robot(Pose(0.0, 0.0, 0.0))
    for tick in range(TOUCHES - 3, TOUCHES):
        one.look(tick, [], [], [STANDS, DRIVES], [Pose(9.0, 9.0, 0.0), place(tick, DRIVES)])
    poses = [Pose(9.0, 9.0, 0.0), place(TOUCHES, DRIVES)]
    hits = [Contact(1, "obstacle", None), Contact(1, "wall", None)]
    assert one.look(TOUCHES, hits, hits, [STANDS, DRIVES], poses) == [False, True]
