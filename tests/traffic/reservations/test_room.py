"""Room beside the way, a stop within the way, and a restarted way: one robot's traffic, stepped by hand."""

from collections.abc import Iterator, Mapping

import numpy as np
import pytest
from msgspec.structs import replace

from swarm.geometry import Pose, distance
from swarm.maps.occupancy import OccupancyMap, Point
from swarm.messages.traffic import Claim, Moving, Record, TrafficBroadcast
from swarm.traffic.interface import TrafficActivity, TrafficInputs, TrafficOutputs
from swarm.traffic.lattice.cell_map import CellMap
from swarm.traffic.settings import LEANS, TrafficConstants
from swarm.traffic.step import Traffic
from tests.traffic.maps import SIDE, Drawn

FLOOR = Drawn("........", ".a....b.", "........", "........", "..c.....")
SETTINGS = TrafficConstants()
A, B, C = FLOOR.at("abc")
GOAL = FLOOR.cells.centre(B)
UP = FLOOR.cells.columns
ROOM = A + UP  # beside the way of the robot at a
NOTHING: Mapping[str, object] = {}
FAR_OFF = C  # where r2 stands: near enough to be asked


def other(tick: int, answered: Record | None, refused: tuple[int, ...], says: Mapping[str, object]) -> TrafficBroadcast:
    """Make what r2 says at a tick; it acknowledges all that ``answered`` claims but the cells ``refused``."""
    x, y = FLOOR.cells.centre(FAR_OFF)
    claims = answered.claims if answered is not None else ()
    given = tuple(("r1", claim.number) for claim in claims if claim.cell not in refused)
    said = Record(robot="r2", stamp=tick, x=x, y=y, goal=C, held=(C,), acks=given)
    return TrafficBroadcast(own=replace(said, **says), others=())


class Driven:
    """A robot's traffic that is stepped with r2 in range."""

    def __init__(self, sweeps: tuple[int, ...] = (ROOM,), settings: TrafficConstants = SETTINGS) -> None:
        self.traffic = Traffic("r1", FLOOR.cells, settings)
        self.tick, self.sweeps = 0, sweeps
        self.said: Record | None = None

    def run(
        self,
        ticks: int,
        cell: int = A,
        *,
        refused: tuple[int, ...] = (),
        alone: bool = False,
        says: Mapping[str, object] = NOTHING,
        back: float = 0.0,
    ) -> Iterator[TrafficOutputs]:
        """Stand ``back`` [m] from the middle of a cell for some ticks; ``says`` are fields of r2's records."""
        for _ in range(ticks):
            heard = [] if alone else [other(self.tick, self.said, refused, says)]
            pose = FLOOR.pose(cell)
            pose = pose._replace(x=pose.x - back)
            granted = self.traffic.step(
                TrafficInputs(self.tick, pose, GOAL, heard=heard, sweeps=self.sweeps), FLOOR.cells
            )
            self.said = granted.broadcast.own if granted.broadcast is not None else self.said
            self.tick += 1
            yield granted

    def claimed(self) -> set[int]:
        """Return the cells that it has said to claim."""
        assert self.said is not None
        return {claim.cell for claim in self.said.claims}


LONG = SETTINGS.listen + 3 * SETTINGS.ripe + 4 * SETTINGS.every  # ticks in which it has listened, claimed and taken

# --- room beside the way ---

# fmt: off
NEEDED: dict[str, tuple[dict[str, object], bool]] = {  # what r2 says besides: does r1 ask for the cell beside its way?
    "nothing of it":        ({},                                        True),
    "it holds it":          ({"held": (C, ROOM)},                       False),
    "it claims it":         ({"claims": (Claim(ROOM, 1, 0),)},          False),
    "it will come there":   ({"ahead": (ROOM,)},                        False),
    "it needs another":     ({"ahead": (ROOM + 1,)},                    True),
}
# fmt: on


@pytest.mark.parametrize("name", NEEDED)
def test_room_beside_the_way_is_asked_for_only_where_nobody_else_needs_it(name: str) -> None:
    fields, asks = NEEDED[name]
    robot = Driven()
    claims = [robot.claimed() for _ in robot.run(LONG, refused=(ROOM,), says=fields) if robot.said is not None]
    assert any(ROOM in cells for cells in claims) is asks
    assert any(A + 1 in cells for cells in claims), "the way itself is asked for anyhow"


@pytest.mark.parametrize(
    ("fields", "asks"), [({"ahead": (ROOM,)}, True), ({"held": (C, ROOM)}, False)], ids=["planned", "held"]
)
def test_before_a_threat_it_asks_for_what_others_only_plan_to_use(fields: dict[str, object], asks: bool) -> None:
    x, y = FLOOR.cells.centre(A)
    coming = Moving(x, y - 1.5, 0.0, 0.3, 0)
    robot = Driven(())
    list(robot.run(LONG - 20, refused=(ROOM,), says={**fields, "moving": (coming,)}))
    moving = (coming._replace(tick=robot.tick),)
    claims = [robot.claimed() for _ in robot.run(20, refused=(ROOM,), says={**fields, "moving": moving})]
    assert any(ROOM in cells for cells in claims) is asks


