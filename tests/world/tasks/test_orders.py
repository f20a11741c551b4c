"""The book of orders: every refusal and every action as a table, and laws for any sequence of requests."""

from collections.abc import Sequence
from typing import NamedTuple

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm.errors import PeerError
from swarm.maps.occupancy import Point
from swarm.messages import Order, RobotAction, RobotDo
from world.tasks.orders import FATES, KEPT, MOST_TARGETS, REMEMBERED, OrderChange, Orders, StopProgress

HOME = (0.5, 0.5)
OWN = [(1.0, 1.0), HOME]
WALL = (9.0, 9.0)
Request = Order | RobotAction


def check(targets: Sequence[Point]) -> None:
    if WALL in targets:
        raise PeerError("no way leads there")


def order(name: str = "a", update: int = 0, *targets: Point, home: bool = False) -> Order:
    return Order(id=name, update=update, targets=list(targets or [(2.0, 2.0)]), home=home)


def turned(*headings: float | None, update: int = 0) -> Order:
    return Order(id="a", update=update, targets=[(2.0, 2.0)], headings=list(headings))


def do(what: str) -> RobotAction:
    return RobotAction(do=RobotDo(what))


class Fleet:
    """Two robots and how far they are."""

    def __init__(self) -> None:
        self.book = Orders(("r1", "r2"), [OWN, OWN], returns=True)
        self.reached: list[list[float | None]] = [[None, None], [None, None]]

    def take(self, request: Request, robot: int = 0) -> OrderChange:
        outcome = self.book.take(robot, request, self.progress(robot), HOME, check)
        if outcome.new_stops:
            self.reached[robot] = [None] * len(self.book.rows[robot].stops)
        return outcome

    def arrive(self, robot: int = 0) -> None:
        self.reached[robot] = [1.0] * len(self.reached[robot])

    def progress(self, robot: int) -> StopProgress:
        return StopProgress(self.reached[robot], 0)

    def state(self) -> bytes:
        return msgspec.msgpack.encode((self.book.last, self.book.rows, self.reached))


class Row(NamedTuple):
    """Requests that come before, the request, and what is expected of it."""

    before: list[Request]
    request: Request
    expected: str  # part of the answer or of the refusal


# fmt: off
REFUSED = {
    "no target":            Row([], Order(id="a", targets=[]), "expected 1 to 100 targets, got 0"),
    "too many targets":     Row([], order("a", 0, *[(1.0, 1.0)] * (MOST_TARGETS + 1)), "expected 1 to 100 targets, got 101"),
    "no way":               Row([], order("a", 0, WALL), "no way leads there"),
    "an older update":      Row([order("a", 2)], order("a", 1), "expected update 2 or a newer one"),
    "other targets":        Row([order("a", 2)], order("a", 2, (3.0, 3.0)), "expected the targets that were accepted with it"),
    "then home, or not":    Row([order("a")], order("a", home=True), "expected the targets that were accepted with it"),
    "too many headings":    Row([], turned(1.0, 2.0), "expected at most 1 headings, one for each target, got 2"),
    "other headings":       Row([turned(1.0)], turned(1.1), "expected the targets that were accepted with it"),
    "without its heading":  Row([turned(1.0)], order("a"), "expected the targets that were accepted with it"),
    "replaced meanwhile":   Row([order("a"), order("b")], order("a"), "number 1 was superseded"),
    "cancelled meanwhile":  Row([order("a"), do("cancel")], order("a"), "number 1 was cancelled"),
    "older, and replaced":  Row([order("a", 5), order("b")], order("a", 4), "expected update 5"),
}
CARRIED_OUT = {  # and what is in force then: number, stops, home, stopped
    "an order":             (Row([], order(), "r1: order a update 0 is number 1: 1 target"), (1, [(2.0, 2.0)], False, False)),
    "then home":            (Row([], order(home=True), "1 target, then home"), (1, [(2.0, 2.0), HOME], True, False)),
    "a newer update":       (Row([order("a", 1)], order("a", 3), "is number 2"), (2, [(2.0, 2.0)], False, False)),
    "another order":        (Row([order("a", 1)], order("b"), "is number 2"), (2, [(2.0, 2.0)], False, False)),
    "a replaced one again": (Row([order("a"), order("b")], order("a", 1), "is number 3"), (3, [(2.0, 2.0)], False, False)),
    "stop":                 (Row([], do("stop"), "r1 stops"), (0, OWN, True, True)),
    "go on":                (Row([do("stop")], do("go_on"), "r1 goes on"), (0, OWN, True, False)),
    "home":                 (Row([], do("home"), "r1 has the way home now, number 1"), (1, [HOME], True, False)),
    "cancel":               (Row([], do("cancel"), "r1 has no targets now, number 1"), (1, [], False, False)),
    "an order while stopped": (Row([do("stop")], order(), "is number 1"), (1, [(2.0, 2.0)], False, True)),
    "home while stopped":   (Row([do("stop")], do("home"), "number 1"), (1, [HOME], True, True)),
    "home from an order home": (Row([order(home=True)], do("home"), "number 2"), (2, [HOME], True, False)),
}
NOTHING_TO_DO = {
    "stop":                 Row([do("stop")], do("stop"), "r1 is stopped already"),
    "go on":                Row([], do("go_on"), "r1 is not stopped"),
    "home":                 Row([do("home")], do("home"), "r1 drives home already, or is there"),
    "cancel":               Row([do("cancel")], do("cancel"), "r1 has no target left"),
    "the same order":       Row([order()], order(), "r1: order a update 0 is number 1: 1 target"),
    "the same headings":    Row([turned(1.0)], turned(1.0), "r1: order a update 0 is number 1: 1 target"),
}
# fmt: on


