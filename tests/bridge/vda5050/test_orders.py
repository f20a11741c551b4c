"""Which orders and updates a vehicle takes: the standard's rules as a table, and a law over whole lives of orders."""

from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm.bridge.vda5050 import messages as vda
from swarm.bridge.vda5050.orders import OrderNode, VehicleOrder, VehiclePosition, judge_order
from swarm.geometry import Pose
from tests.bridge.vda5050.shared import order_of, taken

FLOOR = VehiclePosition(Pose(1.0, 2.0, 0.0), "map", 0.4)
A, B, C, D = ("A", 1.0, 2.0), ("B", 5.0, 2.0), ("C", 5.0, 6.0), ("D", 1.0, 6.0)
DONE = VehicleOrder("o0", 3, OrderNode("Z", 8))


def took(order: dict[str, Any], now: VehicleOrder = DONE, floor: VehiclePosition = FLOOR) -> VehicleOrder:
    verdict = judge_order(taken(order), now, floor)
    assert isinstance(verdict, VehicleOrder), verdict
    return verdict


def refused(order: dict[str, Any], now: VehicleOrder = DONE, floor: VehiclePosition = FLOOR) -> tuple[str, str]:
    verdict = judge_order(taken(order), now, floor)
    assert isinstance(verdict, vda.Error)
    assert verdict.error_level == "WARNING"
    names = {one.reference_key: one.reference_value for one in verdict.error_references}
    assert names.items() >= {("orderId", order["orderId"]), ("orderUpdateId", str(order["orderUpdateId"]))}
    return verdict.error_type, verdict.error_description


def ahead(one: VehicleOrder) -> list[str]:
    return [node.node_id for node in one.nodes]


def base(one: VehicleOrder) -> list[str]:
    return [node.node_id for node in one.base]


HALF = took(order_of(A, B, C, released=2))  # C is in the horizon
ON_B = HALF.ahead_after(HALF.nodes[0])


def test_a_new_order_begins_where_the_vehicle_stands() -> None:
    assert HALF.last == OrderNode("A", 0)
    assert (ahead(HALF), base(HALF)) == (["B", "C"], ["B"])
    assert [edge.edge_id for edge in HALF.edges] == ["A-B", "B-C"]
    assert (ON_B.last, ahead(ON_B), [edge.edge_id for edge in ON_B.edges]) == (OrderNode("B", 2), ["C"], ["B-C"])
    only = took(order_of(A))
    assert (only.last, only.nodes) == (OrderNode("A", 0), ())


@pytest.mark.parametrize(
    ("x", "deviation", "there"),
    [(1.4, None, True), (1.4, 0.0, True), (1.41, 0.0, False), (1.41, 0.1, False), (2.0, 1.0, True), (2.01, 1.0, False)],
)  # fmt: skip
def test_it_stands_there_within_the_deviation_but_never_less_than_it_drives_to(
    x: float, deviation: float | None, there: bool
) -> None:
    order = order_of(("A", x, 2.0), B)
    order["nodes"][0]["nodePosition"]["allowedDeviationXY"] = deviation
    if there:
        assert ahead(took(order)) == ["B"]
    else:
        assert refused(order)[0] == "orderError"


def test_the_last_node_may_begin_an_order_from_wherever_it_was_left() -> None:
    left = DONE._replace(last=OrderNode("far", 4))
    far = ("far", 5.0, 5.0)
    assert ahead(took(order_of(far, B), left)) == ["far", "B"]
    said = "nodes[0] far at (5, 5): expected within 0.5 m of the vehicle, which is 5.00 m away at (1.00, 2.00), or its last node; begin where it stands"
    assert refused(order_of(far, B)) == ("orderError", said)


def other(order: dict[str, Any], change: Callable[[dict[str, Any]], object]) -> dict[str, Any]:
    change(order)
    return order


LIFT = {"actionType": "pick", "actionId": "7", "blockingType": "HARD"}


@pytest.mark.parametrize(
    ("change", "kind", "said"),
    [
        (lambda o: o["edges"].pop(), "validationError", "edges: expected one between each two of 3 nodes, got 1"),
        (lambda o: o["edges"].append(o["edges"][0]), "validationError", "edges: expected one between each two of 3 nodes, got 3"),
        (lambda o: o["nodes"][0].update(released=False), "validationError", "nodes[0]: expected a released node, got one of the horizon"),
        (lambda o: o["nodes"][1].update(released=False), "validationError", "edges[0]: expected all of the base before all of the horizon"),
        (lambda o: o["edges"][1].update(released=False), "validationError", "edges[1]: expected all of the base before all of the horizon"),
        (lambda o: o["edges"][1].update(endNodeId="A"), "validationError", "edges[1]: expected from 'B' to 'C', got from 'B' to 'A'"),
        (lambda o: o["nodes"][2].update(sequenceId=2), "validationError", "edges[1]: expected sequenceIds that rise from node to edge to node, got 2, 3, 2"),
        (lambda o: o["nodes"][1]["actions"].append(LIFT), "orderError", "nodes[1].actions: expected none, got 'pick'; this vehicle only drives"),
        (lambda o: o["edges"][0]["actions"].append(LIFT), "orderError", "edges[0].actions: expected none, got 'pick'; this vehicle only drives"),
        (lambda o: o["nodes"][1].pop("nodePosition"), "orderError", "nodes[1].nodePosition: expected one, got none"),
        (lambda o: o["nodes"][2]["nodePosition"].update(mapId="up"), "orderError", "nodes[2].nodePosition.mapId: expected 'map', got 'up'"),
        (lambda o: o.update(zoneSetId="z"), "orderError", "zoneSetId: expected none, got 'z'; this vehicle has no zones"),
    ],
)  # fmt: skip
def test_an_order_that_cannot_be_done_is_refused_with_the_standards_error(
    change: Callable[[dict[str, Any]], object], kind: str, said: str
) -> None:
    assert refused(other(order_of(A, B, C), change)) == (kind, said)