def test_no_room_is_asked_for_before_there_is_a_way_on() -> None:
    """Beside the one cell that it stands in it has nowhere to go."""
    robot = Driven()
    claims = [robot.claimed() for _ in robot.run(LONG, refused=(ROOM, A + 1)) if robot.said is not None]
    assert not any(ROOM in cells for cells in claims)
    assert any(A + 1 in cells for cells in claims)


def test_room_is_held_once_all_near_have_acknowledged_and_no_sooner() -> None:
    robot = Driven()
    assert not any(ROOM in granted.held for granted in robot.run(2 * LONG, refused=(ROOM,)))
    (*_, last) = robot.run(LONG)
    assert ROOM in last.held
    assert ROOM in last.drivable, "and is driven in"
    assert ROOM not in last.way, "but is no part of the way"
    assert last.held[-1] in range(A + 1, B), "nor its head"


def test_room_is_acknowledged_to_nobody_while_it_is_held_and_given_back_to_who_asks() -> None:
    robot = Driven()
    (*_, last) = robot.run(LONG)
    assert ROOM in last.held
    claim = Claim(ROOM, 7, robot.tick)
    said = [(ROOM in granted.held, robot.said) for granted in robot.run(4 * SETTINGS.every, says={"claims": (claim,)})]
    for held, record in said[SETTINGS.every :]:
        assert not held
        assert record is not None
        assert ROOM not in record.held
        assert ("r2", 7) in record.acks


@pytest.mark.parametrize("fields", [{"ahead": (ROOM,)}, {"held": (C, ROOM)}])
def test_room_is_given_back_to_who_will_come_there(fields: dict[str, object]) -> None:
    robot = Driven()
    assert ROOM in list(robot.run(LONG))[-1].held
    assert ROOM not in list(robot.run(2, says=fields))[-1].held


def test_a_cell_ahead_that_another_robot_holds_too_is_given_back_and_claimed_like_any() -> None:
    """Two that started in one cell both held it: one went on beyond it, and could never drive through."""
    shared: dict[str, object] = {"held": (C, A + 1)}
    robot = Driven(())
    assert A + 1 in list(robot.run(LONG))[-1].held
    assert list(robot.run(2, cell=A + 1, says=shared))[-1].held[0] == A + 1, "its body is there"
    robot = Driven(())
    assert A + 1 in list(robot.run(LONG))[-1].held
    assert A + 1 not in list(robot.run(2, says=shared))[-1].held


def test_room_that_is_no_longer_wanted_is_given_back_and_its_claim_withdrawn() -> None:
    robot = Driven()
    assert ROOM in list(robot.run(LONG))[-1].held
    robot.sweeps = ()
    assert ROOM not in list(robot.run(2))[-1].held
    asking = Driven()
    list(asking.run(LONG, refused=(ROOM,)))
    assert ROOM in asking.claimed()
    asking.sweeps = ()
    list(asking.run(SETTINGS.every, refused=(ROOM,)))
    assert ROOM not in asking.claimed()


def test_room_is_kept_while_the_body_is_in_it() -> None:
    robot = Driven()
    assert ROOM in list(robot.run(LONG))[-1].held
    assert ROOM in list(robot.run(5, cell=ROOM, says={"ahead": (ROOM,)}))[-1].held


def test_only_cells_next_to_the_way_are_room() -> None:
    away = A + 2 * UP
    robot = Driven((away, ROOM))
    claims = [robot.claimed() for _ in robot.run(LONG, refused=(ROOM,)) if robot.said is not None]
    assert not any(away in cells for cells in claims)
    assert any(ROOM in cells for cells in claims)


def test_who_is_alone_asks_for_no_room() -> None:
    """It drives where it likes, and holds what it touches."""
    robot = Driven()
    for granted in robot.run(LONG, alone=True):
        assert ROOM not in granted.held
    assert granted.unconstrained
    assert ROOM in granted.drivable


# --- a stop on the way ---


def driven_alone(goal: Point, done: bool = False) -> TrafficOutputs:
    """Return what a robot at a is granted that has listened and is alone."""
    traffic = Traffic("r1", FLOOR.cells, SETTINGS)
    for tick in range(LONG):
        granted = traffic.step(TrafficInputs(tick, FLOOR.pose(A), goal, done=done), FLOOR.cells)
    return granted


