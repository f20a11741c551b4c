"""What a robot is said to do, where it may drive, and what it tells: tables of decisions that are made by hand."""

import pytest
from msgspec.structs import replace

from swarm.messages.traffic import Claim, Epoch, JointPlan, Record
from swarm.traffic.interface import TrafficActivity, TrafficInputs
from swarm.traffic.joint.protocol import JointPlanning
from swarm.traffic.joint.states import FollowedPlan, Frozen
from swarm.traffic.obstacles.detector import ProtectiveStop
from swarm.traffic.outputs import (
    SLACK,
    RecordWriter,
    StepResult,
    activity,
    cells_ahead,
    find_hinderers,
    has_stop_ahead,
    must_reach_point,
    waypoints,
)
from swarm.traffic.own_route import GoalCell
from swarm.traffic.peers.situation import Situation
from swarm.traffic.reservations.route import ALONE, BESIDE, Footprint, RouteProgress
from swarm.traffic.reservations.rules import Reservations
from swarm.traffic.settings import TrafficConstants
from tests.traffic.maps import Drawn

ROW = Drawn("abcdefgh", "i.......")
A, B, C, D, E, F, G, H = ROW.at("abcdefgh")
SETTINGS = TrafficConstants()
HEARD = Record(robot="r2", stamp=0, x=0.0, y=0.0, goal=A)


def doing(
    held: str = "a", route: str = "bc", goal: str = "d", *, joint: JointPlanning | None = None,
    shut: str = "", holds: str = "", done: bool = False, idle: bool = False, stopped: bool = False,
    **changes: object,
) -> StepResult:  # fmt: skip
    """Return the decisions of a robot in a that drives to the middle of d, with r2 in hearing, which ``holds`` cells.

    Bodies were seen in the cells that are ``shut``.
    """
    aim, heard = GoalCell(), {"r2": replace(HEARD, held=ROW.at(holds))}
    aim.cell, aim.wish = ROW.at(goal)[0], ROW.points(goal)[0]
    plain = StepResult(
        inputs=TrafficInputs(5, ROW.pose(A), aim.wish), body=Footprint(5, ROW.pose(A), A, frozenset({A})),
        situation=Situation(
            tick=5, cells=ROW.cells, head=A, goal=ROW.at(goal)[0], idle=idle, blocked=frozenset(ROW.at(shut)),
            others=heard, fresh=heard, done=done,
        ),
        progress=RouteProgress(Reservations(ROW.at(held)), (ALONE,) * len(held), ROW.at(route)),
        goal=aim, joint=joint or JointPlanning("r1", SETTINGS), waits=(), listens=False, halt=ProtectiveStop(stopped),
        face=None, leans_to=None, free_drive=(), moved=0, room=(), threats=(), speaks=True, events=(),
    )  # fmt: skip
    return plain._replace(**changes)  # type: ignore[arg-type]


def standing() -> JointPlanning:
    joint = JointPlanning("r1", SETTINGS)
    joint.call = Frozen(Epoch(3, "r2"), 3)
    return joint


def following() -> JointPlanning:
    joint = JointPlanning("r1", SETTINGS)
    joint.following = FollowedPlan("r1", JointPlan(epoch=Epoch(3, "r2"), ways={}, after={}), (), 3, 140, {})
    return joint


# fmt: off
ACTIVITIES: dict[str, tuple[StepResult, str]] = {
    "nothing is in its way":                (doing(),                                              "driving"),
    "halted, whatever else":                (doing(stopped=True, listens=True, joint=standing()),  "halted"),
    "stands for a plan, whatever else":     (doing(listens=True, joint=standing()),                "standing"),
    "listens before it looks":              (doing(listens=True, face=(1.0, 1.0)),                 "listening"),
    "looks before it waits":                (doing(face=(1.0, 1.0), waits=("r2",)),                "looking"),
    "is there":                             (doing("d", "", waits=("r2",)),                        "arrived"),
    "has to pass its goal's cell":          (doing("d", "e"),                                      "driving"),
    "waits":                                (doing(waits=("r2",)),                                 "waiting"),
    "waits, but has a cell to drive into":  (doing("ab", "c", waits=("r2",)),                      "driving"),
    "no way leads there":                   (doing("a", ""),                                       "cut_off"),
    "was sent aside":                       (doing("a", "", joint=following()),                    "waiting"),
    "a body stands on its goal":            (doing("a", "b", "b", shut="b"),                       "cut_off"),
    "and it waits for that robot":          (doing("a", "b", "b", shut="b", waits=("r2",)),        "waiting"),
    "it drives up to that body":            (doing("ab", "c", "c", shut="c"),                      "driving"),
    "a body stands farther on":             (doing("a", "bc", "c", shut="c"),                      "driving"),
}
# fmt: on