@pytest.mark.parametrize(
    ("order", "now", "kind", "said"),
    [
        (order_of(A, order_id="o2"), HALF, "orderError", "expected no new order before order o1 is done, got o2; cancel that one"),
        (order_of(A, order_id="o2"), ON_B, "orderError", "expected no new order before order o1 is done, got o2; cancel that one"),
        (order_of(A, B), HALF._replace(update=4), "orderUpdateError", "orderUpdateId: expected more than 4, got 0; this update is void"),
        (order_of(C, D, update=1, first=4), HALF, "orderUpdateError", "nodes[0]: expected 'B' with sequenceId 2, where the base of order o1 ends, got 'C' with sequenceId 4"),
        (order_of(B, D, update=1, first=4), HALF, "orderUpdateError", "nodes[0]: expected 'B' with sequenceId 2, where the base of order o1 ends, got 'B' with sequenceId 4"),
        (order_of(A, B, update=1), ON_B, "orderUpdateError", "nodes[0]: expected 'B' with sequenceId 2, where the base of order o1 ends, got 'A' with sequenceId 0"),
    ],
)  # fmt: skip
def test_what_does_not_follow_from_what_it_has_is_refused(
    order: dict[str, Any], now: VehicleOrder, kind: str, said: str
) -> None:
    assert refused(order, now) == (kind, said)


def test_the_same_update_again_changes_nothing() -> None:
    assert judge_order(taken(order_of(C, D)), HALF, FLOOR) is None


def test_an_update_goes_on_from_the_end_of_the_base_and_replaces_the_horizon() -> None:
    while_it_drives = took(order_of(B, D, C, update=1, first=2, released=2), HALF)
    assert (base(while_it_drives), ahead(while_it_drives), while_it_drives.update) == (["B", "D"], ["B", "D", "C"], 1)
    assert [edge.edge_id for edge in while_it_drives.edges] == ["A-B", "B-D", "D-C"]
    while_it_waits = took(order_of(B, D, update=2, first=2), ON_B)
    assert (base(while_it_waits), ahead(while_it_waits)) == (["D"], ["D"])
    after_its_end = took(order_of(D, A, update=3, first=4), while_it_waits.ahead_after(while_it_waits.nodes[0]))
    assert ahead(after_its_end) == ["A"]


def test_what_is_not_heeded_is_named() -> None:
    order = order_of(A, B)
    order["nodes"][1]["nodePosition"] |= {"theta": 1.0, "allowedDeviationTheta": 0.05, "allowedDeviationXY": 0.1}
    order["edges"][0] |= {"maxSpeed": 0.2, "trajectory": {"degree": 1}, "rotationAllowed": True}
    assert took(order).ignored == (
        "nodePosition.allowedDeviationTheta below 0.1 rad", "nodePosition.allowedDeviationXY below 0.4 m",
        "edge.maxSpeed", "edge.trajectory",
    )  # fmt: skip
    assert HALF.ignored == ()


places = st.lists(st.sampled_from([B, C, D]), min_size=1, max_size=6)


@given(places, st.integers(1, 7), st.lists(st.integers(0, 3), max_size=12))
def test_whatever_is_released_in_whatever_pieces_is_driven_in_order(
    route: list[tuple[str, float, float]], first: int, steps: list[int]
) -> None:
    """A master releases a route piece by piece while the vehicle drives: every node is passed once, in order."""
    nodes = [A, *route]
    released = min(first, len(nodes))
    now, passed, update = took(order_of(*nodes, released=released)), 0, 0
    while passed < len(nodes) - 1:
        more = steps.pop() if steps else len(nodes)  # nodes to release; 0: drive
        if now.base and (not more or released == len(nodes)):
            now = now.ahead_after(now.base[0])
            passed += 1
        elif more:
            start, released, update = released - 1, min(released + more, len(nodes)), update + 1
            order = order_of(*nodes[start:], update=update, first=2 * start, released=released - start)
            now = took(order, now)
        assert now.last.sequence_id == 2 * passed
        assert ahead(now) == [name for name, _, _ in nodes[passed + 1 :]]
        assert len(now.base) == released - 1 - passed
        assert len(now.edges) == len(now.nodes)
