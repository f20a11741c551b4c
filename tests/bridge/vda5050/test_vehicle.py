"""One vehicle, told by hand what the fleet and a master say: what it asks of the world, and the states that it tells."""

from math import pi
from typing import Any

import pytest
from msgspec import structs

from swarm.bridge.errand import OrderEnd, OrderErrand, OrderOutcome
from swarm.bridge.vda5050 import messages as vda
from swarm.bridge.vda5050.vehicle import Vehicle, WorldRequest
from swarm.errors import PeerError
from swarm.messages import Accepted, Activity, Liveness, Order, Phase, RobotAction, RobotDo, Seen
from tests.bridge.vda5050.shared import actions_of, heard, order_of, taken
from tests.messages.made import clock, event, state, truth
from tests.shared import scenario_of

SETTINGS = scenario_of().settings
A, B, C, D = ("A", 3.0, 0.0), ("B", 5.0, 2.0), ("C", 5.0, 6.0), ("D", 1.0, 6.0)
ROUTE = order_of(A, B, C)


class Told:
    """A vehicle of robot `a`, which stands at (3, 0), and a world that accepts what it is asked."""

    def __init__(self) -> None:
        self.vehicle = Vehicle("a", "map", SETTINGS)
        self.vehicle.take_clock(clock(run=1))
        self.vehicle.apply_message(state(0))
        self.numbers = 0
        self.at(0.0)

    def at(self, x: float, speed: float = 0.0) -> None:
        body = structs.replace(truth(0).bodies[0], x=3.0 + x, left_v=speed, right_v=speed)
        self.vehicle.apply_message(body)

    def order(self, order: dict[str, Any]) -> list[tuple[float, float]]:
        """Give an order that the world accepts; return its targets."""
        ask = self.vehicle.take_order(taken(order), "fresh")
        if ask is None:
            return []
        assert isinstance(ask.request, Order)
        self.numbers += 1
        self.answer(ask, Accepted(text="yes", number=self.numbers, run=1))
        return list(ask.request.targets)

    def answer(self, ask: WorldRequest, answer: Accepted | PeerError) -> OrderErrand | None:
        return self.vehicle.take_answer(ask, answer)

    def act(self, *kinds: str) -> list[RobotDo]:
        """Have instant actions that the world accepts; return what it was asked."""
        asks = self.vehicle.take_actions(heard(actions_of(*kinds)))
        for ask in asks:
            self.answer(ask, Accepted(text="yes"))
        return [ask.request.do for ask in asks if isinstance(ask.request, RobotAction)]

    def reaches(self, *reached: bool, **changed: Any) -> None:  # noqa: ANN401, fields of a state
        self.vehicle.apply_message(state(1, assignment=self.numbers, reached=list(reached), **changed))

    def ends(self, how: OrderOutcome, text: str = "a: order o1 is not done: so it is") -> None:
        assert self.vehicle.errand is not None
        self.vehicle.take_end(self.vehicle.errand, OrderEnd(how, text))

    def event(self, kind: str) -> None:
        self.vehicle.apply_message(structs.replace(event(1), kind=kind, robot="a"))

    @property
    def said(self) -> vda.State:
        return self.vehicle.state_message()

    @property
    def ahead(self) -> list[str]:
        return [node.node_id for node in self.said.node_states]

    @property
    def errors(self) -> list[tuple[str, str]]:
        return [(one.error_type, one.error_description) for one in self.said.errors]

    @property
    def actions(self) -> dict[str, str]:
        return {one.action_id: one.action_status for one in self.said.action_states}


@pytest.fixture
def told() -> Told:
    return Told()


def test_an_order_is_driven_node_by_node(told: Told) -> None:
    assert (told.said.order_id, told.said.last_node_id, told.said.driving) == ("", "", False)
    assert told.order(ROUTE) == [(5.0, 2.0), (5.0, 6.0)]
    assert (told.said.order_id, told.said.order_update_id, told.said.last_node_id) == ("o1", 0, "A")
    assert told.ahead == ["B", "C"]
    for step in (0.1, 0.2, 0.3):
        told.at(step, speed=0.5)
    assert (told.said.driving, told.said.distance_since_last_node) == (True, 0.3)
    told.reaches(True, False)
    assert (told.said.last_node_id, told.said.last_node_sequence_id, told.ahead) == ("B", 2, ["C"])
    assert told.said.distance_since_last_node == 0.0
    assert [edge.edge_id for edge in told.said.edge_states] == ["B-C"]
    told.ends(OrderOutcome.DONE)
    assert (told.said.order_id, told.said.last_node_id, told.ahead, told.errors) == ("o1", "C", [], [])