# fmt: off
HINDERED: dict[str, tuple[StepResult, tuple[str, ...]]] = {  # whom a robot is said to wait for; r2 holds d
    "whom it asks":                       (doing(waits=("r3",)),                                   ("r3",)),
    "nobody, it drives":                  (doing("a", "bcd", "d", shut="d", holds="d"),            ()),
    "who stands on its goal":             (doing("a", "b", "b", shut="b", holds="b"),              ("r2",)),
    "a thing stands there":               (doing("a", "b", "b", shut="b", holds="d"),              ()),
    "who shuts the only way":             (doing("a", "", "f", shut="d", holds="d"),               ("r2",)),
    "the way is shut before that robot":  (doing("a", "", "f", shut="bd", holds="d"),              ()),
    "nobody, a wall shuts it":            (doing("a", "", "f", holds="d"),                         ()),
}
# fmt: on


@pytest.mark.parametrize("name", HINDERED)
def test_a_robot_that_is_shut_off_names_who_stands_there(name: str) -> None:
    decisions, robots = HINDERED[name]
    assert find_hinderers(decisions, activity(decisions)) == robots


@pytest.mark.parametrize("name", ACTIVITIES)
def test_what_a_robot_does_is_the_first_that_applies(name: str) -> None:
    decisions, what = ACTIVITIES[name]
    assert activity(decisions) is TrafficActivity(what)


def test_a_robot_needs_an_exact_place_to_look_or_to_be_heard_from() -> None:
    in_sight = TrafficConstants(in_sight=True)
    for decisions, settings, exact in (
        (doing(), SETTINGS, False),
        (doing(), in_sight, True),
        (doing(route=""), in_sight, False),
        (doing(leans_to=B), SETTINGS, True),
        (doing(waits=("r2",)), SETTINGS, False),
        (doing(waits=("r2", "r3")), SETTINGS, True),
    ):
        assert must_reach_point(decisions, settings) is exact


# fmt: off
AHEAD: dict[str, tuple[StepResult, int, str]] = {  # from which of the held cells on: the cells to drive through
    "those held":                       (doing("abc", "ef", "h"),                       0, "abc"),
    "from where it is":                 (doing("abc", "ef", "h"),                       1, "bc"),
    "to the next stop":                 (doing("abcd", "ef", "c"),                      1, "bc"),
    "past a place to stand":            (doing("abcd", "ef", "c", done=True), 1, "bcd"),
    "past it without a goal":           (doing("abcd", "ef", "c", idle=True), 1, "bcd"),
    "as far as it sees, drives freely": (doing("ab", "cdefg", "h", free_drive=(A,)),    0, "abcde"),
    "freely to the next stop":          (doing("ab", "cdefg", "d", free_drive=(A,)),    0, "abcd"),
}
# fmt: on


@pytest.mark.parametrize("name", AHEAD)
def test_the_way_ahead_ends_at_the_head_or_at_the_next_stop(name: str) -> None:
    decisions, place, cells = AHEAD[name]
    got = cells_ahead(decisions, place)
    assert got == ROW.at(cells)
    assert has_stop_ahead(decisions, got) is ("stop" in name)


def points(
    decisions: StepResult, cells: str, alone: str, settings: TrafficConstants = SETTINGS
) -> list[tuple[float, float]]:
    return list(waypoints(decisions, ROW.at(cells), ROW.at(alone), settings))


def test_a_robot_drives_over_the_middles_of_its_cells() -> None:
    assert points(doing("abc", "", "h"), "abc", "abc") == ROW.points("abc")
    assert points(doing("abc", "", "h"), "abc", "bc") == ROW.points("bc"), "another robot is in a too"
    assert points(doing("a", "", "h"), "a", "") == [ROW.cells.centre(A)], "and there is nowhere else: it stays"
    moved = TrafficInputs(5, ROW.pose(A)._replace(x=0.9), None)
    assert points(doing("a", "", "h", inputs=moved), "a", "") == [(0.9, ROW.cells.centre(A)[1])]
    free = doing("a", "bcd", "h", free_drive=(A, B))
    assert points(free, "abc", "abc") == ROW.points("abc"), "nobody keeps it out of the next cells"


def test_a_robot_drives_up_to_the_next_cell_of_its_way() -> None:
    x, y = ROW.points("c")[0]
    assert points(doing("abc", "d", "h"), "abc", "abc") == [*ROW.points("abc"), pytest.approx((x + 0.29, y))]


def test_the_last_point_is_the_stop_itself() -> None:
    x, y = ROW.points("c")[0]
    stop = doing("abc", "d", "c")
    stop.goal.wish = (x + 0.1, y - 0.1)
    assert points(stop, "abc", "abc") == [*ROW.points("ab"), pytest.approx((x + 0.1, y - 0.1))]
    last = doing("abc", "", "c", done=True)
    last.goal.wish = (x + 0.5, y)
    assert points(last, "abc", "abc") == [*ROW.points("ab"), pytest.approx((x + 0.32, y))], "where it fits in the cell"
    last = doing("abc", "", "h")
    assert points(last, "abc", "abc") == ROW.points("abc"), "its goal is elsewhere"


def test_who_leans_drives_on_to_where_it_leans() -> None:
    """A robot leans 0.6 - 0.31 m out of the middle of its cell."""
    x, y = ROW.points("a")[0]
    assert points(doing("a", "bc", "h", leans_to=B), "a", "a") == [(x, y), pytest.approx((x + 0.29, y))]
    assert points(doing("a", "bc", "h", leans_to=C), "a", "a") == [(x, y)], "it looks from the middle"