@pytest.mark.parametrize("name", REFUSED)
def test_a_request_is_refused_with_the_reason_and_changes_nothing(name: str) -> None:
    row, fleet = REFUSED[name], Fleet()
    for request in row.before:
        fleet.take(request)
    before = fleet.state()
    with pytest.raises(PeerError, match=row.expected):
        fleet.take(row.request)
    assert fleet.state() == before


@pytest.mark.parametrize("name", CARRIED_OUT)
def test_a_request_is_carried_out_and_told(name: str) -> None:
    (before, request, expected), force = CARRIED_OUT[name]
    fleet = Fleet()
    for one in before:
        fleet.take(one)
    outcome, row = fleet.take(request), fleet.book.rows[0]
    assert outcome.changed
    assert expected in outcome.text
    assert (row.number, row.stops, row.home, row.stopped) == force
    assert fleet.book.rows[1] == Fleet().book.rows[1]
    assert outcome.events


@pytest.mark.parametrize("name", NOTHING_TO_DO)
def test_what_is_so_already_is_no_error_and_changes_nothing(name: str) -> None:
    row, fleet = NOTHING_TO_DO[name], Fleet()
    for request in row.before:
        fleet.take(request)
    before = fleet.state()
    outcome = fleet.take(row.request)
    assert (outcome.text, outcome.new_stops, outcome.changed, outcome.events) == (row.expected, False, False, ())
    assert fleet.state() == before


def test_a_robot_is_told_the_headings_of_its_order_and_of_no_other() -> None:
    fleet = Fleet()
    fleet.take(turned(1.0))
    told = fleet.book.assigned_stops(0)
    assert told is not None and told.headings == [1.0]  # noqa: PT018
    fleet.take(order("b"))
    told = fleet.book.assigned_stops(0)
    assert told is not None and told.headings == []  # noqa: PT018


def test_who_loses_is_named() -> None:
    fleet = Fleet()
    assert [kind for kind, _ in fleet.take(order("a")).events] == ["superseded", "order"]
    (kind, text), _ = fleet.take(order("b", 4)).events
    assert (kind, text) == (
        "superseded", "order a update 0 (number 1): 1 left; superseded by order b update 4 (number 2)"
    )  # fmt: skip
    (kind, text), _ = fleet.take(do("home")).events
    assert (kind, text) == ("cancelled", "order b update 4 (number 2): 1 left; cancelled by the way home (number 3)")


def test_nobody_loses_by_an_order_that_was_done_and_its_retry_is_answered() -> None:
    fleet = Fleet()
    text = fleet.take(order("a")).text
    fleet.arrive()
    assert [kind for kind, _ in fleet.take(order("b")).events] == ["order"]
    assert fleet.take(order("a")) == OrderChange(text, 1)
    assert [one.fate for one in fleet.book.history(0, fleet.progress(0))] == ["superseded", "done", "open"]


def test_the_oldest_stops_are_forgotten_and_still_counted() -> None:
    fleet = Fleet()
    for number in range(KEPT + 5):
        fleet.take(order(f"o{number}"))
        fleet.arrive() if number % 2 else None
    row = fleet.book.rows[0]
    assert (len(row.past), row.past[-1].number) == (KEPT, KEPT + 4)
    assert row.older == {"superseded": 3, "done": 2}


def test_the_oldest_ids_are_forgotten() -> None:
    fleet = Fleet()
    for number in range(REMEMBERED + 1):
        fleet.take(order(f"o{number}"))
    assert list(fleet.book.rows[0].given) == [f"o{number}" for number in range(1, REMEMBERED + 1)]


points = st.sampled_from([(1.0, 1.0), (2.0, 2.0), (3.0, 3.0), WALL])
requests = st.one_of(
    st.builds(
        Order,
        id=st.sampled_from("ab"),
        update=st.integers(0, 3),
        targets=st.lists(points, max_size=3),
        home=st.booleans(),
    ),
    st.builds(RobotAction, do=st.sampled_from(RobotDo)),
)
steps = st.lists(st.tuples(st.integers(0, 1), st.one_of(requests, st.none())), max_size=30)


@given(steps)
def test_the_latest_accepted_request_is_in_force_and_the_same_again_changes_nothing(
    story: list[tuple[int, Request | None]],
) -> None:
    """None: the robot reaches all its stops. Nothing is lost: every number is in the history of one robot, once."""
    fleet = Fleet()
    expected: list[tuple[list[Point], bool]] = [(OWN, False)] * 2  # stops, stopped
    for robot, request in story:
        if request is None:
            fleet.arrive(robot)
            continue
        try:
            outcome = fleet.take(request, robot)
        except PeerError:
            outcome = OrderChange("")
        stops, stopped = expected[robot]
        match request:
            case Order() if outcome.new_stops:
                stops = [*request.targets, *([HOME] if request.home else [])]
            case RobotAction(do=RobotDo.HOME):
                stops = [HOME]
            case RobotAction(do=RobotDo.CANCEL) if None in fleet.reached[robot] or outcome.new_stops:
                stops = []
            case RobotAction(do=RobotDo.STOP | RobotDo.GO_ON):
                stopped = request.do is RobotDo.STOP
        expected[robot] = stops, stopped
        if outcome.text:
            before = fleet.state()
            again = fleet.take(request, robot)
            assert (again.changed, fleet.state()) == (False, before)
            assert isinstance(request, RobotAction) or again.text == outcome.text
        assert [(row.stops, row.stopped) for row in fleet.book.rows] == expected
    history = [fleet.book.history(robot, fleet.progress(robot)) for robot in range(2)]
    assert sorted(one.number for rows in history for one in rows if one.number) == list(range(1, fleet.book.last + 1))
    assert all(one.fate in FATES for rows in history for one in rows[:-1])