def test_the_name_of_the_order_in_the_fleet_is_the_masters_as_far_as_it_is_allowed(told: Told) -> None:
    ask = told.vehicle.take_order(taken(order_of(A, B, order_id="Füllen / 7 " + "x" * 100, update=2)), "0badcafe")
    assert ask is not None
    assert ask.request == Order(id="F_llen___7_" + "x" * 39 + ".0badcafe", update=2, targets=[(5.0, 2.0)])


def test_the_angles_of_nodes_are_headings_of_the_order(told: Told) -> None:
    order = order_of(A, B, C)
    order["nodes"][2]["nodePosition"]["theta"] = 3.1415927  # pi in single precision, which is more
    ask = told.vehicle.take_order(taken(order), "0badcafe")
    assert ask is not None
    assert isinstance(ask.request, Order)
    first, second = ask.request.headings
    assert first is None
    assert second == pytest.approx(-pi, abs=1e-6)


def test_an_order_of_the_node_where_it_stands_is_done_at_once(told: Told) -> None:
    assert told.order(order_of(A)) == []
    assert (told.said.order_id, told.said.last_node_id, told.ahead, told.vehicle.errand) == ("o1", "A", [], None)


def test_an_update_that_releases_more_drives_to_what_is_left_and_what_is_new(told: Told) -> None:
    told.order(order_of(A, B, C, D, released=2))
    assert told.said.new_base_request
    assert [node.released for node in told.said.node_states] == [True, False, False]
    first = told.vehicle.errand
    assert first is not None
    assert told.order(order_of(B, C, D, update=1, first=2, released=3)) == [(5.0, 2.0), (5.0, 6.0), (1.0, 6.0)]
    told.vehicle.take_end(first, OrderEnd(OrderOutcome.REPLACED, "by the update"))
    assert (told.ahead, told.errors, told.said.new_base_request) == (["B", "C", "D"], [], False)
    told.reaches(True, True, False)
    assert told.ahead == ["D"]


def test_an_update_that_changes_the_horizon_only_does_not_disturb_the_robot(told: Told) -> None:
    told.order(order_of(A, B, C, released=2))
    before = told.vehicle.errand
    assert told.order(order_of(B, D, update=1, first=2, released=1)) == []
    assert (told.ahead, told.vehicle.errand, told.said.order_update_id) == (["B", "D"], before, 1)
    told.ends(OrderOutcome.DONE)
    assert (told.ahead, told.said.new_base_request, told.said.last_node_id) == (["D"], True, "B")


def test_what_the_world_refuses_is_an_error_until_an_order_is_accepted(told: Told) -> None:
    ask = told.vehicle.take_order(taken(ROUTE), "fresh")
    assert ask is not None
    assert told.answer(ask, PeerError("order of a: target 1 at (5.0, 2.0): in a wall")) is None
    assert told.errors == [("orderError", "order of a: target 1 at (5.0, 2.0): in a wall")]
    assert told.said.order_id == ""
    told.order(order_of(B, C, order_id="o2"))
    assert [kind for kind, _ in told.errors] == ["orderError", "orderError"]
    told.order(order_of(A, B, order_id="o3"))
    assert (told.errors, told.said.order_id) == ([], "o3")


def test_a_message_that_cannot_be_read_is_an_error_with_what_it_says_of_itself(told: Told) -> None:
    told.vehicle.refuse_message("order", b'{"orderId": "o9"}', PeerError("it lacks all"))
    (error,) = told.said.errors
    assert (error.error_type, error.error_level, error.error_description) == (
        "validationError",
        "WARNING",
        "order: it lacks all",
    )
    assert {one.reference_key: one.reference_value for one in error.error_references} == {
        "topic": "order",
        "orderId": "o9",
    }
    for number in range(50):
        told.vehicle.refuse_message("order", b"", PeerError(str(number)))
    assert [text for _, text in told.errors] == [f"order: {number}" for number in range(40, 50)]