def test_where_walls_stop_the_radio_a_robot_leans_round_a_corner() -> None:
    corner, radio = Drawn("ab#", "#cd"), TrafficConstants(in_sight=True)
    a, b = corner.at("ab")
    way = RouteProgress(Reservations((a,)), (ALONE,), (b,))
    x, y = corner.cells.centre(a)
    at_corner = doing("a", "b", "h", progress=way)
    at_corner = at_corner._replace(situation=at_corner.situation._replace(cells=corner.cells))
    assert list(waypoints(at_corner, (a,), (a,), radio)) == [(x, y), pytest.approx((x + 0.29, y))]
    assert points(doing("a", "bc", "h"), "a", "a", radio) == ROW.points("a"), "no corner"


@pytest.mark.parametrize(
    ("slot", "often", "turns"),
    [(0, False, [0, 4, 8]), (1, False, [3, 7, 11]), (1, True, [1, 3, 5, 7, 9, 11]), (5, False, [3, 7, 11])],
)
def test_a_robot_tells_in_its_turn(slot: int, often: bool, turns: list[int]) -> None:
    telling = RecordWriter("r1", SETTINGS, slot, ROW.cells.side)
    assert [tick for tick in range(12) if telling.is_due(tick, often=often)] == turns


@pytest.mark.parametrize(
    ("steps", "follows", "left", "entered"),
    [((4, 5), True, 4, 5), ((4, 5), False, 0, 0), ((ALONE, 0), True, 0, 0), ((ALONE, ALONE), True, 0, 0)],
)
def test_a_record_says_how_far_the_plan_is_that_the_robot_follows(
    steps: tuple[int, ...], follows: bool, left: int, entered: int
) -> None:
    way = RouteProgress(Reservations((A, B)), steps, ROW.at("cdefgha"))
    decisions = doing("ab", progress=way, joint=following() if follows else None, moved=2, waits=("r2",))
    told = RecordWriter("r1", SETTINGS, 0, ROW.cells.side).record(decisions, (), ())
    assert (told.left, told.entered, told.epoch is not None) == (left, entered, follows)
    assert (told.held, told.ahead) == ((A, B), ROW.at("cdefgh")), "six cells ahead at most"
    assert (told.stamp, told.goal, told.moved, told.waits, told.idle) == (5, D, 2, ("r2",), False)


def test_claims_of_others_are_acknowledged_if_they_may_ask_this_robot() -> None:
    telling, others = RecordWriter("r1", SETTINGS, 0, ROW.cells.side), {"r2": replace(HEARD, claims=(Claim(C, 7, 0),))}

    def acks(held: Reservations, heard: dict[str, Record]) -> tuple[tuple[str, int], ...]:
        plain = doing(progress=RouteProgress(held, (ALONE,) * len(held.held)))
        return telling.record(plain._replace(situation=plain.situation._replace(others=heard)), (), ()).acks

    free, mine = Reservations((A,)), Reservations((A, C))
    assert acks(free, others) == (("r2", 7),)
    assert acks(mine, others) == ()
    assert acks(mine, {"r2": replace(HEARD, claims=(Claim(B, 8, 0),))}) == (("r2", 8),)
    pose, asks = doing().inputs.pose, SETTINGS.asking_distance(ROW.cells.side)
    for off, answered in ((asks + SLACK - 0.01, True), (asks + SLACK + 0.01, False)):
        far = {"r2": replace(others["r2"], x=pose.x + off, y=pose.y)}
        assert bool(acks(free, far)) is answered, "its newest record may be a little old, but not so much"


def test_from_beside_its_way_a_robot_drives_into_the_way_and_to_no_other_cell_beside_it() -> None:
    """It drove from each of two such cells to the middle of the other one, for minutes, and all waited for it."""
    two = Drawn("abcd", "efgh")
    cells = {name: two.at(name)[0] for name in "abcdefgh"}

    def way_from(here: str) -> str:
        held, steps = ("f", "g", "c", "b", "a"), (BESIDE, BESIDE, ALONE, ALONE, ALONE)
        way = RouteProgress(Reservations(tuple(cells[name] for name in held)), steps, ())
        decisions = doing("a", "", "h", progress=way)
        decisions = decisions._replace(situation=decisions.situation._replace(cells=two.cells))
        names = {cell: name for name, cell in cells.items()}
        return "".join(names[cell] for cell in cells_ahead(decisions, held.index(here)))

    assert way_from("f") == "fba", "not over g, nor back to c"
    assert way_from("g") == "gcba"
    assert way_from("b") == "ba"
    around = doing("a", "", "h", progress=RouteProgress(Reservations((cells["f"], cells["b"])), (BESIDE, ALONE), ()))
    around = around._replace(situation=around.situation._replace(cells=two.cells))
    f, b = two.points("fb")
    assert list(waypoints(around, (cells["f"], cells["b"]), (cells["f"], cells["b"]), SETTINGS)) == [f, b]