def test_a_stop_in_a_cell_that_it_drives_through_is_where_it_drives_to() -> None:
    x, y = FLOOR.cells.centre(A + 2)
    stop = (x + 0.2, y - 0.1)
    granted = driven_alone(stop)
    assert granted.exactly
    assert not granted.looks
    assert distance(granted.waypoints[-1], stop) < 1e-9
    assert len(granted.waypoints) == 3


def test_where_no_stop_is_left_no_place_has_to_be_come_to_exactly() -> None:
    assert not driven_alone(FLOOR.cells.centre(A + 1), done=True).exactly


def test_a_stop_farther_on_than_what_it_drives_through_cuts_nothing() -> None:
    robot = Driven(())
    (*_, last) = robot.run(LONG)
    assert last.held[-1] in range(A + 1, B)
    assert not last.exactly
    head, following = last.way[len(last.held) - 1 :][:2]
    assert last.waypoints[-1] == FLOOR.cells.leaning_point(head, following, SETTINGS.leaning_room)


# --- off its way ---


def test_a_robot_that_has_been_off_its_way_for_long_begins_it_anew_where_it_is() -> None:
    robot = Driven(())
    assert list(robot.run(LONG))[-1].held[0] == A
    strayed = list(robot.run(2 * LONG, cell=ROOM))
    assert strayed[0].held[-1] != ROOM, "not at once: it may come back"
    assert ROOM in strayed[0].held
    assert strayed[-1].way[0] == ROOM
    assert strayed[-1].way[-1] == B
    assert all(ROOM in granted.held for granted in strayed)
    heads = [granted.held[-1] for granted in strayed]
    assert ROOM in heads, "it gave back all that lay ahead"


def test_a_cell_that_the_margin_alone_touches_is_not_taken_when_the_way_begins_anew() -> None:
    """Nobody has granted it: another may hold it."""
    robot, touches = Driven(()), SIDE / 2 - SETTINGS.radius - SETTINGS.margin / 2
    list(robot.run(LONG))
    strayed = list(robot.run(2 * LONG, cell=ROOM, back=touches))
    assert strayed[-1].way[0] == ROOM
    assert not any(ROOM - 1 in granted.held for granted in strayed)


def test_a_robot_that_comes_back_soon_keeps_its_way() -> None:
    robot = Driven(())
    before = list(robot.run(LONG))[-1].held
    for _ in range(5):
        list(robot.run(10, cell=ROOM))
        back = list(robot.run(10))
    assert back[-1].held[-len(before) :] == before
    assert all(before[-1] in granted.held for granted in back)


@pytest.mark.parametrize(("back", "claims"), [(0.0, True), (LEANS - 0.01, True), (LEANS + 0.01, False)])
def test_where_walls_stop_the_radio_it_claims_from_the_middle_of_its_cell_alone(back: float, claims: bool) -> None:
    """From there it hears all that may claim the next cell."""
    robot = Driven((), TrafficConstants(in_sight=True))
    assert any(A + 1 in robot.claimed() for _ in robot.run(LONG, back=back) if robot.said is not None) is claims


# --- an edit under it ---


def fine(*rows: str) -> CellMap:
    """Make cells of a map whose characters are a third of a cell wide."""
    solid = np.array([[character == "#" for character in row] for row in rows], dtype=np.uint8)
    return CellMap(OccupancyMap(solid[::-1].copy(), SIDE / 3, Pose(0.0, 0.0, 0.0)), side=SIDE, radius=0.23)


def test_where_an_edit_leaves_it_in_a_cell_that_is_none_to_stand_in_it_drives_to_the_one_beside() -> None:
    before, after = fine(*["." * 15] * 9), fine(*["." * 15] * 3, *[".....#" + "." * 9] * 3, *["." * 15] * 3)
    (row, left), goal = (5 + 1, 5), before.centre(5 + 4)
    assert before.stands[row]
    assert not after.stands[row]
    traffic = Traffic("r1", before, SETTINGS)
    pose = Pose(SIDE + 0.3, 1.5 * SIDE, 0.0)  # in that cell alone
    assert before.cells_under_disc(pose.x, pose.y, SETTINGS.radius + SETTINGS.margin) == (row,)
    traffic.step(TrafficInputs(0, pose, goal), before)
    for tick in range(1, LONG):
        granted = traffic.step(TrafficInputs(tick, pose, goal), after)
    assert granted.activity is not TrafficActivity.CUT_OFF
    assert left in granted.held, "asked for as any other cell"
    assert granted.way[:2] == (row, left)
    there = Pose(*after.centre(left), 0.0)
    for tick in range(LONG, 2 * LONG):
        granted = traffic.step(TrafficInputs(tick, there, goal), after)
    assert granted.way[0] == left
    assert granted.way[-1] == after.cell_of(*goal), "and goes on to where it wanted to be"
    assert row not in granted.way