@pytest.mark.parametrize(
    "how",
    [
        OrderOutcome.REPLACED,
        OrderOutcome.CANCELLED,
        OrderOutcome.GIVEN_UP,
        OrderOutcome.AGAIN,
        OrderOutcome.OVER,
        OrderOutcome.ALONE,
    ],
)
def test_an_order_that_ends_undone_is_dropped_with_an_error(told: Told, how: OrderOutcome) -> None:
    told.order(ROUTE)
    told.ends(how)
    assert (told.ahead, told.said.edge_states, told.said.order_id) == ([], (), "o1")
    assert told.errors == [("orderError", "a: order o1 is not done: so it is")]


def test_a_run_that_is_started_again_drops_what_waited_for_its_horizon_too(told: Told) -> None:
    told.order(order_of(A, B, C, released=2))
    told.ends(OrderOutcome.DONE)
    told.vehicle.take_clock(clock(run=2))
    assert (told.ahead, told.said.last_node_id) == ([], "")
    assert told.errors == [("orderError", "the run was started again, without it")]


def test_the_order_of_a_lost_robot_waits_for_whoever_takes_its_place(told: Told) -> None:
    told.order(ROUTE)
    told.at(0.1, speed=0.5)
    told.act("startPause")
    lost = clock(run=1)
    lost.presence["a"] = Seen(Liveness.LOST, 1.0)
    told.vehicle.take_clock(lost)
    errand = told.vehicle.errand
    told.ends(OrderOutcome.LOST)
    assert told.ahead == ["B", "C"]
    assert [(one.error_type, one.error_level) for one in told.said.errors] == [("robotLost", "FATAL")]
    assert told.actions == {"startPause": "FAILED"}
    assert told.vehicle.resume_order() is None
    told.vehicle.take_clock(clock(run=1))
    assert told.vehicle.resume_order() is errand
    assert told.vehicle.resume_order() is None
    assert told.errors == []


def test_what_passes_by_itself_is_an_error_as_long_as_it_lasts(told: Told) -> None:
    gone = clock(run=1)
    gone.presence["a"] = Seen(Liveness.GONE, 1.0)
    told.at(0.1, speed=0.5)
    told.vehicle.take_clock(gone, alone=True)
    assert not told.said.driving
    assert [(one.error_type, one.error_level) for one in told.said.errors] == [
        ("worldAway", "FATAL"),
        ("robotGone", "WARNING"),
    ]
    told.vehicle.take_clock(clock(run=1))
    assert told.errors == []


def test_an_order_is_cancelled_when_the_robot_stands(told: Told) -> None:
    told.order(ROUTE)
    told.at(0.1, speed=0.5)
    assert told.act("cancelOrder#7") == [RobotDo.CANCEL]
    assert (told.actions, told.ahead) == ({"7": "RUNNING"}, ["B", "C"])
    assert told.act("cancelOrder#7") == [], "it is said again"
    told.ends(OrderOutcome.CANCELLED)
    assert (told.actions, told.ahead) == ({"7": "RUNNING"}, ["B", "C"])
    told.at(0.2)
    assert (told.actions, told.ahead, told.said.edge_states, told.errors) == ({"7": "FINISHED"}, [], (), [])
    assert told.act("cancelOrder#7") == [], "it is said again"
    assert told.actions == {"7": "FINISHED"}
    assert told.act("cancelOrder#8") == []
    assert told.actions == {"7": "FINISHED", "8": "FAILED"}
    assert told.errors == [("noOrderToCancel", "cancelOrder: expected an order to cancel, got none")]
    assert told.order(order_of(("A", 3.2, 0.0), B, order_id="o2")) == [(5.0, 2.0)]
    assert (told.actions, told.errors) == ({}, [])


def test_an_order_that_waits_for_its_horizon_is_cancelled_at_once(told: Told) -> None:
    told.order(order_of(A, B, C, released=2))
    told.ends(OrderOutcome.DONE)
    assert told.act("cancelOrder") == []
    assert (told.actions, told.ahead) == ({"cancelOrder": "FINISHED"}, [])


def test_an_order_that_was_done_before_it_could_be_cancelled_is_done(told: Told) -> None:
    told.order(ROUTE)
    told.act("cancelOrder")
    told.ends(OrderOutcome.DONE)
    assert (told.actions, told.said.last_node_id, told.errors) == ({"cancelOrder": "FINISHED"}, "C", [])


def test_a_pause_is_over_when_the_robot_stands_and_its_end_when_it_may_drive(told: Told) -> None:
    told.at(0.1, speed=0.5)
    assert told.act("startPause#1") == [RobotDo.STOP]
    assert (told.actions, told.said.paused) == ({"1": "RUNNING"}, True)
    told.at(0.1)
    assert told.actions == {"1": "FINISHED"}
    assert told.act("stopPause#2") == [RobotDo.GO_ON]
    assert (told.actions, told.said.paused) == ({"1": "FINISHED", "2": "FINISHED"}, False)
    assert told.act("startPause#1") == [RobotDo.STOP], "an id that is used again is another action"


def test_others_pause_it_too(told: Told) -> None:
    told.event("stop")
    assert told.said.paused
    told.event("go_on")
    assert not told.said.paused
    told.vehicle.take_clock(clock(run=1, phase=Phase.PAUSED))
    told.at(0.1, speed=0.5)
    assert (told.said.paused, told.said.driving) == (True, False)
    late = Vehicle("a", "map", SETTINGS)
    late.apply_message(state(0, activity=Activity.STOPPED))
    assert late.state_message().paused


def test_requests_are_answered_and_unknown_actions_are_not_done(told: Told) -> None:
    told.vehicle.owes.clear()
    assert told.act("stateRequest", "factsheetRequest", "pick#9") == []
    assert told.vehicle.owes == {"state", "factsheet"}
    assert told.actions == {"stateRequest": "FINISHED", "factsheetRequest": "FINISHED", "9": "FAILED"}
    (error,) = told.said.errors
    assert {one.reference_key: one.reference_value for one in error.error_references} == {
        "actionId": "9",
        "actionType": "pick",
    }
    assert error.error_description.startswith("pick: expected one of cancelOrder, startPause")


def test_an_action_that_the_world_refuses_is_not_done(told: Told) -> None:
    (ask,) = told.vehicle.take_actions(heard(actions_of("startPause")))
    told.answer(ask, PeerError("a is lost"))
    assert (told.actions, told.errors) == ({"startPause": "FAILED"}, [("instantActionError", "startPause: a is lost")])


def test_only_the_last_actions_that_are_over_are_told(told: Told) -> None:
    told.order(ROUTE)
    told.at(0.1, speed=0.5)
    told.act("cancelOrder", *(f"stateRequest#{number}" for number in range(50)))
    assert list(told.actions) == [*(str(number) for number in range(30, 50)), "cancelOrder"]


def test_nothing_is_taken_before_its_place_is_known() -> None:
    vehicle = Vehicle("a", "map", SETTINGS)
    assert vehicle.take_order(taken(ROUTE), "fresh") is None
    said = vehicle.state_message()
    assert (said.agv_position, vehicle.visualization_message(), [one.error_type for one in said.errors]) == (
        None,
        None,
        ["orderError"],
    )


def test_it_says_for_whom_it_waits_and_what_it_does_not_heed(told: Told) -> None:
    order = order_of(A, B)
    order["edges"][0]["maxSpeed"] = 0.3
    told.order(order)
    told.reaches(False, waits=["b"])
    assert [one.info_description for one in told.said.information] == [
        "it plans its own way, and does not heed: edge.maxSpeed", "waits for b",
    ]  # fmt: skip


def test_a_run_that_is_over_drops_what_waited_for_its_horizon(told: Told) -> None:
    told.order(order_of(A, B, C, released=2))
    told.ends(OrderOutcome.DONE)
    told.vehicle.take_clock(clock(run=1, phase=Phase.OVER))
    assert (told.ahead, told.errors) == ([], [("orderError", "the run is over")])


def test_a_way_is_measured_from_the_last_node_and_a_jump_is_no_way(told: Told) -> None:
    told.at(0.3)
    assert told.said.distance_since_last_node == 0.3
    told.at(9.0)
    assert told.said.distance_since_last_node == 0.3
    told.at(0.0)
    told.order(ROUTE)
    assert told.said.distance_since_last_node == 0.0


def test_a_pause_that_ends_before_the_robot_stands_has_failed(told: Told) -> None:
    told.at(0.1, speed=0.5)
    told.act("startPause#1", "stopPause#2")
    assert told.actions == {"1": "FAILED", "2": "FINISHED"}
    assert not told.said.paused
